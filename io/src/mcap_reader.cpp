// SPDX-License-Identifier: MIT
#include <bevel/io/mcap_reader.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include <bevel/io/mcap_container.hpp>
#include "mcap_compression.hpp"

namespace bevel::io::mcap {
namespace {

constexpr std::size_t kMostPlaces = 8;  // of one fault, that are told one by one
// Limit for all compressed chunks together: the largest file without compression (kLargestMcap_bytes).
constexpr std::size_t kLargestTotal_bytes = std::size_t{3} << 30U;

// Takes fields from a record's content. What is not there is 0 or empty, and is_whole() says so.
class Fields {
 public:
  explicit Fields(std::string_view content) : left_(content) {}
  template <class Integer>
  Integer whole() {
    const std::string_view bytes = take(sizeof(Integer));
    return bytes.empty() ? 0 : get<Integer>(bytes.data());
  }
  std::string_view text() { return take(whole<std::uint32_t>()); }
  std::string_view bytes() { return take(whole<std::uint64_t>()); }
  std::string_view left() const { return left_; }
  bool is_whole() const { return is_whole_; }

 private:
  std::string_view take(std::uint64_t size) {
    if (size > left_.size()) {
      is_whole_ = false;
      left_ = {};
      return {};
    }
    const std::string_view taken = left_.substr(0, size);
    left_.remove_prefix(size);
    return taken;
  }
  std::string_view left_;
  bool is_whole_ = true;
};

struct Record {
  Op op{};
  std::string_view content;
};

// The record at the front of `bytes`; nothing if it leads beyond them.
std::optional<Record> record_at(std::string_view bytes) {
  if (bytes.size() < kRecordHead) return std::nullopt;
  const auto size = get<std::uint64_t>(bytes.data() + 1);
  if (size > bytes.size() - kRecordHead) return std::nullopt;
  return Record{static_cast<Op>(static_cast<std::uint8_t>(bytes[0])), bytes.substr(kRecordHead, size)};
}

struct Channel {
  std::string topic, encoding;  // copies: the chunk may have been decompressed
  bool operator==(const Channel&) const = default;
};

struct Summary {
  std::vector<std::uint64_t> starts;  // of chunks and attachments, growing
  std::optional<std::uint64_t> messages, attachments;
};

class Reader {
 public:
  Reader(std::string_view file, const Handler& handler) : file_(file), handler_(handler) {}

  Damage read() {
    if (!file_.starts_with(kMagic)) {
      damage_.note(Fault::magic, 0, "does not begin as an MCAP file of version 0 does");
      return std::move(damage_);
    }
    read_summary();
    read_data();
    if (summary_.messages && *summary_.messages != messages_)
      damage_.note(Fault::missing, summary_start_,
                   std::to_string(messages_) + " messages were read of " + std::to_string(*summary_.messages) +
                       " that the file says it has");
    if (summary_.attachments && *summary_.attachments != attachments_)
      damage_.note(Fault::missing, summary_start_,
                   std::to_string(attachments_) + " attachments were read of " + std::to_string(*summary_.attachments) +
                       " that the file says it has");
    return std::move(damage_);
  }

 private:
  // A summary that is not sound is as good as none.
  void read_summary() {
    constexpr std::size_t kTail = kRecordHead + kFooterContent;
    if (file_.size() < 2 * kMagic.size() + kTail || !file_.ends_with(kMagic)) return say_cut();
    const std::size_t footer_at = file_.size() - kMagic.size() - kTail;
    const auto footer = record_at(file_.substr(footer_at));
    if (!footer || footer->op != Op::footer || footer->content.size() != kFooterContent) return say_cut();
    Fields fields(footer->content);
    const auto start = fields.whole<std::uint64_t>();
    const auto offsets_start = fields.whole<std::uint64_t>();  // of the summary's own index, which is not read
    const auto crc = fields.whole<std::uint32_t>();
    const std::size_t from = start == 0 ? footer_at : start;  // 0: it has no summary, and the CRC is of the footer's
    const std::size_t checked = footer_at + kTail - sizeof crc - from;
    if (start != 0 && (start < kMagic.size() || start > footer_at))
      return damage_.note(Fault::record, footer_at, "the summary would begin at byte " + std::to_string(start));
    if (offsets_start != 0 && (offsets_start < from || offsets_start > footer_at))
      return damage_.note(Fault::record, footer_at,
                          "the summary's index would begin at byte " + std::to_string(offsets_start));
    if (crc != 0 && crc32_of(file_.substr(from, checked)) != crc)
      return damage_.note(Fault::crc, from, "the summary has not its CRC-32");
    if (start == 0) return;
    summary_start_ = start;
    for (std::string_view left = file_.substr(start, footer_at - start); !left.empty();) {
      const auto record = record_at(left);
      if (!record) {
        summary_ = {};
        return damage_.note(Fault::record, footer_at - left.size(), "a record of the summary leads beyond it");
      }
      left.remove_prefix(kRecordHead + record->content.size());
      take_summary_record(*record);
    }
    std::ranges::sort(summary_.starts);
  }

