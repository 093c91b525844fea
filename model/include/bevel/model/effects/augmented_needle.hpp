// SPDX-License-Identifier: MIT
#pragma once
// The needle with the effects of a model file: open-loop propagation from the base's motion, with sensitivities by any
// of its parameters in the same pass. Without effects it is bevel/model/kinematics.hpp, bit for bit (tested).
// Source: shared definitions in effect.hpp; sensitivities by the chain rule through StepJacobian.
#include <array>
#include <memory>
#include <vector>

#include <bevel/model/effects/base_history.hpp>
#include <bevel/model/effects/effect.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::model {

struct ActiveEffect {
  const Effect* effect = nullptr;
  std::array<Dual, kMaxEffectParameters> parameters;  // in the order of effect->parameters()
  std::shared_ptr<const Effect> owned{};              // of an effect that is not in the registry: it lives as long
};

// In which column of the sensitivities a parameter of the needle or of its entry stands; -1: not wanted.
struct NeedleColumns {
  int curvature = -1;
  int lambda1 = -1;
  int lambda2 = -1;
  int wheelbase = -1;
  int tilt_x = -1, tilt_y = -1, roll = -1;  // of the entry, as EntryPose has them
  int entry_x = -1, entry_y = -1;           // mm, of the entry point in {A}
};

// Row by row, as slopes lie in a dual number.
using BodyColumns = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor, 6, kMaxColumns>;
using PointColumns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, kMaxColumns>;

// Everything that an insertion carries from leg to leg. Copyable, no heap.
struct AugmentedState {
  Pose pose;
  BodyColumns D;  // d(body perturbation of the pose)/d(columns), 6 x columns
  BaseMotion entry, base;
  Dual tip_insertion_mm, tip_rotation_rad;
  std::array<EffectMemory, kMaxEffects> memory;
  BaseHistory history;  // kept where an effect asks for it
};

// A point the cameras see, and its derivatives.
struct TipReading {
  Eigen::Vector3d position_mm;
  PointColumns D;  // 3 x columns
};

// A measured heading: unit vector in {A}, and its derivatives.
struct HeadingReading {
  Eigen::Vector3d direction;
  PointColumns D;  // 3 x columns
};

class AugmentedNeedle {
 public:
  // columns: how many sensitivities are carried (0 to kMaxColumns). Effects are put into the order of the registry.
  // At most kMaxEffects; throws ArgumentError past that.
  AugmentedNeedle(const NeedleParameters& needle, std::vector<ActiveEffect> effects = {}, int columns = 0,
                  const NeedleColumns& needle_columns = {});

  // At the entry point, unrolled, along z_A but for what the effects say; the base as it stands then.
  AugmentedState entry(const BaseMotion& base) const;
  // Moves the base. False outside the domain of the slip law; pose and base are then unchanged. Does not allocate.
  // `spread` takes in what the effects do not know of themselves.
  bool advance(AugmentedState& state, const BaseMotion& to, Spread* spread = nullptr) const;
  // Where the tip is, as a point in {A} before the cameras: effects with an offset included.
  void point(const AugmentedState& state, TipReading& reading) const;
  // What the cameras make of such a point.
  void through_cameras(TipReading& reading) const;
  // What a sensor in the needle's tip reports of its heading, before and after the frame in which it does.
  void heading(const AugmentedState& state, HeadingReading& reading) const;
  void through_frame(HeadingReading& reading) const;
  // What the effects do not know of a reading, along the axes of {A}.
  std::array<double, 3> blur_mm2(const AugmentedState& state) const;
  // By how much readings are late; zero without camera_latency.
  Dual latency_s() const;
  // Whether an effect may put a jump into the path.
  bool is_sudden() const;

  const NeedleParameters& needle() const { return needle_; }
  std::span<const ActiveEffect> effects() const { return effects_; }
  int columns() const { return columns_; }
  // For a filter, whose curvature and lambda are states, and ell on request.
  void set_needle(double curvature_per_mm, double lambda1_per_rad, double lambda2, double wheelbase_mm);

 private:
  bool advance_plain(AugmentedState& state, const BaseMotion& to) const;
  bool advance_with_effects(AugmentedState& state, const BaseMotion& to, Spread* spread) const;
  // The pose over a leg, and its derivatives but for those that come in through the leg's own increments and curvature.
  bool integrate(AugmentedState& state, const StepInput& input, StepJacobian& J) const;
  Parameters parameters(const ActiveEffect& active) const {
    return {active.parameters.data(), active.effect->parameters().size()};
  }

  NeedleParameters needle_;
  SlipParameters slip_;
  std::vector<ActiveEffect> effects_;
  int columns_;
  NeedleColumns needle_columns_;
  bool keeps_history_ = false;
};

}  // namespace bevel::model
