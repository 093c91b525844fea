// SPDX-License-Identifier: MIT
#pragma once
// What follows from the sets that were visited: probabilities of sets, of each effect, of a discrepancy; each unknown's
// posterior; what each recording would have been given the others.
#include <map>
#include <optional>

#include <bevel/diagnosis/inference/profile.hpp>
#include <bevel/diagnosis/inference/search.hpp>

namespace bevel::inference {

struct SetShare {
  ModelSet set;
  double probability = 0;
  double with_discrepancy = 0;  // part of it
  double unknown = 0;           // part of that: with one as visible as was asked for
};

/// Probabilities given that one of the fitted candidate models is true.
struct Posterior {
  std::vector<SetShare> sets;  // the likeliest first
  /// Estimated share that the candidate models which were not fitted would have (Search::share_not_visited()).
  double not_visited = 0;
  std::map<std::string, double> inclusion;  // of each effect by name: the sum over the sets that hold it
  double discrepancy = 0;                   // probability of one as visible as was asked for
  double nothing = 0;                       // of neither an effect nor such a discrepancy
};

// visible_sigmas: from which a discrepancy counts; smaller ones are errors of form, which widen intervals and are not
// called missing physics.
Posterior posterior_of(const Search& search, double visible_sigmas);

// Of a fit with a curve: its values, as far as the set's own unknowns and what the recordings have of their own do not
// take their place, in standard deviations of the autocorrelated noise, root of the sum of squares over all readings.
double visible_sigmas_of_curve(const Search& search, const Fit& fit);
// That it is above this many, given the discrepancy: by what is known of the fitted curves' values, or, where none was
// likely enough to be fitted, of every curve by the linear model.
double probability_visible(const Search& search, const Evaluated& at, double sigmas);

// The curves of a fit with some, whitened by the fit's own noise; none for a fit without.
CurveColumns curve_of(const Search& search, const Fit& fit);
// Over the grid of the nuisances' standard deviations, of a fit of one of the sets that were visited.
const Eigen::VectorXd& nuisance_weights_of(const Search& search, const Fit& fit);

// A mixture of normals: over sets, with and without their curves, and over the nuisances' standard deviations.
struct Mixture {
  struct Part {
    double weight = 0, mean = 0, sd = 0;
  };
  std::vector<Part> parts;
  double mean() const;
  double sd() const;
  double quantile(double share) const;
};

// Posteriors of shared unknowns: by the linear models about the modes, and along the likelihood where an unknown has
// many local minima or the likelihood is no parabola.
class Unknowns {
 public:
  explicit Unknowns(const Search& search);
  // Over all sets that hold the effect; a parameter of the base where effect is -1. Empty where no set holds it.
  Mixture of(int effect, std::size_t parameter) const;
  // Posterior of one group's standard deviation, over the sets: probabilities of NuisanceGroup::standard_deviations.
  Eigen::VectorXd of_group(std::size_t group) const;

 private:
  struct Part {
    double weight = 0;
    const Layout* layout = nullptr;
    Eigen::VectorXd mean, sd, nuisance_sd;
    std::map<Eigen::Index, std::vector<ProfileStep>> along;
  };
  static void look_along(const Fit& fit, const CurveColumns& curve, const Eigen::MatrixXd& covariance, Part& part);

  const Search* search_;
  std::vector<Part> parts_;
};

// One recording given the others, by the linear model about a mode.
struct LeftOut {
  Eigen::VectorXd shared, curve_values;  // as the others give them, bounds respected
  double log_density = 0;                // of the recording; constants of 2 pi left out
  double chi2 = 0;                       // of its readings under the predictive density
};
// None where the linear model has no mode.
std::optional<LeftOut> leave_out(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                                 std::size_t recording);
// Its predictive density about the fit's own values, with the covariance that the others give them.
struct Predictive {
  double log_density = 0;  // constants of 2 pi left out
  double chi2 = 0;
};
std::optional<Predictive> predictive_of(const Fit& fit, const std::vector<ArrowBlock>& blocks,
                                        const CurveColumns& curve, std::size_t recording);

// Each recording given the others, sets and parameters: sets are weighed, and their parameters fitted, without it, by
// the linear models. (Which sets were visited was decided with all recordings.)
struct LeftOutShare {
  const Fit* fit = nullptr;  // of all recordings; it lives as long as the search
  double probability = 0;    // given the others
};
struct LeftOutSelection {
  double log_density = 0;            // of the mixture; constants of 2 pi left out
  const Fit* fit = nullptr;          // the likeliest without the recording; it lives as long as the search
  std::vector<LeftOutShare> shares;  // those that are worth a computation, the likeliest first
};
// Throws DomainError where no model has a mode without one of them.
std::vector<LeftOutSelection> leave_out_selection(const Search& search);

}  // namespace bevel::inference
