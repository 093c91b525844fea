// Arbitrary text as a table, by a column map of the input's own or by a fixed one. It is refused with a sentence that
// names the file, or every row is accounted for and time grows.
//
// Input: [column map "\n---\n"] table. Without the separator the fixed map is used.
#include <cmath>

#include "io/checked_decode.hpp"
#include "io/csv_import.hpp"
#include "io/messages.hpp"
#include "tests/fuzz/fuzz_support.hpp"

namespace bevel::fuzz {
namespace {

constexpr std::string_view kSeparator = "\n---\n";

io::ColumnMap fixed_map() {
  io::ColumnMap map;
  map.seconds = "s";
  map.nanoseconds = "ns";
  map.tip = {io::SignedColumn{"z", 1}, {"x", -1}, {"y", -1}};
  map.origin = {{"ez", 1}, {"ex", -1}, {"ey", -1}};
  map.sigma_mm = {0.1, 0.2, 0};
  map.insertion = {"base", -1};
  map.settled = true;
  map.rotation = {{"turn", 1}};
  map.nonzero = {"x", "ex"};
  return map;
}

void check(const io::ImportedRecording& recording) {
  const auto samples = static_cast<int>(recording.actuators.size());
  BEVEL_MUST(samples > 0 && recording.tips.size() == recording.actuators.size());
  BEVEL_MUST(recording.headings.empty() || recording.headings.size() == recording.tips.size());
  BEVEL_MUST(samples + recording.rows_without_data + recording.rows_unsettled + recording.rows_implausible ==
             recording.rows);
  for (std::size_t i = 0; i < recording.actuators.size(); ++i) {
    const auto& actuator = recording.actuators[i];
    const auto& tip = recording.tips[i];
    BEVEL_MUST(actuator.seq == static_cast<std::int64_t>(i) && tip.seq == actuator.seq && tip.utime == actuator.utime);
    BEVEL_MUST(i == 0 || actuator.utime > recording.actuators[i - 1].utime);
    // What is written to a log has to be read from it.
    BEVEL_MUST(!io::check_fields(io::to_message(actuator)));
    BEVEL_MUST(!io::check_fields(io::to_message(tip)));
    if (recording.headings.empty()) continue;
    const auto& heading = recording.headings[i];
    BEVEL_MUST(heading.seq == tip.seq && heading.utime == tip.utime);
    BEVEL_MUST(!io::check_fields(io::to_message(heading)));
  }
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
