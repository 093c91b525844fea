// SPDX-License-Identifier: MIT
// Logs into a case, or one sentence that says why not.
#pragma once

#include <string>
#include <vector>

#include <bevel/analysis/diagnose/provenance.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>
#include <bevel/io/recording.hpp>

namespace bevel::analysis {

struct ReadCase {
  diagnosis::RecordedCase recorded;
  std::vector<KnownFile> files;
  std::vector<std::string> remarks;  // on damage that does not stand in the way
};

// `paths`: logs, and folders that hold them. A recording is named by its log's file name, and where several have one,
// by as many of the folders before it as tell them apart: "monday/insertion.lcm". Throws IoError for a log
// that cannot be read or lost too much, for a log given twice, and with what diagnosis::make_case says of the rest.
ReadCase read_case(const std::vector<std::string>& paths);

// Two groups, of logs and of folders that hold them; a recording's name begins with its group's. As above, and a group
// with fewer than two recordings.
ReadCase read_groups(const std::vector<std::string>& baseline, const std::vector<std::string>& changed);

// What of a log is missing: "" if nothing, a remark if it does not matter; throws if it does, a motion unknown for a
// while above all: physics would be blamed for it.
std::string judge_damage(const std::string& name, const io::Recording& recording);

}  // namespace bevel::analysis
