// SPDX-License-Identifier: MIT
/// @file
/// Prior densities, each with a normal density that replaces it where an integral needs a quadratic exponent.
///
/// The integral is then multiplied by the ratio of the two densities at its mode (Laplace's method; Tierney and Kadane
/// 1986, JASA 81).
#pragma once
#include <limits>

namespace bevel::inference {

/// Prior density of one scalar parameter. All values are in the parameter's unit.
struct Prior {
  /// Family of the density.
  enum class Form {
    normal,  ///< Normal with mean `middle` and standard deviation `scale`.
    flat,    ///< Uniform over [lower, upper]; with `outside` > 0, 5 % of the mass lies over a wider range.
    size,    ///< Effect size: half the mass is Student's t (4 degrees of freedom) about `middle` with scale `scale`;
             ///< half is log-uniform in the distance from `middle`, between scale / 30 and scale.
  };
  Form form = Form::normal;  ///< Family of the density.
  double middle = 0,         ///< Centre of the density.
      scale = 1;             ///< normal: standard deviation; size: scale; flat: upper - lower.
  double lower = 0,          ///< flat: lower end of the range; size: lower bound, which may equal `middle`.
      upper = 0;             ///< flat: upper end of the range; size: upper bound, which may equal `middle`.
  double outside = 0;        ///< flat: width of the wider range, which includes [lower, upper]; 0: no wider range.
  /// size: smallest distance from `middle` that the causes of the effect produce. The density below it has a factor
  /// of 0.05.
  double least_distance = 0,
         /// size: largest value that the causes of the effect produce. The density above it has a factor of 0.05.
      largest = std::numeric_limits<double>::infinity();
};
/// Makes a normal prior.
/// @param mean Mean, in the parameter's unit.
/// @param standard_deviation Standard deviation, positive.
/// @return Prior of Form::normal.
Prior normal_prior(double mean, double standard_deviation);
/// Makes a uniform prior over [lower, upper]. log_density() does not test the range.
/// @param lower Lower end of the range.
/// @param upper Upper end of the range, above \p lower.
/// @return Prior of Form::flat without a wider range.
Prior flat_prior(double lower, double upper);
/// Makes a uniform prior with 95 % of the mass over [lower, upper] and 5 % over [least, most].
/// @param lower Lower end of the range.
/// @param upper Upper end of the range, above \p lower.
/// @param least Lower end of the wider range, at most \p lower.
/// @param most Upper end of the wider range, at least \p upper.
/// @return Prior of Form::flat.
Prior flat_prior(double lower, double upper, double least, double most);
/// Makes a prior of an effect size.
/// @param none Value at which the effect vanishes.
/// @param scale Typical size of the effect, positive.
/// @param lower Lower bound.
/// @param upper Upper bound.
/// @return Prior of Form::size.
Prior size_prior(double none, double scale, double lower, double upper);

/// Computes the natural logarithm of the density.
/// @param prior Prior.
/// @param value Value of the parameter.
/// @param known_to Standard error of \p value. Form::size: distances from the middle below it count as this distance.
/// @return Log density, per unit of the parameter.
double log_density(const Prior& prior, double value, double known_to);
/// Computes the precision of the normal density that replaces a prior.
/// @param prior Prior.
/// @return 1 / scale^2; for Form::flat 2 pi / (upper - lower)^2, so that both have the same density at the centre.
double precision_of(const Prior& prior);
/// Computes the mean of the normal density that replaces a prior.
/// @param prior Prior.
/// @param value Value of the parameter.
/// @return \p value for Form::flat; `middle` for the others.
double centre_of(const Prior& prior, double value);
/// Computes log_density() minus the log density of the normal density that replaces the prior.
/// @param prior Prior.
/// @param value Value of the parameter.
/// @param known_to Standard error of \p value, as for log_density().
/// @return Natural log of the ratio; 0 for Form::normal.
double log_density_ratio(const Prior& prior, double value, double known_to);

/// First parameter of the prior Beta(kHappens, kHappensNot) of the probability that an event occurs in a recording.
/// The event time is uniform over the recording.
inline constexpr double kHappens = 1,
                        kHappensNot = 3;  ///< Second parameter of this prior.

}  // namespace bevel::inference
