// SPDX-License-Identifier: MIT
#pragma once
// Noise with heavier tails than the normal distribution's: innovations are Student's t. Beside a fit each has a
// precision of its own, by expectation and maximisation (Lange, Little and Taylor 1989, JASA 84), with which all else
// is as for normal noise. Of its square s in squares of t's scale, with nu degrees of freedom,
//
//   -(nu + 1)/2 log(1 + s/nu) = max over w of [-w s/2 - c(w)],   w = (nu + 1)/(nu + s)
//
// (the logarithm is concave in s): by the weights that belong to it a fit has the likelihood of Student's t. Weights
// say more of a mean than t does: their expected information is 1, that of t f = (nu + 1)/(nu + 3). What is added up is
// f w s; the rest of the density, in the mean over squares, is in log_density_beyond().
#include <span>

namespace bevel::inference {

struct Tails {
  double degrees = 0;  // of freedom; 0: normal
  double scale = 1;    // square of t's scale, in variances of the noise. Outliers are taken out: no fixed share of it
  bool operator==(const Tails&) const = default;
};

// The likeliest of squared innovations, in variances; normal, unless t is so much likelier as chance brings once in
// 1000.
Tails likeliest_tails(std::span<const double> squares);
// Of an innovation's square in variances, relative to a normal one's.
double precision_of(double square, const Tails& tails);
// The sum of precision times square falls short of their number by this factor.
double information_of(const Tails& tails);
// Logarithm of the density less log(precision)/2 - precision square/2.
double log_density_beyond(double precision, const Tails& tails);

}  // namespace bevel::inference
