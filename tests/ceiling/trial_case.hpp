// SPDX-License-Identifier: MIT
#pragma once
// A trial of the generator's, made for a test, and its case as the tool reads it.
#include <gtest/gtest.h>

#include <filesystem>

#include <bevel/analysis/diagnose/read_case.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>
#include <bevel/io/find_logs.hpp>
#include "proof/beam_path.hpp"
#include "proof/trial_files.hpp"

namespace bevel::ceiling::testing {

// Four insertions without noise, outliers or encoders' faults, of what `conceal` makes of them.
struct NoiseFree {
  proof::Trial trial;
  proof::Setting setting;

  explicit NoiseFree(std::uint64_t seed, bool varied = true) {
    constexpr std::size_t kCount = 4;
    proof::Random random(seed);
    proof::Truth& truth = trial.truth;
    truth.believed = truth.needle;
    const auto scripts = proof::draw_scripts(random, true);
    if (varied) truth.spread = proof::draw_spread(random);
    for (std::size_t r = 0; r < kCount; ++r) {
      const proof::Script& script = scripts[2 * r + 1];
      proof::TrialRecording one{proof::follow(script), script, {}, {}};
      one.frames = proof::draw_frames(truth.noise, one.motion.duration_s(), random);
      setting.motions.push_back(one.motion);
      setting.frames.push_back(one.frames);
      trial.recordings.push_back(std::move(one));
      if (varied) truth.variation.push_back(proof::draw_variation(truth.spread, random));
    }
    setting.variation = truth.variation;
  }

  diagnosis::NeedleSystem seen(const proof::Views& views) {
    for (std::size_t r = 0; r < views.size(); ++r) trial.recordings[r].reported_mm = views[r];
    const std::filesystem::path folder =
        std::filesystem::path(::testing::TempDir()) /
        ("ceiling_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(folder);
    proof::write_trial(folder, trial);
    const auto given = proof::TrialFolders(folder, trial.truth.trial).given.string();
    const proof::BaseNeedle& n = trial.truth.believed;
    auto read = analysis::read_case(io::find_logs({given}));
    std::filesystem::remove_all(folder);
    return {std::move(read.recorded),
            {.curvature_per_mm = n.curvature_per_mm,
             .wheelbase_mm = n.wheelbase_mm,
             .lambda1_per_rad = n.lambda1_per_rad,
             .lambda2 = n.lambda2}};
  }
};

}  // namespace bevel::ceiling::testing
