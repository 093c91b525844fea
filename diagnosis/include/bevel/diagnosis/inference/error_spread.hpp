// SPDX-License-Identifier: MIT
/// @file
/// Expected errors of a model given its measurements: the residuals at the mode plus the effect of the unknowns'
/// posterior covariance.
///
/// A fit follows the measurements, so its residuals are smaller than the errors. The most likely noise with all other
/// unknowns integrated out is that of the expected squares (expectation and maximisation, Dempster, Laird and Rubin
/// 1977, J. R. Stat. Soc. B 39; for variance components Laird and Ware 1982, Biometrics 38).
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

/// Derivatives and errors of one recording about a fit, in the channels' units.
struct RawRows {
  Eigen::MatrixXd Z,  ///< Derivatives by the shared unknowns and the curve values, rows x unknowns.
      L;              ///< Derivatives by the local unknowns, rows x unknowns.
  Eigen::VectorXd e;  ///< Measured minus predicted.
  ArrowBlock block;   ///< Normal equations with the fit's own noise, with precision and centre.
};
/// Computes the rows of every recording.
/// @param fit Fit with its likelihood.
/// @param curve Columns of the fit's curves.
/// @return Rows per recording; empty outside the model's domain.
std::vector<RawRows> raw_rows(const Fit& fit, const CurveColumns& curve);
/// Computes the normal equations of one recording with another noise. The caller sets precision and centre.
/// @param raw Rows of the recording.
/// @param set Measurements of the recording.
/// @param noise Noise.
/// @return Block without prior.
ArrowBlock block_by(const RawRows& raw, const SeriesSet& set, const Noise& noise);
/// Computes the expected errors of one recording.
/// @param raw Rows of the recording.
/// @param set Measurements of the recording.
/// @param block Normal equations of the recording.
/// @param solution Solution of all recordings, with its full covariance.
/// @param recording Index of the recording.
/// @return Expected errors per channel.
std::vector<ExpectedErrors> expected_errors(const RawRows& raw, const SeriesSet& set, const ArrowBlock& block,
                                            const ArrowSolution& solution, std::size_t recording);

/// Noise about a fit.
struct NoiseBeside {
  Noise noise;          ///< Noise.
  ByReading precision;  ///< Precision of each innovation for heavy tails; otherwise empty.
};
/// Estimates the most likely noise about a fit at its standard deviations. The order is that of the fit's noise.
/// @param fit Fit with its likelihood.
/// @param curve Columns of the fit's curves.
/// @return Noise; the fit's own outside the model's domain.
NoiseBeside noise_beside(const Fit& fit, const CurveColumns& curve);
/// Estimates the tails of the noise about a fit that was made with normal noise.
/// @param fit Fit with its likelihood.
/// @param curve Columns of the fit's curves.
/// @return The fit's noise, with heavy tails if they are more likely.
NoiseBeside tails_beside(const Fit& fit, const CurveColumns& curve);
/// Tests whether a noise differs so little from a likelihood's noise that no result depends on the difference.
/// @param a Noise.
/// @param b Likelihood.
/// @return True if they are equivalent.
bool alike(const NoiseBeside& a, const Likelihood& b);

}  // namespace bevel::inference
