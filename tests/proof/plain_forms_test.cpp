// SPDX-License-Identifier: MIT
// Two implementations that share no code, the trials' plant and the library of effects: at the plain forms they are one
// physics, each effect alone and every two together. What two effects make of each other is where they would part.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include <bevel/model/effects/open_loop.hpp>
#include "proof/needle_path.hpp"

namespace bevel::proof {
namespace {

constexpr int kRecording = 3;
constexpr double kFrame_s = 1.0 / 30;
// The two integrate in different ways, 1 ms and 1 mm at a time, and the plant's gears and tissue act a step later.
constexpr std::size_t kCatchingUp_frames = 4;
constexpr std::size_t kSlipping_frames = 12;  // of some 450
constexpr double kAlike_mm = 0.03;
constexpr double kAlikeTogether_mm = 0.08;  // of second order in the tilt, and which of two camera effects comes first

// All that an effect needs to show: reversals of both axes at rest and on the way, stops, three speeds, a depth of 60
// mm.
Script script() {
  return {"everything",
          {{2.0, 12, 0},
           {1.0, 0, 0},
           {0.6, 0, 4},
           {1.5, 8, 0},
           {0.8, -9, 0},
           {0.5, 0, -3},
           {1.6, 12, 0},
           {0.8, 6, -2},
           {0.8, 6, 2.5},
           {1.2, 0, 0},
           {0.7, 0, 4.5},
           {1.0, 15, 0},
           {0.5, 0, 0},
           {0.6, -10, 0},
           {1.2, 10, 0},
           {0.5, 0, 0}}};
}

model::ActiveEffect active(const ConcealedEffect& concealed) {
  model::ActiveEffect one{.effect = model::find_effect(concealed.name), .parameters = {}};
  for (std::size_t i = 0; const auto& parameter : one.effect->parameters()) {
    double value = parameter.none;
    if (const auto own = concealed.parameters.find(std::string(parameter.name)); own != concealed.parameters.end())
      value = own->second;
    if (parameter.name == "at_s") value = concealed.per_recording.at("at_s").at(kRecording);
    if (parameter.name == "phase_rad") value = concealed.per_recording.at("phase_rad").at(kRecording);
    one.parameters[i++] = value;
  }
  return one;
}

class PlainForms : public ::testing::Test {
 protected:
  PlainForms() : motion_(follow(script())) {
    const double last_s = motion_.duration_s();
    std::vector<std::int64_t> utimes;
    for (int i = 0; 0.5 + i * kFrame_s < last_s; ++i) {
      times_s_.push_back(0.5 + i * kFrame_s);
      utimes.push_back(std::llround(1e6 * times_s_.back()));
    }
    std::vector<model::ActuatorState> actuators(motion_.size());
    for (std::size_t i = 0; i < motion_.size(); ++i) {
      actuators[i].utime = static_cast<std::int64_t>(1000 * i);
      actuators[i].insertion_mm = motion_.insertion_mm[i];
      actuators[i].rotation_rad = motion_.rotation_rad[i];
    }
    legs_ = model::make_motion(actuators, utimes);
  }

  // Largest distance between the two, mm.
  double apart_mm(const std::vector<ConcealedEffect>& effects) const {
    const BaseNeedle needle{0.0047, 22, 0.3, 0.1};
    const HiddenPhysics physics = physics_of(effects, 0.0);
    const Eigen::Matrix3Xd plant = view(travel(needle, motion_, physics, {}, kRecording), times_s_, physics);
    model::NeedleParameters parameters;
    parameters.curvature_per_mm = needle.curvature_per_mm;
    parameters.wheelbase_mm = needle.wheelbase_mm;
    parameters.lambda1_per_rad = needle.lambda1_per_rad;
    parameters.lambda2 = needle.lambda2;
    // In the order in which effects act, which is that of the registry.
    std::vector<model::ActiveEffect> library;
    for (const model::Effect* effect : model::all_effects())
      for (const ConcealedEffect& one : effects)
        if (one.name == effect->name()) library.push_back(active(one));
    model::OpenLoop path;
    if (!model::predict(model::AugmentedNeedle(parameters, library), legs_, path)) return 1e9;
    std::vector<double> distances_mm;
    for (std::size_t i = 0; i < path.position_mm.size(); ++i)
      distances_mm.push_back((plant.col(static_cast<Eigen::Index>(i)) - path.position_mm[i]).norm());
    std::ranges::sort(distances_mm, std::greater<>());
    // How a tip catches up that has broken through or slips is nobody's definition: the frames in which it does are not
    // compared.
    std::size_t left_out = 0;
    if (physics.indentation_mm > 0) left_out += kCatchingUp_frames;
    if (physics.stick_slip_mm > 0) left_out += kSlipping_frames;
    return distances_mm[left_out];
  }

  std::vector<ConcealedEffect> listed() const {
    Random random(20150928);
    const std::vector<AxisMotion> motions(kRecordings, motion_);
    std::vector<ConcealedEffect> effects;
    for (const EffectKind& kind : catalogue())
      if (kind.listed) effects.push_back(draw_effect(kind, random, motions));
    return effects;
  }

  AxisMotion motion_;
  std::vector<double> times_s_;
  model::Motion legs_;
};

TEST_F(PlainForms, EachEffectAlone) {
  EXPECT_LT(apart_mm({}), 3e-3);
  for (const ConcealedEffect& one : listed()) EXPECT_LT(apart_mm({one}), kAlike_mm) << one.name;
}

TEST_F(PlainForms, EveryTwoTogether) {
  const auto effects = listed();
  for (std::size_t i = 0; i < effects.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_LT(apart_mm({effects[j], effects[i]}), kAlikeTogether_mm) << effects[j].name << " + " << effects[i].name;
}

}  // namespace
}  // namespace bevel::proof
