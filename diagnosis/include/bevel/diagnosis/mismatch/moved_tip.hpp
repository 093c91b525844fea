// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Computes the tip displacement by a part of a model: the distance between the predictions of two models, open loop
/// along the recorded actuator motion.
#include <bevel/diagnosis/inference/layout.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>

namespace bevel::diagnosis {

/// A needle model with its effects, parameters and discrepancy terms. Does not own what it refers to.
struct ModelledTip {
  const inference::Layout* layout = nullptr;              ///< effects and order of the parameters
  const Eigen::VectorXd* shared = nullptr;                ///< shared parameters
  const std::vector<Eigen::VectorXd>* local = nullptr;    ///< insertion-specific parameters, one vector per recording
  std::span<const inference::CurveValues> discrepancy{};  ///< discrepancy terms; empty: none
};

/// Computes the distance in space between the tips of two models, as the cameras see them, at the deepest measurement
/// of each recording (of two groups: of the second group).
/// @param system recordings
/// @param one first model
/// @param other second model
/// @return root mean square over the recordings, mm; NaN if a model leaves the domain of the slip law
double apart_at_depth_mm(const NeedleSystem& system, const ModelledTip& one, const ModelledTip& other);

/// Computes apart_at_depth_mm() between a model and the model without one of its effects, with all other parameters
/// unchanged.
/// @param system recordings
/// @param model the model
/// @param member position of the effect in the model's set
/// @return root mean square over the recordings, mm; NaN if a model leaves the domain of the slip law
double moved_by_member_mm(const NeedleSystem& system, const ModelledTip& model, std::size_t member);

}  // namespace bevel::diagnosis
