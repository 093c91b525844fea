// SPDX-License-Identifier: MIT
#include <bevel/io/mcap_writer.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <bevel/error.hpp>
#include <bevel/io/mcap_container.hpp>

namespace bevel::io::mcap {
namespace {

constexpr std::size_t kChunk_bytes = std::size_t{32} << 10U;  // what one flipped byte costs: a second of a recording

// A record's content, field by field.
class Content {
 public:
  template <class Integer>
  Content& whole(Integer value) {
    std::array<char, sizeof value> bytes;
    put(bytes.data(), value);
    bytes_.append(bytes.data(), bytes.size());
    return *this;
  }
  Content& text(std::string_view value) {
    whole(static_cast<std::uint32_t>(value.size()));
    return bytes(value);
  }
  Content& bytes(std::string_view value) {
    bytes_ += value;
    return *this;
  }
  const std::string& get() const { return bytes_; }
  std::string record(Op op) const { return record_head(op, bytes_.size()) + bytes_; }

  static std::string record_head(Op op, std::size_t size) {
    std::string head(kRecordHead, static_cast<char>(op));
    put(head.data() + 1, static_cast<std::uint64_t>(size));
    return head;
  }

 private:
  std::string bytes_;
};

}  // namespace

void Writer::Times::add(std::uint64_t time_ns, bool is_first) {
  first_ns = is_first ? time_ns : std::min(first_ns, time_ns);
  last_ns = is_first ? time_ns : std::max(last_ns, time_ns);
}

Writer::Writer(const std::string& path)
    : path_(path), unfinished_(path + ".unfinished"), file_(std::fopen(unfinished_.c_str(), "wbe")) {
  if (!file_) throw IoError(path_ + ": cannot be written: " + std::strerror(errno));
  emit(kMagic);
  emit(Content().text("").text("bevel").record(Op::header));
}

Writer::~Writer() {
  if (!file_) return;
  file_.reset();
  std::error_code ignored;
  std::filesystem::remove(unfinished_, ignored);
}

void Writer::put_bytes(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    throw IoError(path_ + ": cannot be written: " + std::strerror(errno));
  offset_ += bytes.size();
}

void Writer::emit(std::string_view bytes) {
  put_bytes(bytes);
  crc_ = crc32_of(bytes, crc_);
}

std::uint16_t Writer::add_channel(std::string_view topic, std::string_view schema_name, std::string_view json_schema) {
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  Channel& channel = channels_.emplace_back();
  channel.schema = Content().whole(id).text(schema_name).text("jsonschema").text(json_schema).record(Op::schema);
  channel.channel = Content().whole(id).whole(id).text(topic).text("json").text("").record(Op::channel);
  return id;
}

void Writer::write(std::uint16_t id, std::uint32_t sequence, std::uint64_t time_ns, std::string_view json) {
  Channel& channel = channels_.at(id - 1U);
  if (!channel.announced) {
    chunk_ += channel.schema + channel.channel;
    channel.announced = true;
  }
  channel.in_chunk.emplace_back(time_ns, chunk_.size());
  ++channel.messages;
  chunk_times_.add(time_ns, chunk_messages_++ == 0);
  times_.add(time_ns, messages_++ == 0);
  std::array<char, kRecordHead + kMessageHead> head;
  head[0] = static_cast<char>(Op::message);
  put(head.data() + 1, static_cast<std::uint64_t>(kMessageHead + json.size()));
  put(head.data() + 9, id);
  put(head.data() + 11, sequence);
  put(head.data() + 15, time_ns);
  put(head.data() + 23, time_ns);
  chunk_.append(head.data(), head.size());
  chunk_ += json;
  if (chunk_.size() >= kChunk_bytes) end_chunk();
}

void Writer::end_chunk() {
  if (chunk_messages_ == 0) return;
  const std::uint64_t start = offset_;
  const std::uint32_t crc = crc32_of(chunk_);
  const std::string head = Content()
                               .whole(chunk_times_.first_ns)
                               .whole(chunk_times_.last_ns)
                               .whole(static_cast<std::uint64_t>(chunk_.size()))
                               .whole(crc)
                               .text("")
                               .whole(static_cast<std::uint64_t>(chunk_.size()))
                               .get();
  emit(Content::record_head(Op::chunk, head.size() + chunk_.size()));
  emit(head);
  put_bytes(chunk_);
  crc_ = static_cast<std::uint32_t>(::crc32_combine(crc_, crc, static_cast<z_off_t>(chunk_.size())));
  const std::uint64_t index_start = offset_;
  Content offsets;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].in_chunk.empty()) continue;
    const auto id = static_cast<std::uint16_t>(i + 1);
    offsets.whole(id).whole(offset_);
    Content entries;
    for (const auto& [time_ns, offset] : channels_[i].in_chunk) entries.whole(time_ns).whole(offset);
    emit(Content().whole(id).text(entries.get()).record(Op::message_index));
    channels_[i].in_chunk.clear();
  }
  chunk_indices_.push_back(Content()
                               .whole(chunk_times_.first_ns)
                               .whole(chunk_times_.last_ns)
                               .whole(start)
                               .whole(index_start - start)
                               .text(offsets.get())
                               .whole(offset_ - index_start)
                               .text("")
                               .whole(static_cast<std::uint64_t>(chunk_.size()))
                               .whole(static_cast<std::uint64_t>(chunk_.size()))
                               .record(Op::chunk_index));
  chunk_.clear();
  chunk_messages_ = 0;
}

