// SPDX-License-Identifier: MIT
#pragma once
// What the errors of a model may be, given its readings: those at the mode, and what the spread of the unknowns about
// it does to them. A fit bends toward the readings, so its residuals are smaller than the errors are: the noise for
// which the readings are likeliest, all else integrated out, is that of the expected squares (expectation and
// maximisation, Dempster, Laird and Rubin 1977, J. R. Stat. Soc. B 39; for variance components Laird and Ware 1982,
// Biometrics 38).
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

// One recording's derivatives and errors in the channels' units, about a fit.
struct RawRows {
  Eigen::MatrixXd Z, L;  // by the shared unknowns (and the curves' values), by its own
  Eigen::VectorXd e;     // measured - predicted
  ArrowBlock block;      // whitened by the fit's own noise, with its precision and centre
};
// Of every recording; empty outside the model's domain.
std::vector<RawRows> raw_rows(const Fit& fit, const CurveColumns& curve);
// Whitened by a noise; precision and centre are left to the caller.
ArrowBlock block_by(const RawRows& raw, const SeriesSet& set, const Noise& noise);
// By channel. solution: with its whole covariance.
std::vector<ExpectedErrors> expected_errors(const RawRows& raw, const SeriesSet& set, const ArrowBlock& block,
                                            const ArrowSolution& solution, std::size_t recording);

struct NoiseBeside {
  Noise noise;
  ByReading precision;  // of each innovation, where it has heavy tails; else empty
};
// The likeliest noise beside a fit at its standard deviations; of the order that the fit's has, and its own where the
// model cannot follow.
NoiseBeside noise_beside(const Fit& fit, const CurveColumns& curve);
// Of a fit by normal noise: the same noise, if its tails are heavy with those.
NoiseBeside tails_beside(const Fit& fit, const CurveColumns& curve);
// Whether it is as good as that of a likelihood.
bool alike(const NoiseBeside& a, const Likelihood& b);

}  // namespace bevel::inference
