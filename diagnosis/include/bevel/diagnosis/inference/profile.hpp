// SPDX-License-Identifier: MIT
/// @file
/// Profile likelihood of one shared unknown, with all other unknowns adjusted. It gives the uncertainty of an unknown
/// whose likelihood has many local minima, ends at a bound or is not a parabola.
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

/// Profile likelihood about a fit.
class Profile {
 public:
  /// Prepares the linear model.
  /// @param likelihood Likelihood; must outlive this object.
  /// @param curve Columns of the fit's curves; must outlive this object.
  /// @param fit Fit; must outlive this object.
  Profile(const Likelihood& likelihood, const CurveColumns& curve, const Fit& fit);
  /// Tests whether the fit is inside the model's domain.
  /// @return False outside the model's domain.
  bool valid() const { return valid_; }
  /// Computes the cost with one shared unknown at a given value and the event times as given. The linear model adjusts
  /// all others.
  /// @param which Index of the shared unknown.
  /// @param value Its value.
  /// @param[out] shared Shared unknowns at the minimum.
  /// @param[in,out] local Local unknowns per recording; the input gives the event times.
  /// @return Cost; infinite outside the model's domain.
  double at(Eigen::Index which, double value, Eigen::VectorXd& shared, std::vector<Eigen::VectorXd>& local) const;
  /// Computes the cost as at(), and also moves each event time of the unknown's effect to the best value nearby.
  /// @param which Index of the shared unknown.
  /// @param value Its value.
  /// @param[in,out] shared Shared unknowns.
  /// @param[in,out] local Local unknowns per recording.
  /// @return Cost; infinite outside the model's domain.
  double following_instants(Eigen::Index which, double value, Eigen::VectorXd& shared,
                            std::vector<Eigen::VectorXd>& local) const;
  /// Returns the fit.
  /// @return Argument of the constructor.
  const Fit& fit() const { return fit_; }

 private:
  double chi2(std::size_t recording, const Eigen::VectorXd& shared, const Eigen::VectorXd& local) const;

  const Likelihood& likelihood_;
  const CurveColumns& curve_;
  const Fit& fit_;
  std::vector<Eigen::Index> free_;
  std::vector<Eigen::MatrixXd> L_, Z_;
  std::vector<ArrowBlock> blocks_;
  bool valid_ = false;
};

/// One step of a posterior density.
struct ProfileStep {
  double weight = 0,  ///< Probability of the step; the sum over all steps is 1.
      middle = 0,     ///< Middle of the step, in the unknown's unit.
      width = 0;      ///< Width of the step, in the unknown's unit.
};
/// Computes the posterior density of a shared unknown in steps within its bounds, outwards from the mode while the
/// density is not negligible.
/// @param profile Profile likelihood.
/// @param which Index of the shared unknown.
/// @param near Approximate standard deviation of the unknown.
/// @return Steps.
std::vector<ProfileStep> posterior_along(const Profile& profile, Eigen::Index which, double near);

/// Computes the posterior density of a shared unknown with all others fitted again at each step, which follows a curved
/// ridge. Between steps the signed root of the rise in cost is linear (Bates and Watts 1988, Nonlinear Regression
/// Analysis, 6.1).
/// @param likelihood Likelihood.
/// @param curve Columns of the fit's curves.
/// @param fit Fit.
/// @param which Index of the shared unknown.
/// @param by_which Derivatives of the shared unknowns by this one, for the start values.
/// @param near Approximate standard deviation of the unknown.
/// @param parabola Whether to return an empty list if the linear model is correct at two standard deviations on both
/// sides.
/// @return Steps.
std::vector<ProfileStep> posterior_by_refits(const Likelihood& likelihood, const CurveColumns& curve, const Fit& fit,
                                             Eigen::Index which, const Eigen::VectorXd& by_which, double near,
                                             bool parabola);

}  // namespace bevel::inference
