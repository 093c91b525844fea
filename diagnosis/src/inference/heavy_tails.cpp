// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/heavy_tails.hpp>

#include <boost/math/special_functions/gamma.hpp>
#include <cmath>

namespace bevel::inference {
namespace {

constexpr double kDegrees[] = {3, 4, 5, 6, 8, 10, 15, 30};
constexpr double kChance = 10.8;  // twice the log likelihood, of one degree of freedom: once in 1000
constexpr int kSteps = 30;        // of expectation and maximisation, from the scale of an untruncated t
constexpr double kAlike = 1e-3;

// Of the normalising constants, t's less the normal one's, in the same unit.
double log_constant(const Tails& t) {
  return std::log(boost::math::tgamma_ratio(0.5 * (t.degrees + 1), 0.5 * t.degrees)) - 0.5 * std::log(0.5 * t.degrees) -
         0.5 * std::log(t.scale);
}

double weight_of(double square, const Tails& t) { return (t.degrees + 1) / (t.degrees + square / t.scale); }

double likeliest_scale(std::span<const double> squares, double degrees) {
  Tails t{.degrees = degrees, .scale = (degrees - 2) / degrees};
  for (int step = 0; step < kSteps; ++step) {
    double sum = 0;
    for (const double square : squares) sum += weight_of(square, t) * square;
    const double before = t.scale;
    t.scale = sum / static_cast<double>(squares.size());
    if (std::abs(t.scale - before) < kAlike * before) break;
  }
  return t.scale;
}

}  // namespace

Tails likeliest_tails(std::span<const double> squares) {
  Tails best;
  double most = 0.5 * kChance;
  for (const double degrees : kDegrees) {
    if (squares.empty()) break;
    const Tails t{.degrees = degrees, .scale = likeliest_scale(squares, degrees)};
    double gain = static_cast<double>(squares.size()) * log_constant(t);
    for (const double square : squares)
      gain += 0.5 * square - 0.5 * (degrees + 1) * std::log1p(square / (t.scale * degrees));
    if (gain > most) most = gain, best = t;
  }
  return best;
}

double information_of(const Tails& t) { return t.degrees > 0 ? (t.degrees + 1) / (t.degrees + 3) : 1; }

double precision_of(double square, const Tails& t) { return information_of(t) * weight_of(square, t) / t.scale; }

double log_density_beyond(double precision, const Tails& t) {
  const double information = information_of(t), w = precision * t.scale / information, nu = t.degrees;
  const double c = 0.5 * (nu + 1) * std::log((nu + 1) / (nu * w)) - 0.5 * (nu + 1 - nu * w);
  // The last term is the weighed squares' part that the information leaves out; in the mean they are one.
  return log_constant(t) - c - 0.5 * std::log(precision) - 0.5 * (1 - information);
}

}  // namespace bevel::inference
