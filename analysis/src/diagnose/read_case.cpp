// SPDX-License-Identifier: MIT
#include <bevel/analysis/diagnose/read_case.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/error.hpp>
#include <bevel/io/file_bytes.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/motion_gap.hpp>
#include <bevel/io/recording_clock.hpp>
#include <bevel/io/second_insertion.hpp>
#include <bevel/io/sha256.hpp>

namespace bevel::analysis {
namespace fs = std::filesystem;
namespace {

constexpr double kLargestLoss = 0.2;  // of a log's bytes, or of a channel's messages

std::string one_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) text.replace(at, 1, "; ");
  return text;
}

bool lost_much(std::int64_t refused, std::size_t kept) {
  return static_cast<double>(refused) > kLargestLoss * static_cast<double>(refused + static_cast<std::int64_t>(kept));
}

std::int64_t refused_on(const io::Recording& recording, const std::string& channel) {
  const auto found = recording.rejects.find(channel);
  std::int64_t sum = 0;
  if (found != recording.rejects.end())
    for (const auto count : found->second) sum += count;
  return sum;
}

void check_motion_known(const std::string& name, std::vector<model::ActuatorState> states) {
  std::ranges::stable_sort(states, {}, &model::ActuatorState::utime);
  if (const auto gap = io::find_motion_gap(states)) throw ParseError(name + ": " + gap->what());
}

// The last `parts` parts of a path: "monday/insertion.lcm" for 2.
std::string end_of(const fs::path& path, std::size_t parts) {
  fs::path end;
  for (fs::path rest = path; parts > 0 && rest.has_filename(); rest = rest.parent_path(), --parts)
    end = end.empty() ? rest.filename() : rest.filename() / end;
  return end.string();
}

// What tells each log from the others: they are different files, so their whole paths differ.
std::vector<std::string> names_of(const std::vector<std::string>& logs) {
  std::vector<fs::path> whole;
  for (const auto& log : logs) whole.push_back(fs::absolute(log).lexically_normal());
  std::vector<std::string> names;
  for (const fs::path& path : whole) {
    std::size_t parts = 1;
    const auto alike = [&](const fs::path& other) { return end_of(other, parts) == end_of(path, parts); };
    while (std::ranges::count_if(whole, alike) > 1) ++parts;
    names.push_back(end_of(path, parts));
  }
  return names;
}

}  // namespace

std::string judge_damage(const std::string& name, const io::Recording& recording) {
  io::require_usable(name, recording);
  io::require_one_insertion(name, recording.actuators);
  const std::string faults = one_line(recording.describe_faults());
  const double lost = static_cast<double>(recording.damage.skipped_bytes + recording.damage.torn_tail_bytes);
  if (lost > kLargestLoss * static_cast<double>(recording.bytes) ||
      lost_much(refused_on(recording, "TIP_MEASUREMENT"), recording.tips.size()) ||
      lost_much(refused_on(recording, "ACTUATOR_STATE"), recording.actuators.size()))
    throw ParseError(name + ": damaged beyond use (" + faults + "); at most " + percent(kLargestLoss) +
                     " of a log, and of the messages of a channel, may be lost");
  if (io::has_clock(recording)) check_motion_known(name, recording.actuators);
  if (recording.intact()) return "";
  return name + ": damaged (" + faults + "); what is left of it was used.";
}

namespace {

// Reads logs one after the other; the same recording twice is refused.
class Reader {
 public:
  void add_all(const std::vector<std::string>& logs, const std::string& group, bool changed) {
    const auto names = names_of(logs);
    for (std::size_t i = 0; i < logs.size(); ++i) add(logs[i], group + names[i], changed);
  }
  ReadCase take() {
    result_.recorded = diagnosis::make_case(std::move(raw_));
    return std::move(result_);
  }

 private:
  void add(const std::string& log, const std::string& name, bool changed) {
    files_.emplace_back(log);
    paths_.push_back(log);
    const auto bytes = files_.back().bytes();
    for (std::size_t k = 0; k + 1 < files_.size(); ++k)
      if (!bytes.empty() && std::ranges::equal(bytes, files_[k].bytes()))
        throw ParseError(log + ": the same recording as " + paths_[k] +
                         "; counted twice it would make everything look surer than it is");
    io::Recording recording = io::read_recording(bytes);
    recording.file_change = files_.back().change();
    result_.files.push_back({name, io::sha256_hex({reinterpret_cast<const char*>(bytes.data()), bytes.size()})});
    const bool has_clock = io::has_clock(recording);
    const std::string remark = judge_damage(name, recording);
    if (!remark.empty()) result_.remarks.push_back(remark);
    raw_.push_back({.name = name,
                    .actuators = std::move(recording.actuators),
                    .tips = std::move(recording.tips),
                    .headings = std::move(recording.headings),
                    .has_clock = has_clock,
                    .changed = changed});
  }

  ReadCase result_;
  std::vector<diagnosis::RawRecording> raw_;
  std::vector<io::FileBytes> files_;
  std::vector<std::string> paths_;
};

}  // namespace

ReadCase read_case(const std::vector<std::string>& paths) {
  Reader reader;
  reader.add_all(io::find_logs(paths), "", false);
  return reader.take();
}

ReadCase read_groups(const std::vector<std::string>& baseline, const std::vector<std::string>& changed) {
  constexpr std::size_t kFewest = 2;
  Reader reader;
  for (const bool second : {false, true}) {
    const auto logs = io::find_logs(second ? changed : baseline);
    if (logs.size() < kFewest)
      throw ParseError(std::string(second ? "--changed" : "--baseline") + ": " + std::to_string(logs.size()) +
                       " recording; at least " + std::to_string(kFewest) +
                       " are needed to know how much insertions differ by themselves, and three or more are "
                       "better");
    reader.add_all(logs, second ? "changed/" : "baseline/", second);
  }
  return reader.take();
}

}  // namespace bevel::analysis