  void say_cut() {
    damage_.note(Fault::cut, file_.size(), "the file does not end as an MCAP file does: cut off, or overwritten");
  }

  void take_summary_record(const Record& record) {
    Fields fields(record.content);
    if (record.op == Op::channel) add_channel(record);
    if (record.op == Op::chunk_index) {
      fields.whole<std::uint64_t>(), fields.whole<std::uint64_t>();
      summary_.starts.push_back(fields.whole<std::uint64_t>());
    }
    if (record.op == Op::attachment_index) summary_.starts.push_back(fields.whole<std::uint64_t>());
    if (record.op == Op::statistics) {
      const auto messages = fields.whole<std::uint64_t>();
      fields.whole<std::uint16_t>(), fields.whole<std::uint32_t>();
      const auto attachments = fields.whole<std::uint32_t>();
      if (fields.is_whole()) summary_.messages = messages, summary_.attachments = attachments;
    }
  }

  void read_data() {
    std::size_t at = kMagic.size();
    while (at < file_.size()) {
      const auto record = record_at(file_.substr(at));
      if (!record || (record->op == Op::footer)) {
        const auto next = std::ranges::upper_bound(summary_.starts, at);
        const bool goes_on = next != summary_.starts.end() && *next < file_.size();
        const std::size_t end = goes_on ? *next : file_.size();
        damage_.note(Fault::record, at,
                     (record ? "a footer before the data's end" : "a record that leads beyond the file") +
                         std::string("; ") + std::to_string(end - at) + " bytes are not read");
        if (!goes_on && !record && static_cast<Op>(static_cast<std::uint8_t>(file_[at])) == Op::chunk)
          take_chunk(at, {Op::chunk, file_.substr(std::min(at + kRecordHead, file_.size()))}, true);
        if (!goes_on) return;
        at = end;
        continue;
      }
      if (record->op == Op::data_end) return end_data(at, *record);
      take_record(at, *record);
      at += kRecordHead + record->content.size();
    }
    damage_.note(Fault::cut, at, "the data has no end");
  }

  void end_data(std::size_t at, const Record& record) {
    Fields fields(record.content);
    const auto crc = fields.whole<std::uint32_t>();
    const std::size_t end = at + kRecordHead + record.content.size();
    if (!fields.is_whole() || (summary_start_ != 0 && end != summary_start_))
      damage_.note(Fault::record, at, "the data's end is not where the summary begins");
    // Of what is known to be damaged the CRC says nothing new.
    if (crc != 0 && damage_.intact() && crc_before(at) != crc)
      damage_.note(Fault::crc, at,
                   "the bytes before the data's end have not its CRC-32; the chunks with one of their own have it");
  }

  // Chunks' records went through a CRC already: theirs is joined to that of what is between them.
  std::uint32_t crc_before(std::size_t end) const {
    std::uint32_t crc = 0;
    std::size_t at = 0;
    for (const auto& [start, size, of_these] : checked_) {
      crc = crc32_of(file_.substr(at, start - at), crc);
      crc = static_cast<std::uint32_t>(::crc32_combine(crc, of_these, static_cast<z_off_t>(size)));
      at = start + size;
    }
    return crc32_of(file_.substr(at, end - at), crc);
  }

  void take_record(std::size_t at, const Record& record) {
    switch (record.op) {
      case Op::channel:
        if (!add_channel(record)) damage_.note(Fault::record, at, "a channel's fields lead beyond it");
        break;
      case Op::message:
        take_message(at, record);
        break;
      case Op::chunk:
        take_chunk(at, record);
        break;
      case Op::attachment:
        take_attachment(at, record);
        break;
      default:  // nothing that is needed, or of a later version
        break;
    }
  }

  bool add_channel(const Record& record) {
    Fields fields(record.content);
    const auto id = fields.whole<std::uint16_t>();
    fields.whole<std::uint16_t>();  // its schema; what the messages are is known by the topic
    const Channel channel{std::string(fields.text()), std::string(fields.text())};
    if (fields.is_whole()) channels_.try_emplace(id, channel);
    return fields.is_whole();
  }

  void take_message(std::size_t at, const Record& record) {
    Fields fields(record.content);
    const auto id = fields.whole<std::uint16_t>();
    Message message;
    message.sequence = fields.whole<std::uint32_t>();
    message.log_time_ns = fields.whole<std::uint64_t>();
    fields.whole<std::uint64_t>();
    if (!fields.is_whole()) return damage_.note(Fault::record, at, "a message's fields lead beyond it");
    const auto channel = channels_.find(id);
    if (channel == channels_.end())
      return damage_.note(Fault::channel, at, "a message of channel " + std::to_string(id) + ", which is not said");
    message.topic = channel->second.topic;
    message.encoding = channel->second.encoding;
    message.data = fields.left();
    message.offset = at;
    ++messages_;
    if (handler_.on_message) handler_.on_message(message);
  }

