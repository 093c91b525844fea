// SPDX-License-Identifier: MIT
#pragma once
// What each effect would do to the readings, from a grid of starts, once, about one fit; and from it, without any new
// fit, what each promises beside a set that was fitted: an estimate of its log Bayes factor, and where to begin.
#include <span>

#include <bevel/diagnosis/inference/marginal.hpp>

namespace bevel::inference {

struct StartPoint {
  Eigen::VectorXd shared;              // of the effect's shared parameters, in their order
  std::vector<Eigen::VectorXd> local;  // of its others, per recording
  double log_bayes_factor = 0;
  bool base_at_prior = false;  // it was seen with the base where its prior has it
  // Of the shared unknowns of the fit that it joins, beside it, if it was seen with them there; empty: where they are.
  Eigen::VectorXd beside{};
};

struct Proposal {
  std::size_t effect = 0;
  double log_bayes_factor = 0;     // averaged over the starts; minus infinity: no start can be evaluated
  std::vector<StartPoint> starts;  // the likeliest first
};

// What these readings can show of each effect, beside the base.
struct Reach {
  struct Size {
    std::size_t effect = 0, parameter = 0;
    double one_deviation = 0;  // a size whose visible part has one standard deviation of the noise, over all readings
    double typical = 0;        // where fits begin
    double absorbed = 0;       // share of the signature, in squares, that the base and the nuisances take over
  };
  std::vector<Size> sizes;           // of every parameter at which an effect vanishes
  std::vector<std::size_t> effects;  // rows of
  Eigen::MatrixXd cosine;            // between visible parts
};

// Unknowns of one recording, shared and its own, under a layout with one effect more, at these values of its
// parameters.
std::pair<Eigen::VectorXd, Eigen::VectorXd> unknowns_with(const Layout& layout, const Layout& from,
                                                          const Eigen::VectorXd& shared, const Eigen::VectorXd& local,
                                                          std::size_t effect, const Eigen::VectorXd& values);
// The base's parameters of normal prior where that has them, and recordings that do not differ.
Fit with_base_at_prior(Fit fit);

class Proposals {
 public:
  // About a fit of any set: what its members do is there when the others are added, as far as they are allowed beside
  // each other.
  Proposals(const Likelihood& likelihood, const Fit& about);

  // Every effect that may join the set of a fit, the likeliest first.
  std::vector<Proposal> beside(const Marginal& fit, std::size_t starts) const;
  // Of those, anew, what is no multiple of itself at another size (steps of a length, again and again), with the shared
  // unknowns of the fit where the linear model has them beside each of its starts: what took up the steps' mean, as a
  // latency does, shifts them, too, and steps that are elsewhere are not seen. by: whitens the columns (Marginal).
  void look_with_others_moved(const Likelihood& by, const Fit& fit, const Marginal& beside, std::size_t starts,
                              std::vector<Proposal>& proposals) const;
  // Pairs beside the base, by their joint estimate, the likeliest first.
  std::vector<std::pair<double, ModelSet>> pairs(const Marginal& base, std::size_t count) const;
  // Of effects in the middle of their starts; what happens at an instant, in the middle of every recording.
  Reach reach(const Marginal& base) const;

 private:
  struct Signature {
    Eigen::VectorXd values;  // the effect's parameters at this start
    Eigen::Index first = 0;  // column; as many as the effect has amplitudes
    bool base_at_prior = false;
  };
  struct Candidate {
    std::vector<std::size_t> amplitudes;
    int local = -1;  // parameter that each recording has for itself
    bool instant = false;
    std::vector<Signature> signatures;
    std::vector<std::vector<double>> choices;  // of the local parameter, per recording
    std::vector<Eigen::MatrixXf> columns;      // per recording; with a local parameter: signatures x choices
    Eigen::Index width() const {
      return local >= 0 ? 1 : std::max<Eigen::Index>(1, static_cast<Eigen::Index>(amplitudes.size()));
    }
  };
  // One signature of an effect, among columns of several effects.
  struct Side {
    std::size_t effect = 0, signature = 0;
    Eigen::Index first = 0, width = 0;
  };
  Candidate make_candidate(const Likelihood& likelihood, std::span<const Fit> views, std::size_t effect) const;
  Proposal judge(const Candidate& candidate, std::size_t effect, const Marginal& beside, std::size_t starts) const;
  // Where the linear model has the shared unknowns beside each signature, as steps: shared x signatures.
  static Eigen::MatrixXd steps_beside(const Candidate& candidate, const Marginal& beside);
  Proposal judge_local(const Candidate& candidate, std::size_t effect, const Marginal& beside,
                       std::size_t starts) const;
  std::size_t nearest_signature(const Proposal& proposal) const;
  std::vector<Eigen::MatrixXf> side_by_side(std::vector<Side>& sides) const;
  Eigen::VectorXd prior_precision(const Side& side) const;

  const System* system_;
  std::vector<Candidate> candidates_;
};

}  // namespace bevel::inference
