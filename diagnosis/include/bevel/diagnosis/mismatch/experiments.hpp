// SPDX-License-Identifier: MIT
#pragma once
// What to record next: of a list of safe motions, the one in which two explanations would differ most, the rival's own
// parameters refitted; or in which an effect that these recordings cannot show would show.
#include <bevel/diagnosis/mismatch/decision.hpp>

namespace bevel::diagnosis {

struct MotionScript {
  std::string text;  // what to command, in words
  model::Motion motion;
};
// Insertions of at most depth_mm, at most 10 mm/s and 2 pi rad/s; readings every frame_s.
std::vector<MotionScript> motion_scripts(double depth_mm, double frame_s);

// A model in a recording that is still to be made. Phases and instants: those of the first recording stand for them.
struct Imagined {
  inference::ModelSet set;
  Eigen::VectorXd shared, local;
  std::vector<inference::CurveValues> discrepancy{};
  Eigen::MatrixXd information{};      // of the shared unknowns, from what is recorded already
  Eigen::VectorXd local_precision{};  // of what differs between insertions
};
Imagined imagined(const inference::Fit& fit, const ChosenModel& model);

class Experiments {
 public:
  // As deep as these recordings, with their cameras and this noise. The system has to outlive it.
  Experiments(const NeedleSystem& system, const inference::Noise& noise);
  const std::vector<MotionScript>& scripts() const { return scripts_; }
  // Expected fall of chi2 from `rival` to `truth` in one recording of a script.
  double separation(std::size_t script, const Imagined& truth, const Imagined& rival) const;
  NextExperiment best(const Imagined& truth, const Imagined& rival) const;

 private:
  const NeedleSystem& system_;
  std::vector<MotionScript> scripts_;
  std::unique_ptr<const NeedleSystem> planned_;
  std::unique_ptr<const inference::Likelihood> likelihood_;
};

}  // namespace bevel::diagnosis
