#pragma once
// The likelihood along one shared unknown, all else following by the linear model about a fit: where it has many local
// minima, is cut off by a bound or is no parabola, this is what says how well the unknown is known.
#include "diagnosis/inference/likelihood.hpp"

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

// The posterior density of one shared unknown, in steps within its bounds: the weight of each (sum 1), its middle, and
// all shared unknowns there; outwards from the mode for as long as anything is left. near: about a standard deviation.
struct ProfileStep {
  double weight = 0, middle = 0, width = 0;
  Eigen::VectorXd shared;
};
std::vector<ProfileStep> posterior_along(const Profile& profile, Eigen::Index which, double near);

}  // namespace bevel::inference
