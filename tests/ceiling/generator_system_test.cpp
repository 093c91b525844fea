// SPDX-License-Identifier: MIT
// The generator as a client of the engine: its readings are the simulator's, its derivatives those of another step.
#include "tests/ceiling/generator_system.hpp"

#include <gmock/gmock.h>

#include <numbers>

#include <bevel/diagnosis/inference/layout.hpp>
#include "tests/ceiling/trial_case.hpp"

namespace bevel::ceiling {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using testing::NoiseFree;

// What is drawn, where the client keeps it.
struct Placed {
  inference::ModelSet set;
  VectorXd shared;
  std::vector<VectorXd> local;
};
Placed place(const GeneratorSystem& system, const NoiseFree& made, const std::vector<proof::ConcealedEffect>& effects) {
  Placed out;
  for (const auto& effect : effects) out.set = inference::with(out.set, static_cast<std::size_t>(system.find(effect)));
  const inference::Layout layout(system, out.set);
  out.shared = layout.shared_start();
  const proof::BaseNeedle& n = made.trial.truth.needle;
  out.shared.head(3) << n.curvature_per_mm, n.lambda1_per_rad - n.lambda2 * n.lambda2 / (2 * std::numbers::pi),
      n.lambda2;
  for (std::size_t r = 0; r < made.trial.recordings.size(); ++r) {
    out.local.push_back(layout.local_start());
    if (made.trial.truth.variation.empty()) continue;
    const proof::InsertionVariation& own = made.trial.truth.variation[r];
    out.local[r].head(6) << own.curvature_share, own.about_x_rad, own.about_y_rad, own.roll_rad, own.entry_x_mm,
        own.entry_y_mm;
  }
  for (const auto& effect : effects) {
    const auto e = static_cast<std::size_t>(system.find(effect));
    const auto m = static_cast<std::size_t>(std::ranges::find(out.set, e) - out.set.begin());
    const auto& parameters = system.effects()[e].parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      if (const int i = layout.find_shared(m, p); i >= 0) {
        const double value = effect.parameters.at(parameters[p].name);
        out.shared[i] = system.slots(e)[p].logarithmic ? std::log(value) : value;
      }
      if (const int i = layout.find_local(m, p); i >= 0)
        for (std::size_t r = 0; r < out.local.size(); ++r)
          out.local[r][i] = effect.per_recording.at(parameters[p].name).at(r);
    }
  }
  return out;
}

std::vector<proof::ConcealedEffect> one_of_each(const NoiseFree& made) {
  proof::Random random(7);
  std::vector<proof::ConcealedEffect> out;
  for (const proof::EffectKind& kind : proof::catalogue())
    out.push_back(proof::draw_effect(kind, random, made.setting.motions));
  auto fed = out.front();
  for (const auto& one : out)
    if (one.name == "lost_steps") fed = one;
  fed.parameters = fed.parameters.contains("insertion_mm") ? std::map<std::string, double>{{"rotation_rad", -0.7}}
                                                           : std::map<std::string, double>{{"insertion_mm", -1.4}};
  out.push_back(fed);
  return out;
}

double largest_error_mm(const GeneratorSystem& system, const Placed& at) {
  double largest = 0;
  inference::Prediction prediction;
  for (std::size_t r = 0; r < at.local.size(); ++r) {
    if (!system.predict(at.set, r, at.shared, at.local[r], false, prediction)) return 1e9;
    Index row = 0;
    for (const auto& series : system.data().recordings[r].series)
      for (const double measured : series.measured)
        largest = std::max(largest, std::abs(prediction.reading[row++] - measured));
  }
  return largest;
}

// Of rounding in u = lambda1 - lambda2^2 / (2 pi) alone: there and back.
constexpr double kExact_mm = 1e-9;

TEST(GeneratorSystem, ReadsWhatTheSimulatorSaysOfEachEffect) {
  NoiseFree made(11);
  made.trial.truth.departure = 0.5;
  made.trial.truth.ripple = made.setting.ripple = {0.004, 3, 1, 0.002, 2};
  for (const auto& effect : one_of_each(made)) {
    SCOPED_TRACE(effect.name + " " + effect.kind);
    const auto views = proof::views_of(made.setting, made.trial.truth.needle, proof::physics_of({effect}, 0.5));
    const auto needle = made.seen(views);
    const GeneratorSystem system(needle, made.trial, made.setting.ripple);
    ASSERT_GE(system.find(effect), 0);
    EXPECT_LT(largest_error_mm(system, place(system, made, {effect})), kExact_mm);
    // And it says something: without it the readings are others.
    EXPECT_GT(largest_error_mm(system, place(system, made, {})), 1e-3);
  }
}