void Writer::attach(std::string_view name, std::string_view media_type, std::string_view data) {
  end_chunk();
  const std::uint64_t start = offset_, size = data.size(), none = 0;
  Content content;
  content.whole(none).whole(none).text(name).text(media_type).whole(size).bytes(data);
  content.whole(crc32_of(content.get()));
  const std::string record = content.record(Op::attachment);
  emit(record);
  attachment_indices_.push_back(Content()
                                    .whole(start)
                                    .whole(static_cast<std::uint64_t>(record.size()))
                                    .whole(none)
                                    .whole(none)
                                    .whole(size)
                                    .text(name)
                                    .text(media_type)
                                    .record(Op::attachment_index));
}

std::string Writer::summary(std::uint64_t start) const {
  std::string text, offsets;
  const auto add_group = [&](Op op, const std::string& records) {
    if (records.empty()) return;
    offsets += Content()
                   .whole(static_cast<std::uint8_t>(op))
                   .whole(start + text.size())
                   .whole(static_cast<std::uint64_t>(records.size()))
                   .record(Op::summary_offset);
    text += records;
  };
  std::string schemas, channels, chunks, attachments;
  Content counts;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    schemas += channels_[i].schema;
    channels += channels_[i].channel;
    counts.whole(static_cast<std::uint16_t>(i + 1)).whole(channels_[i].messages);
  }
  for (const std::string& record : chunk_indices_) chunks += record;
  for (const std::string& record : attachment_indices_) attachments += record;
  add_group(Op::schema, schemas);
  add_group(Op::channel, channels);
  add_group(Op::statistics, Content()
                                .whole(messages_)
                                .whole(static_cast<std::uint16_t>(channels_.size()))
                                .whole(static_cast<std::uint32_t>(channels_.size()))
                                .whole(static_cast<std::uint32_t>(attachment_indices_.size()))
                                .whole(std::uint32_t{0})
                                .whole(static_cast<std::uint32_t>(chunk_indices_.size()))
                                .whole(times_.first_ns)
                                .whole(times_.last_ns)
                                .text(counts.get())
                                .record(Op::statistics));
  add_group(Op::chunk_index, chunks);
  add_group(Op::attachment_index, attachments);
  const std::uint64_t offsets_start = start + text.size();
  std::string all = text + offsets + Content::record_head(Op::footer, kFooterContent) +
                    Content().whole(start).whole(offsets_start).get();
  return all + Content().whole(crc32_of(all)).get();
}

void Writer::close() {
  end_chunk();
  emit(Content().whole(crc_).record(Op::data_end));
  emit(summary(offset_));
  emit(kMagic);
  if (std::fclose(file_.release()) != 0) {
    const std::string reason = std::strerror(errno);
    std::error_code ignored;
    std::filesystem::remove(unfinished_, ignored);
    throw IoError(path_ + ": cannot be written: " + reason);
  }
  std::filesystem::rename(unfinished_, path_);
}

}  // namespace bevel::io::mcap
