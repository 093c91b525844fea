// SPDX-License-Identifier: MIT
/// @file
/// Noise with heavier tails than the normal distribution: the innovations follow Student's t.
///
/// About a fit each innovation has its own precision, by expectation and maximisation (Lange, Little and Taylor 1989,
/// JASA 84). All other computations are those for normal noise. For a square s in units of the square of t's scale,
/// with nu degrees of freedom,
///
/// \code{.unparsed}
///   -(nu + 1)/2 log(1 + s/nu) = max over w of [-w s/2 - c(w)],   w = (nu + 1)/(nu + s)
/// \endcode
///
/// because the logarithm is concave in s. With these weights a fit has the likelihood of Student's t. The weights
/// overstate the information about a mean: their expected information is 1, that of t is f = (nu + 1)/(nu + 3). The
/// cost therefore sums f w s. log_density_beyond() holds the rest of the density, averaged over the squares.
#pragma once
#include <span>

namespace bevel::inference {

/// Distribution of the innovations.
struct Tails {
  double degrees = 0;  ///< Degrees of freedom; 0: normal.
  /// Square of t's scale, in variances of the noise. It is estimated, because the removal of outliers changes it.
  double scale = 1;
  /// Compares all members.
  /// @return True if the distributions are equal.
  bool operator==(const Tails&) const = default;
};

/// Estimates the most likely distribution of innovations.
/// @param squares Squared innovations, in variances of the noise.
/// @return Student's t if its likelihood gain has a probability below 0.001 by chance; otherwise normal.
Tails likeliest_tails(std::span<const double> squares);
/// Computes the precision of an innovation relative to normal noise.
/// @param square Squared innovation, in variances of the noise.
/// @param tails Distribution; not normal.
/// @return Precision, dimensionless.
double precision_of(double square, const Tails& tails);
/// Computes the expected sum of precision times square divided by the number of innovations.
/// @param tails Distribution.
/// @return (degrees + 1) / (degrees + 3); 1 for normal noise.
double information_of(const Tails& tails);
/// Computes the log density minus (log(precision) - precision square) / 2.
/// @param precision Precision of the innovation (precision_of()).
/// @param tails Distribution; not normal.
/// @return Natural log.
double log_density_beyond(double precision, const Tails& tails);

}  // namespace bevel::inference
