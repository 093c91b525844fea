// SPDX-License-Identifier: MIT
#pragma once
// What a part of a model does to the tip: two models side by side, open loop along the recordings' own base motion.
#include <bevel/diagnosis/inference/layout.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>

namespace bevel::diagnosis {

// The needle with a set of effects, their values, and a discrepancy's curves. Borrows all of it.
struct ModelledTip {
  const inference::Layout* layout = nullptr;
  const Eigen::VectorXd* shared = nullptr;
  const std::vector<Eigen::VectorXd>* local = nullptr;  // one per recording
  std::span<const inference::CurveValues> discrepancy{};
};

// How far apart the cameras would see the two tips at the deepest reading of each recording (of two groups: of the
// second): root mean square over the recordings of distances in space, mm. NaN where one leaves the slip law's domain.
double apart_at_depth_mm(const NeedleSystem& system, const ModelledTip& one, const ModelledTip& other);

// The same of a model and the model without one member of its set, all other values as they are.
double moved_by_member_mm(const NeedleSystem& system, const ModelledTip& model, std::size_t member);

}  // namespace bevel::diagnosis
