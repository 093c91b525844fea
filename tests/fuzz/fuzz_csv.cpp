// SPDX-License-Identifier: MIT
// Arbitrary text as a table, by a column map of the input's own or by a fixed one. It is refused with a sentence that
// names the file, or every row is accounted for and time grows.
//
// Input: [column map "\n---\n"] table. Without the separator the fixed map is used.
#include <cmath>

#include <bevel/error.hpp>
#include <bevel/io/checked_decode.hpp>
#include <bevel/io/csv_import.hpp>
#include <bevel/io/messages.hpp>
#include "tests/fuzz/fuzz_support.hpp"

namespace bevel::fuzz {
namespace {

constexpr std::string_view kSeparator = "\n---\n";

io::ColumnMap fixed_map() {
  io::ColumnMap map;
  map.time.column = "s";
  map.time.nanoseconds = "ns";
  map.tip = {io::SignedColumn{"z", 1}, {"x", -1}, {"y", -1}};
  map.origin = {{"ez", 1}, {"ex", -1}, {"ey", -1}};
  map.sigma_mm = {0.1, 0.2, 0};
  map.insertion = {"base", -1};
  map.settled = true;
  map.rotation = {{"turn", 1}};
  map.nonzero = {"x", "ex"};
  return map;
}

// One channel: numbered, its times grow, and what is written to a log has to be read from it.
template <class Sample>
void check_channel(const std::vector<Sample>& samples) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    BEVEL_MUST(samples[i].seq == static_cast<std::int64_t>(i));
    BEVEL_MUST(i == 0 || samples[i].utime > samples[i - 1].utime);
    BEVEL_MUST(!io::check_fields(io::to_message(samples[i])));
  }
}

void check(const io::ImportedRecording& recording) {
  BEVEL_MUST(!recording.actuators.empty() && !(recording.tips.empty() && recording.headings.empty()));
  check_channel(recording.actuators);
  check_channel(recording.tips);
  check_channel(recording.headings);
  const auto no_more_than_rows = [&](std::size_t readings) {
    BEVEL_MUST(static_cast<int>(readings) + recording.rows_without_data + recording.rows_unsettled <= recording.rows);
  };
  no_more_than_rows(recording.actuators.size());
  no_more_than_rows(recording.tips.size());
  no_more_than_rows(recording.headings.size());
  for (const auto& tip : recording.tips)  // nobody knows where the base was outside its readings
    BEVEL_MUST(tip.utime >= recording.actuators.front().utime && tip.utime <= recording.actuators.back().utime);
  BEVEL_MUST(!io::summary(recording).empty());
}

}  // namespace
}  // namespace bevel::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bevel;
  static fuzz::MemoryFile map_file("fuzz_csv_map");
  static fuzz::MemoryFile table_file("fuzz_csv_table");
  std::string_view table = fuzz::as_text(data, size);
  io::ColumnMap map = fuzz::fixed_map();
  if (const auto at = table.find(fuzz::kSeparator); at != std::string_view::npos) {
    try {
      map = io::load_column_map(map_file.hold(table.substr(0, at)));
    } catch (const io::ConfigError&) {
      return 0;
    }
    table.remove_prefix(at + fuzz::kSeparator.size());
  }
  const std::string& path = table_file.hold(table);
  try {
    fuzz::check(io::import_csv(path, map));
  } catch (const std::runtime_error& error) {
    BEVEL_MUST_SAYING(std::string_view(error.what()).starts_with(path + ":"), error.what());
  }
  return 0;
}
