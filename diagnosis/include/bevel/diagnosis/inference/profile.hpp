// SPDX-License-Identifier: MIT
#pragma once
// The likelihood along one shared unknown, all else following: where it has many local minima, is cut off by a bound or
// is no parabola, this is what says how well the unknown is known.
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

class Profile {
 public:
  // They live as long as this does.
  Profile(const Likelihood& likelihood, const CurveColumns& curve, const Fit& fit);
  // False outside the model's domain.
  bool valid() const { return valid_; }
  // The unknowns with this one at this value and every instant where `local` has it, all else at the least cost by the
  // linear model; its cost, infinite outside the model's domain.
  double at(Eigen::Index which, double value, Eigen::VectorXd& shared, std::vector<Eigen::VectorXd>& local) const;
  // The same, with every instant of the effect that the unknown is of where, near where it is, it costs least.
  double following_instants(Eigen::Index which, double value, Eigen::VectorXd& shared,
                            std::vector<Eigen::VectorXd>& local) const;
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

// The posterior density of one shared unknown, in steps within its bounds: the weight of each (sum 1) and its middle;
// outwards from the mode for as long as anything is left. near: about a standard deviation.
struct ProfileStep {
  double weight = 0, middle = 0, width = 0;
};
std::vector<ProfileStep> posterior_along(const Profile& profile, Eigen::Index which, double near);

// The same with all else fitted anew at each step, so that a curved ridge is followed; between steps the signed root of
// the rise in cost is a line (Bates and Watts 1988, Nonlinear Regression Analysis, 6.1). by_which: how the others move
// with it to begin with. parabola: empty where two standard deviations (near) to either side are what the linear model
// says.
std::vector<ProfileStep> posterior_by_refits(const Likelihood& likelihood, const CurveColumns& curve, const Fit& fit,
                                             Eigen::Index which, const Eigen::VectorXd& by_which, double near,
                                             bool parabola);

}  // namespace bevel::inference
