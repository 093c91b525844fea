// SPDX-License-Identifier: MIT
// Practice recordings of a simulator that shares no code with this project, where they are at hand.
#include <gtest/gtest.h>

#include <filesystem>

#include <bevel/analysis/diagnose/read_case.hpp>
#include <bevel/diagnosis/mismatch/diagnose.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/model_file.hpp>
#include "tests/support/shared_recordings.hpp"

namespace bevel::diagnosis {
namespace {

namespace fs = std::filesystem;

fs::path practice() { return test::shared_recordings() / "recordings" / "practice"; }

Findings findings_of(const fs::path& folder) {
  return diagnose(analysis::read_case(io::find_logs({folder.string()})).recorded,
                  io::load_model_file((folder / "model.toml").string()).needle, {});
}

TEST(Practice, WhereNothingIsMissing) {
  const fs::path folder = practice() / "case13";
  BEVEL_SKIP_WITHOUT(folder);
  const Findings found = findings_of(folder);
  EXPECT_EQ(found.verdict, Verdict::nothing_missing) << found.sentence;
  EXPECT_NEAR(found.held_out.after.chi2_per_dof, 1, 0.1);
}

TEST(Practice, ALayer) {
  const fs::path folder = practice() / "case04";
  BEVEL_SKIP_WITHOUT(folder);
  const Findings found = findings_of(folder);
  EXPECT_EQ(found.verdict, Verdict::effects_found) << found.sentence;
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "layer");
  // The recordings' truth: 22.50 mm and 0.642.
  for (const FoundParameter& one : found.effects[0].parameters)
    EXPECT_NEAR(one.value, one.name == "depth_mm" ? 22.504 : 0.6425, 4 * one.std_error) << one.name;
  EXPECT_NEAR(found.held_out.after.chi2_per_dof, 1, 0.1);
}

}  // namespace
}  // namespace bevel::diagnosis
