// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/priors.hpp>

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <cmath>
#include <numbers>

namespace bevel::inference {
namespace {
constexpr double kTail = 4;             // degrees of freedom of Student's t
constexpr double kSmallest = 1.0 / 30;  // of the scale: what is smaller is no effect of any consequence
constexpr double kElsewhere = 0.05;

double log_student(double x) {
  return -std::log(boost::math::beta(kTail / 2, 0.5)) - 0.5 * std::log(kTail) -
         0.5 * (kTail + 1) * std::log1p(x * x / kTail);
}
}  // namespace

Prior normal_prior(double mean, double standard_deviation) {
  return {.form = Prior::Form::normal, .middle = mean, .scale = standard_deviation};
}
Prior flat_prior(double lower, double upper) {
  return {.form = Prior::Form::flat,
          .middle = 0.5 * (lower + upper),
          .scale = upper - lower,
          .lower = lower,
          .upper = upper};
}
Prior flat_prior(double lower, double upper, double least, double most) {
  Prior out = flat_prior(lower, upper);
  out.outside = most - least;
  return out;
}
Prior size_prior(double none, double scale, double lower, double upper) {
  return {.form = Prior::Form::size, .middle = none, .scale = scale, .lower = lower, .upper = upper};
}

double log_density(const Prior& prior, double value, double known_to) {
  switch (prior.form) {
    case Prior::Form::normal: {
      const double x = (value - prior.middle) / prior.scale;
      return -0.5 * x * x - std::log(prior.scale) - 0.5 * std::log(2 * std::numbers::pi);
    }
    case Prior::Form::flat: {
      const double density = 1 / (prior.upper - prior.lower);
      if (!(prior.outside > 0)) return std::log(density);
      const bool inside = value >= prior.lower && value <= prior.upper;
      return std::log((inside ? (1 - kElsewhere) * density : 0) + kElsewhere / prior.outside);
    }
    case Prior::Form::size: {
      const double x = std::max(std::abs(value - prior.middle), known_to) / prior.scale;
      static const double kOrders = -std::log(kSmallest);
      double any_order = 0;
      if (x < 1) any_order = 0.5 / (kOrders * std::max(x, kSmallest));
      if (x < kSmallest) {
        const double short_by = (kSmallest - x) * prior.scale / std::max(known_to, 1e-12 * prior.scale);
        any_order *= std::exp(-0.5 * short_by * short_by);
      }
      const bool one_sided =
          prior.middle <= prior.lower || prior.middle >= prior.upper || prior.largest <= prior.middle;
      const bool elsewhere = value > prior.largest || std::abs(value - prior.middle) < prior.least_distance;
      return std::log(0.5 * std::exp(log_student((value - prior.middle) / prior.scale)) + 0.5 * any_order) -
             std::log(prior.scale) + (one_sided ? std::numbers::ln2 : 0) + (elsewhere ? std::log(kElsewhere) : 0);
    }
  }
  return 0;
}

double precision_of(const Prior& prior) {
  return prior.form == Prior::Form::flat ? 2 * std::numbers::pi / (prior.scale * prior.scale)
                                         : 1 / (prior.scale * prior.scale);
}

double centre_of(const Prior& prior, double value) { return prior.form == Prior::Form::flat ? value : prior.middle; }

double log_density_ratio(const Prior& prior, double value, double known_to) {
  if (prior.form == Prior::Form::normal) return 0;
  const Prior stand_in = normal_prior(centre_of(prior, value), 1 / std::sqrt(precision_of(prior)));
  return log_density(prior, value, known_to) - log_density(stand_in, value, 0);
}

}  // namespace bevel::inference
