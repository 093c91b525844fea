// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Selects the next recording from a list of safe motions: the motion in which two explanations differ most after a
/// refit of the confounder's parameters, or in which an effect that is not detectable in these recordings is
/// detectable.
#include <bevel/diagnosis/mismatch/decision.hpp>

namespace bevel::diagnosis {

/// A motion to command.
struct MotionScript {
  std::string text;      ///< description of the motion
  model::Motion motion;  ///< actuator motion with its measurements
};
/// Lists the motions: insertions at no more than 10 mm/s and 2 pi rad/s.
/// @param depth_mm largest depth of insertion, mm
/// @param frame_s interval between measurements, s
/// @return the motions
std::vector<MotionScript> motion_scripts(double depth_mm, double frame_s);

/// A model in a recording that does not exist yet. Phases and event times are those of the first recording.
struct Imagined {
  inference::ModelSet set;                            ///< effects of the model
  Eigen::VectorXd shared,                             ///< shared parameters, as for System::predict()
      local;                                          ///< recording-specific parameters, as for System::predict()
  std::vector<inference::CurveValues> discrepancy{};  ///< values of its discrepancy terms; empty: none
  Eigen::MatrixXd information{};      ///< information about the shared parameters from the existing recordings
  Eigen::VectorXd local_precision{};  ///< prior precision of the insertion-specific parameters
};
/// Converts a fit to a model in a new recording. Insertion-specific parameters are set to zero.
/// @param fit the fit
/// @param model the model at the fit (model_of())
/// @return the model
Imagined imagined(const inference::Fit& fit, const ChosenModel& model);

/// Predicts how well each motion separates two models.
class Experiments {
 public:
  /// Plans the motions to the depth of the existing recordings.
  /// @param system recordings, whose channels the plan uses; has to outlive this object
  /// @param noise measurement noise of the planned recordings
  Experiments(const NeedleSystem& system, const inference::Noise& noise);
  /// Returns the motions.
  /// @return the motions of motion_scripts()
  const std::vector<MotionScript>& scripts() const { return scripts_; }
  /// Computes the expected difference in chi2 between two models in one recording of a motion, after a refit of the
  /// confounder's parameters within the existing information.
  /// @param script index into scripts()
  /// @param truth model that generates the recording
  /// @param rival model that explains the recording instead, after a refit
  /// @return difference in chi2, at least 0; 0 if a model leaves its domain
  double separation(std::size_t script, const Imagined& truth, const Imagined& rival) const;
  /// Selects the motion with the largest separation().
  /// @param truth model that generates the recording
  /// @param rival model that explains the recording instead, after a refit
  /// @return the motion, the two explanations and the expected difference in chi2
  NextExperiment best(const Imagined& truth, const Imagined& rival) const;

 private:
  const NeedleSystem& system_;
  std::vector<MotionScript> scripts_;
  std::unique_ptr<const NeedleSystem> planned_;
  std::unique_ptr<const inference::Likelihood> likelihood_;
};

}  // namespace bevel::diagnosis
