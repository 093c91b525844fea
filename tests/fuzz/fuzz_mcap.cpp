// SPDX-License-Identifier: MIT
// Arbitrary bytes as an MCAP file. What is read lies in the file, damage has words, and the same bytes give the same;
// as a recording it is refused with a sentence, or every message passes its checks and survives being written and read.
#include <bevel/io/checked_decode.hpp>
#include <bevel/io/json_message.hpp>
#include <bevel/io/log_order.hpp>
#include <bevel/io/mcap_export.hpp>
#include <bevel/io/mcap_reader.hpp>
#include <bevel/io/messages.hpp>
#include "tests/fuzz/fuzz_support.hpp"

namespace bevel::fuzz {
namespace {

struct Walk {
  std::size_t messages = 0, bytes = 0, attachments = 0;
  std::string damage;
  bool operator==(const Walk&) const = default;
};

Walk walk(std::string_view file) {
  Walk found;
  const auto lies_in_file = [&](std::string_view part) {
    return part.empty() || (part.data() >= file.data() && part.data() + part.size() <= file.data() + file.size());
  };
  const io::mcap::Damage damage =
      io::mcap::read(file, {.on_message =
                                [&](const io::mcap::Message& m) {
                                  // Not of a decompressed chunk, nor topics: the address sanitizer checks these.
                                  BEVEL_MUST(m.offset < file.size());
                                  ++found.messages;
                                  found.bytes += m.data.size();
                                },
                            .on_attachment =
                                [&](const io::mcap::Attachment& a) {
                                  BEVEL_MUST(lies_in_file(a.name) && lies_in_file(a.media_type));
                                  BEVEL_MUST(lies_in_file(a.data));
                                  ++found.attachments;
                                }});
  BEVEL_MUST(damage.intact() == damage.describe().empty());
  found.damage = damage.describe();
  return found;
}

template <class Message>
void check_message(const Message& message) {
  BEVEL_MUST(!io::check_fields(message));
  static const io::JsonLayout layout = io::JsonLayout::of<Message>(false);
  std::string text(layout.largest_size(), ' ');
  io::JsonWriter writer(layout, text.data());
  io::visit_columns(message, writer);
  text.resize(static_cast<std::size_t>(writer.end() - text.data()));
  Message again{};
  io::JsonReader reader(layout, text);
  io::visit_columns(again, reader);
  BEVEL_MUST_SAYING(reader.is_whole(), text);
  BEVEL_MUST_SAYING(io::encode(again) == io::encode(message), text);
}

template <class Sample>
void check_all(const std::vector<Sample>& samples) {
  for (const Sample& sample : samples) {
    if constexpr (requires { io::to_message(sample); })
      check_message(io::to_message(sample));
    else
      check_message(sample);
  }
}

}  // namespace
}  // namespace bevel::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bevel;
  const std::string_view file = fuzz::as_text(data, size);
  const fuzz::Walk found = fuzz::walk(file);
  BEVEL_MUST(fuzz::walk(file) == found);
  try {
    const io::ImportedMcap imported = io::import_mcap(file);
    const io::Recording& r = imported.recording;
    const std::size_t held = r.arrivals.size() + r.commands.size() + r.estimates.size() + r.truths.size();
    BEVEL_MUST(held > 0 && held <= found.messages);
    BEVEL_MUST(r.arrivals.size() == r.tips.size() + r.headings.size() + r.actuators.size());
    BEVEL_MUST(io::log_order(r).size() == held);
    BEVEL_MUST(found.damage.empty() || !imported.intact());
    fuzz::check_all(r.tips);
    fuzz::check_all(r.headings);
    fuzz::check_all(r.actuators);
    fuzz::check_all(r.commands);
    fuzz::check_all(r.estimates);
    fuzz::check_all(r.truths);
  } catch (const std::runtime_error& error) {
    BEVEL_MUST(!std::string_view(error.what()).empty());
  }
  return 0;
}
