#pragma once
// What each effect would look like in these recordings: its signature, the change that it makes in the whitened
// residuals, for each of its starts. From it, without any fit: where a fit should begin, how much of an effect the
// needle's own parameters absorb, the smallest size that would show, and how large a gain chance alone brings.
//
// Everything is relative to a fitted hypothesis, whose sensitivities span what is absorbed: P = I - Q Q^T.
#include <cstdint>
#include <optional>

#include "diagnosis/mismatch/likelihood.hpp"

namespace bevel::diagnosis {

// The fitted hypothesis, linearised: whitened residuals of all recordings, and the span of its sensitivities.
struct Ground {
  Eigen::VectorXd residual;                 // projected: Q^T residual = 0
  Eigen::MatrixXd Q;                        // orthonormal columns
  std::vector<Eigen::Index> rows;           // first row of each recording; one more at the end
  std::vector<Eigen::VectorXd> path_white;  // whitened prediction per recording
};
Ground make_ground(const Evidence& evidence, const Fit& fit);

// An effect at one of its starts: one column per amplitude, or per recording a choice of columns.
struct Signature {
  std::vector<double> shape;  // values of all its parameters, amplitudes at their starts
  Eigen::MatrixXd columns;    // projected; one per amplitude (none: one, of the effect as it is)
  Eigen::MatrixXd gram_inverse;
  double absorbed = 0;  // share of the whole signature's square that the projection took
  struct Choice {
    double value;            // of the per-recording parameter
    Eigen::VectorXd column;  // rows of that recording
    double squared;          // after projection
  };
  std::vector<std::vector<Choice>> choices;  // per recording; empty unless the effect has such a parameter
};

struct Candidate {
  Member member;
  std::vector<int> amplitudes;  // parameters that vanish at `none`
  int local = -1;               // parameter that each recording has for itself
  bool local_may_be_off = false;
  std::vector<Signature> signatures;
};

std::vector<Candidate> make_dictionary(const Evidence& evidence, const Fit& fit, const Ground& ground,
                                       const std::vector<Member>& members, int threads);
std::vector<Member> members_of_library(const EffectSet& but);

// What a linear model promises: the fall of chi2, and the amplitudes (and local values) at which.
struct Promise {
  double gain = 0;
  std::vector<double> parameters;  // all of the effect's
  std::vector<double> local_by_recording;
};
Promise promise_of(const Candidate& candidate, const Signature& signature, const Ground& ground,
                   const Eigen::VectorXd& residual);
std::vector<Promise> best_promises(const Candidate& candidate, const Ground& ground, std::size_t count);
// The start that promises most, the first of several that promise as much; null if there is none.
struct PromisingStart {
  const Signature* signature = nullptr;
  Promise promise;
};
PromisingStart most_promising_start(const Candidate& candidate, const Ground& ground);

// |projected signature| of one unit of an amplitude, the median over the starts: 1 / that is the size of one standard
// deviation. Zero where these recordings cannot show it.
double visible_per_unit(const Candidate& candidate, std::size_t amplitude);
// The same signatures' median share that the hypothesis's own parameters absorb.
double absorbed_share(const Candidate& candidate);
// Orthonormal basis of the visible part of a candidate at its most promising start; no columns if there is none.
Eigen::MatrixXd visible_basis(const Candidate& candidate, const Ground& ground);

// Gains that noise alone brings, by parametric bootstrap of the fitted hypothesis: white residuals drawn anew, each
// candidate at its best start.
struct NullGains {
  std::vector<double> mean;       // per candidate
  std::vector<double> threshold;  // per candidate: exceeded by any of the library in 1 of 100 draws
  int draws = 0;
  std::uint64_t seed = 0;
};
NullGains bootstrap_null(const std::vector<Candidate>& dictionary, const Ground& ground, int draws, std::uint64_t seed,
                         int threads);

}  // namespace bevel::diagnosis