TEST(GeneratorSystem, ReadsWhatTheBeamSays) {
  NoiseFree made(12);
  made.setting.motions.resize(2), made.setting.frames.resize(2), made.setting.variation.resize(2);
  made.trial.recordings.resize(2), made.trial.truth.variation.resize(2);
  proof::Random random(3);
  auto beam = proof::draw_beam(random);
  beam.relaxing_fraction = 0.3;
  const auto needle = made.seen(proof::views_of(made.setting, beam));
  const GeneratorSystem system(needle, made.trial);
  const std::vector<proof::ConcealedEffect> effects{
      {"tip_swing",
       "",
       {{"foundation_modulus_kPa", beam.foundation_modulus_kPa},
        {"bevel_force_N", beam.bevel_force_N},
        {"guide_gap_mm", beam.guide_gap_mm}},
       {}},
      {"unknown",
       "beam_relaxation",
       {{"relaxing_fraction", beam.relaxing_fraction}, {"relaxation_time_s", beam.relaxation_time_s}},
       {}}};
  EXPECT_LT(largest_error_mm(system, place(system, made, effects)), kExact_mm);
  EXPECT_FALSE(system.allows(
      inference::without(place(system, made, effects).set, static_cast<std::size_t>(system.find(effects[0])))));
}

TEST(GeneratorSystem, DerivativesAreThoseOfAnotherStep) {
  NoiseFree made(11);
  made.trial.truth.departure = 0.5;
  const auto needle = made.seen(proof::views_of(made.setting, made.trial.truth.needle, {}));
  const GeneratorSystem system(needle, made.trial);
  for (const auto& effect : one_of_each(made)) {
    const Placed at = place(system, made, {effect});
    const auto e = static_cast<std::size_t>(system.find(effect));
    inference::Prediction here, up, down;
    for (const std::size_t r : {0U, 2U}) {
      SCOPED_TRACE(effect.name + " " + effect.kind + ", recording " + std::to_string(r + 1));
      ASSERT_TRUE(system.predict(at.set, r, at.shared, at.local[r], true, here));
      const auto compare = [&](const VectorXd& column, bool of_shared, Index i, double step, double share) {
        VectorXd s = at.shared, l = at.local[r];
        double& value = (of_shared ? s : l)[i];
        value += step;
        ASSERT_TRUE(system.predict(at.set, r, s, l, false, up));
        value -= 2 * step;
        ASSERT_TRUE(system.predict(at.set, r, s, l, false, down));
        const VectorXd other = (up.reading - down.reading) / (2 * step);
        if (share < 0.1) {
          EXPECT_LT((column - other).norm(), share * std::max(other.norm(), 1e-6)) << "unknown " << i;
          return;
        }
        // Where a membrane lets go the readings of a few frames are no straight line over either step.
        const double size = std::max(other.norm() / std::sqrt(static_cast<double>(other.size())), 1e-6);
        const auto off = ((column - other).cwiseAbs().array() > share * size).count();
        EXPECT_LT(static_cast<double>(off), 0.04 * static_cast<double>(other.size())) << "unknown " << i;
      };
      compare(here.by_shared.col(0), true, 0, 1e-6, 0.01);
      compare(here.by_shared.col(1), true, 1, 1e-4, 0.01);
      compare(here.by_shared.col(2), true, 2, 1e-4, 0.01);
      for (const Index i : {0, 1, 2, 3, 4, 5}) compare(here.by_local.col(i), false, i, 1e-4, 0.01);
      Index shared = 3;
      for (std::size_t p = 0; p < system.slots(e).size(); ++p, ++shared) {
        const Slot& slot = system.slots(e)[p];
        // An event falls on a millisecond: of its step that is a fifth.
        compare(here.by_shared.col(shared), true, shared, (slot.in_steps ? 2 : 0.3) * slot.step,
                slot.in_steps ? 0.3 : 0.01);
      }
    }
  }
}

// Derivatives that are kept from a point nearby are those that are sought there; of another needle they are not kept.
TEST(GeneratorSystem, DerivativesAreKeptWhereTheyHold) {
  NoiseFree made(11);
  const auto needle = made.seen(proof::views_of(made.setting, made.trial.truth.needle, {}));
  const GeneratorSystem kept(needle, made.trial), fresh(needle, made.trial);
  const Placed at = place(kept, made, {});
  inference::Prediction here, moved, sought;
  ASSERT_TRUE(kept.predict({}, 1, at.shared, at.local[1], true, here));
  VectorXd shared = at.shared;
  shared[0] += 2e-5, shared[1] += 0.003;
  ASSERT_TRUE(kept.predict({}, 1, shared, at.local[1], true, moved));
  ASSERT_TRUE(fresh.predict({}, 1, shared, at.local[1], true, sought));
  EXPECT_EQ(moved.by_shared, here.by_shared);
  EXPECT_EQ(moved.reading, sought.reading);
  for (Index i = 0; i < 3; ++i)
    EXPECT_LT((moved.by_shared.col(i) - sought.by_shared.col(i)).norm(), 0.03 * sought.by_shared.col(i).norm());
  shared[0] *= 1.5;
  const GeneratorSystem other(needle, made.trial);
  ASSERT_TRUE(kept.predict({}, 1, shared, at.local[1], true, moved));
  ASSERT_TRUE(other.predict({}, 1, shared, at.local[1], true, sought));
  EXPECT_EQ(moved.by_shared, sought.by_shared);
}

}  // namespace
}  // namespace bevel::ceiling
