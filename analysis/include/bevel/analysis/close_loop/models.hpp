// SPDX-License-Identifier: MIT
// The models that are compared, and what they are compared on.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::analysis {

// As the model file came; its needle refitted, without effects; with what the mismatch tool found.
enum Stage : std::size_t { kAsItCame, kRefitted, kAugmented, kStages };
inline constexpr std::array<const char*, kStages> kStageNames = {"as it came", "refitted", "augmented"};
using Models = std::array<io::ModelFile, kStages>;

// A folder with model.toml and rec*.lcm.
struct CaseFiles {
  std::string name, model_path;
  std::vector<std::string> logs;  // in the order of their names
};
// Throws IoError naming what is not there.
CaseFiles find_case(const std::string& folder);

// The readings that the mismatch tool took for outliers, taken out.
diagnosis::RecordedCase without_outliers(const diagnosis::RecordedCase& recorded, const diagnosis::Findings& findings);

}  // namespace bevel::analysis