  // `is_cut`: the record leads beyond the file, and the content ends with the file.
  void take_chunk(std::size_t at, const Record& record, bool is_cut = false) {
    Fields fields(record.content);
    fields.whole<std::uint64_t>(), fields.whole<std::uint64_t>();
    const auto size = fields.whole<std::uint64_t>();
    const auto crc = fields.whole<std::uint32_t>();
    const std::string_view compression = fields.text();
    const auto stored_size = fields.whole<std::uint64_t>();
    if (!fields.is_whole() || (stored_size > fields.left().size() && !is_cut))
      return is_cut ? void() : damage_.note(Fault::record, at, "a chunk's fields lead beyond it");
    const std::string_view stored = fields.left().substr(0, stored_size);
    is_cut = stored.size() < stored_size;
    if (compression.empty()) {
      if (size != stored_size)
        return damage_.note(Fault::record, at,
                            "a chunk of " + std::to_string(stored_size) + " bytes declares " + std::to_string(size));
      if (take_records(at, stored, is_cut, crc, static_cast<std::size_t>(stored.data() - file_.data())) && crc != 0 &&
          !is_cut)
        checked_.push_back({static_cast<std::size_t>(stored.data() - file_.data()), stored.size(), crc});
      return;
    }
    if (size > std::min(kLargestChunk_bytes, kLargestTotal_bytes - decompressed_bytes_))
      return damage_.note(Fault::record, at,
                          "a chunk declares " + std::to_string(size) +
                              " bytes after decompression; allowed: " + std::to_string(kLargestChunk_bytes) + ", and " +
                              std::to_string(kLargestTotal_bytes) + " of all chunks; it is left out");
    const auto records = decompress(compression, stored, size);
    if (!records)
      return damage_.note(
          Fault::compression, at,
          "a chunk's compression is '" + std::string(compression.substr(0, 16)) + "'; allowed: none, zstd, lz4");
    decompressed_bytes_ += records->size();
    if (records->size() != size && !is_cut)
      return damage_.note(Fault::record, at,
                          "a chunk of " + std::string(compression) + " has not the " + std::to_string(size) +
                              " bytes that it declares; it is left out");
    take_records(at, *records, is_cut, crc, std::nullopt);
  }

  // Returns whether the records were taken. `start`: where they are in the file, if they are.
  bool take_records(std::size_t at, std::string_view records, bool is_cut, std::uint32_t crc,
                    std::optional<std::size_t> start) {
    if (!is_cut && crc != 0 && crc32_of(records) != crc) {
      damage_.note(Fault::crc, at,
                   "a chunk of " + std::to_string(records.size()) + " bytes has not its CRC-32; it is left out");
      return false;
    }
    const std::uint64_t messages_before = messages_;
    for (std::size_t in = 0; in < records.size();) {
      const auto inside = record_at(records.substr(in));
      if (!inside && is_cut) break;
      if (!inside || (inside->op != Op::schema && inside->op != Op::channel && inside->op != Op::message)) {
        damage_.note(Fault::record, start.value_or(at) + (start ? in : 0),
                     "a record that cannot be in a chunk, or leads beyond it");
        break;
      }
      take_record(start ? *start + in : at, *inside);
      in += kRecordHead + inside->content.size();
    }
    if (is_cut)
      damage_.note(Fault::cut, at,
                   "a chunk is cut off; the " + std::to_string(messages_ - messages_before) +
                       " messages before the cut are used, which its CRC-32 cannot confirm");
    return true;
  }

  void take_attachment(std::size_t at, const Record& record) {
    Fields fields(record.content);
    fields.whole<std::uint64_t>(), fields.whole<std::uint64_t>();
    const Attachment attachment{fields.text(), fields.text(), fields.bytes()};
    const std::size_t checked = record.content.size() - fields.left().size();
    const auto crc = fields.whole<std::uint32_t>();
    if (!fields.is_whole()) return damage_.note(Fault::record, at, "an attachment's fields lead beyond it");
    if (crc != 0 && crc32_of(record.content.substr(0, checked)) != crc)
      return damage_.note(Fault::crc, at, "an attachment has not its CRC-32; it is left out");
    ++attachments_;
    if (handler_.on_attachment) handler_.on_attachment(attachment);
  }

  struct Checked {
    std::size_t start, size;
    std::uint32_t crc;
  };

  std::string_view file_;
  const Handler& handler_;
  Damage damage_;
  Summary summary_;
  std::size_t summary_start_ = 0;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<Checked> checked_;
  std::uint64_t messages_ = 0, attachments_ = 0;
  std::size_t decompressed_bytes_ = 0;
};

}  // namespace

void Damage::note(Fault fault, std::uint64_t offset, std::string what) {
  const auto before = std::ranges::count(places, fault, &Place::fault);
  if (static_cast<std::size_t>(before) < kMostPlaces)
    places.push_back({fault, offset, std::move(what)});
  else
    ++more;
}

bool Damage::has(Fault fault) const { return std::ranges::find(places, fault, &Place::fault) != places.end(); }

std::string Damage::describe() const {
  std::string text;
  for (const Place& place : places) text += "byte " + std::to_string(place.offset) + ": " + place.what + "\n";
  if (more > 0) text += "and " + std::to_string(more) + " more places like these\n";
  return text;
}

Damage read(std::string_view file, const Handler& handler) { return Reader(file, handler).read(); }

}  // namespace bevel::io::mcap
