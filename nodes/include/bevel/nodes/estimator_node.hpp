// SPDX-License-Identifier: MIT
#pragma once
// bevel-estimator: TIP_MEASUREMENT, TIP_HEADING and ACTUATOR_STATE in, NEEDLE_STATE out: one for each actuator state,
// at its time, and one for each reading as it arrives, at that moment, the axes carried on at the rates that they last
// reported. Who acts on it need not wait for the next actuator state.
//
// It carries out three operator commands (bevel/nodes/operator_words.hpp): `entry` (start with the tip at the entry
// point), `confirm` (continue from the positions of the axes, although the motion was not observed) and `arm` (accept
// inputs again that were rejected).
#include <optional>
#include <string>

#include <bevel/estimator/entry_line.hpp>
#include <bevel/estimator/innovation_watch.hpp>
#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/nodes/camera_watch.hpp>
#include <bevel/nodes/entry_watch.hpp>
#include <bevel/nodes/operator_words.hpp>

namespace bevel::nodes {

// What an operator should know of how the needle went in; empty where all is as expected.
std::string describe(const estimator::EntryLine& entry);
// The ratio of each camera's innovations to what is expected of them, and which are too large. Empty before any.
std::string describe(const estimator::InnovationWatch& innovations);
// Of the states that the file gives a width, with their standard deviations. Empty where there are none.
std::string describe(const estimator::Nuisance& nuisance);
needle_state_t to_message(const estimator::Estimate& estimate, std::int64_t seq);

class EstimatorNode {
 public:
  // `bounds`: what no axis of the rig exceeds.
  EstimatorNode(lcm::LCM& lcm, const estimator::EstimatorConfig& config, const io::MotionBounds& bounds);
  void tell_time(const Now& now) { port_.tell_time(now); }
  // Health and status; everything else happens when messages arrive. Call it often (every 10 ms).
  void step(const Now& now);

  LcmPort& port() { return port_; }
  const estimator::NeedleEstimator& estimator() const { return estimator_; }
  // Returns the health bits (bevel/estimator/health.hpp) of the newest estimate and of the inputs.
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
  std::string remark_;                                        // what the last trouble was
};

}  // namespace bevel::nodes
