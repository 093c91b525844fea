// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// bevel-estimator: subscribes to TIP_MEASUREMENT, TIP_HEADING and ACTUATOR_STATE, publishes NEEDLE_STATE: one for each
/// actuator state, at its time, and one for each measurement as it arrives, at the time of arrival. For the latter the
/// axes are extrapolated at their last reported rates, so that a subscriber need not wait for the next actuator state.
///
/// The node executes three operator commands (bevel/nodes/operator_words.hpp): `entry` (start with the tip at the entry
/// point), `confirm` (continue from the positions of the axes, although the motion was not observed) and `arm` (accept
/// inputs again that were rejected).
#include <optional>
#include <string>

#include <bevel/estimator/entry_line.hpp>
#include <bevel/estimator/innovation_watch.hpp>
#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/nodes/camera_watch.hpp>
#include <bevel/nodes/entry_watch.hpp>
#include <bevel/nodes/operator_words.hpp>

namespace bevel::nodes {

/// Describes deviations of the first part of the insertion for the operator.
/// @param entry fit of the entry
/// @return text; empty if everything is as expected
std::string describe(const estimator::EntryLine& entry);
/// Describes the ratio of each camera's innovations to their expected size, and which are too large.
/// @param innovations statistics of the innovations
/// @return text; empty without innovations
std::string describe(const estimator::InnovationWatch& innovations);
/// Describes the estimated nuisance states with their standard deviations.
/// @param nuisance states that have a standard deviation in the system file
/// @return text; empty if there are none
std::string describe(const estimator::Nuisance& nuisance);
/// Converts an estimate to a NEEDLE_STATE message.
/// @param estimate estimate
/// @param seq      number of the message
/// @return message, pose in {A}, mm
needle_state_t to_message(const estimator::Estimate& estimate, std::int64_t seq);

/// Node of the process bevel-estimator.
class EstimatorNode {
 public:
  /// Creates the node.
  /// @param lcm    LCM; must outlive the node
  /// @param config settings of the estimator
  /// @param bounds bounds that no axis of the rig exceeds
  EstimatorNode(lcm::LCM& lcm, const estimator::EstimatorConfig& config, const io::MotionBounds& bounds);
  /// Sets the time at which messages are processed.
  /// @param now present time
  void tell_time(const Now& now) { port_.tell_time(now); }
  /// Updates health and status; all other work is done when messages arrive. Call it every 10 ms.
  /// @param now present time
  void step(const Now& now);

  /// @return port of the node
  LcmPort& port() { return port_; }
  /// @return estimator
  const estimator::NeedleEstimator& estimator() const { return estimator_; }
  /// @return health bits (bevel/estimator/health.hpp) of the newest estimate and of the inputs
  std::int32_t health() const;

 private:
  void on_axes(const actuator_state_t& m);
  void on_tip(const tip_measurement_t& m);
  void on_heading(const tip_heading_t& m);
  void on_word(Word word);
  void on_trouble(const InputTrouble& trouble);
  void publish(estimator::Estimate estimate);
  void publish_evidence();
  void restart();

  io::MotionBounds bounds_;
  LcmPort port_;
  estimator::NeedleEstimator estimator_;
  estimator::EntryLine entry_line_;
  estimator::InnovationWatch innovations_;  // by camera
  StatusReporter status_;
  OperatorWords words_;
  CameraWatch cameras_, headings_;
  EntryWatch entry_;
  std::optional<actuator_state_t> axes_;
  std::int64_t published_utime_ = 0;
  std::int64_t seq_ = 0;
  bool input_refused_ = false;
  std::string innovation_text_, entry_text_, nuisance_text_;  // as of described_ns_
  std::int64_t described_ns_ = 0;                             // steady
  std::string remark_;                                        // description of the last trouble
};

}  // namespace bevel::nodes
