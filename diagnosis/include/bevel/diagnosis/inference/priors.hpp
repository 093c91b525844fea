// SPDX-License-Identifier: MIT
#pragma once
// Prior densities, each with the normal one that stands for it where an integral needs a quadratic: the integral is
// then multiplied by the ratio of the two densities at its mode (Laplace's method; Tierney and Kadane 1986, JASA 81).
#include <limits>

namespace bevel::inference {

struct Prior {
  enum class Form {
    normal,  // middle, scale
    flat,    // over [lower, upper]; with `outside` one part in twenty over a wider range
    size,    // of an effect: half of it Student's t of 4 degrees of freedom about `middle`, of scale `scale`; half of
             // it of any order of magnitude, down to a thirtieth of that
  };
  Form form = Form::normal;
  double middle = 0, scale = 1;
  double lower = 0, upper = 0;  // flat: the range; size: bounds, of which `middle` may be one
  double outside = 0;           // flat: width of the wider range, which holds the rest; 0: the density is zero outside
  // size: what the effect's causes bring about: this far from the middle at least, and no larger value than that.
  // One in twenty is said to lie elsewhere.
  double least_distance = 0, largest = std::numeric_limits<double>::infinity();
};
Prior normal_prior(double mean, double standard_deviation);
Prior flat_prior(double lower, double upper);
/// Uniform density: 19 of 20 parts over [lower, upper], one part over [least, most], which holds it.
Prior flat_prior(double lower, double upper, double least, double most);
Prior size_prior(double none, double scale, double lower, double upper);

// Natural logarithm of the density at a value that is known to `known_to` (a standard error): a density that varies
// within it is that at its edge.
double log_density(const Prior& prior, double value, double known_to);
// The normal prior that stands for it at this value: flat ones of the same volume, centred where the value is.
double precision_of(const Prior& prior);
double centre_of(const Prior& prior, double value);
// log_density less that of the normal one.
double log_density_ratio(const Prior& prior, double value, double known_to);

// Prior of "it happens at an instant in this recording": Beta(kHappens, kHappensNot), the instant uniform.
inline constexpr double kHappens = 1, kHappensNot = 3;

}  // namespace bevel::inference
