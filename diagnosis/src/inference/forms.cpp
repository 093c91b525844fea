// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/forms.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <bevel/diagnosis/inference/log_sum.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr int kPhases = 8;  // of half a turn: the amplitude's sign is the other half
constexpr double kInvisible = 1e-9;

struct Shape {
  double value = 0, phase_rad = 0;
};

double range_of(const Curve& curve) { return curve.at.back() - curve.at.front(); }

// The grid of a form, with its phases.
std::vector<Shape> shapes_of(Form form, const Curve& curve) {
  std::vector<Shape> out;
  for (const double value : shape_grid(form, curve))
    for (int i = 0; i < (form == Form::sinusoid ? kPhases : 1); ++i)
      out.push_back({value, std::numbers::pi * i / kPhases});
  return out;
}

// One shape: averaged over the curves' scales.
struct Weighed {
  double log = 0;  // Bayes factor against none
  double amplitude = 0, amplitude_sd = 0;
};
Weighed weigh(const VectorXd& f, double visible, const Marginal::Added& likelihood) {
  Weighed out;
  const double square = f.dot(likelihood.square * f), pull = f.dot(likelihood.pull);
  std::vector<double> logs;
  double best = -std::numeric_limits<double>::infinity();
  for (const double scale : kCurveScales) {
    // As likely beforehand as a curve of this scale, whose visible part is as large.
    const double precision = visible * visible / (scale * scale);
    logs.push_back(visible > kInvisible ? 0.5 * (pull * pull / (square + precision) - std::log1p(square / precision))
                                        : 0.0);
    if (visible > kInvisible && logs.back() > best) {
      best = logs.back();
      out.amplitude = pull / (square + precision);
      out.amplitude_sd = 1 / std::sqrt(square + precision);
    }
  }
  out.log = log_sum(logs) - std::log(static_cast<double>(logs.size()));
  return out;
}

// Between the neighbours on the grid, by as much finer as the readings tell shapes apart.
void refine(FormFit& fit, const Curve& curve, double from, double to,
            const std::function<Weighed(const Shape&)>& weighed) {
  constexpr int kFiner = 40, kTimes = 2;
  if (fit.form == Form::step || curve.periodic || !(to > from)) return;
  for (int time = 0; time < kTimes; ++time) {
    std::vector<double> shapes, logs;
    std::vector<Weighed> all_weighed;
    double best = -std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kFiner; ++i) {
      shapes.push_back(from + (to - from) * i / kFiner);
      const Weighed one = weighed({shapes.back(), fit.phase_rad});
      all_weighed.push_back(one);
      logs.push_back(one.log);
      if (one.log > best) {
        best = one.log;
        fit.shape = shapes.back(), fit.amplitude = one.amplitude;
      }
    }
    const double all = log_sum(logs);
    double below = 0, variance = 0;  // of the amplitude, over the shapes too
    for (int i = 0; i <= kFiner; ++i) {
      const Weighed& one = all_weighed[static_cast<std::size_t>(i)];
      const double off = one.amplitude - fit.amplitude;
      variance += std::exp(one.log - all) * (one.amplitude_sd * one.amplitude_sd + off * off);
      if (below <= 0.025) fit.shape_low = shapes[static_cast<std::size_t>(i)];
      if (below < 0.975) fit.shape_high = shapes[static_cast<std::size_t>(i)];
      below += std::exp(logs[static_cast<std::size_t>(i)] - all);
    }
    fit.amplitude_sd = std::sqrt(variance);
    fit.shape_low = std::min(fit.shape_low, fit.shape);  // a mode at the end of the range may lie outside equal tails
    fit.shape_high = std::max(fit.shape_high, fit.shape);
    const double step = (to - from) / kFiner;
    from = std::max(from, fit.shape_low - 2 * step);
    to = std::min(to, fit.shape_high + 2 * step);
  }
}

}  // namespace

std::string_view name_of(Form form) {
  switch (form) {
    case Form::step:
      return "step";
    case Form::ramp:
      return "ramp";
    case Form::power:
      return "power";
    case Form::exponential:
      return "exponential";
    case Form::saturation:
      return "saturation";
    case Form::sinusoid:
      return "sinusoid";
  }
  return "";
}

// A sinusoid alone goes round a circle.
std::vector<double> shape_grid(Form form, const Curve& curve) {
  std::vector<double> out;
  const double low = curve.at.front(), range = range_of(curve);
  const auto shares = [&](std::initializer_list<double> all, double from, double by) {
    for (const double share : all) out.push_back(from + by * share);
  };
  if (curve.periodic && form != Form::sinusoid) return out;
  switch (form) {
    case Form::step:  // between the places, and not before the first
      for (std::size_t i = 1; i < curve.at.size(); ++i) out.push_back(0.5 * (curve.at[i - 1] + curve.at[i]));
      break;
    case Form::ramp:
      shares({0, 0.15, 0.3, 0.45, 0.6, 0.75}, low, range);
      break;
    case Form::power:
      out = {0.5, 1.5, 2, 3};
      break;
    case Form::exponential:
    case Form::saturation:
      shares({0.1, 0.14, 0.2, 0.28, 0.4, 0.56, 0.8}, 0, range);
      break;
    case Form::sinusoid:
      for (const double periods : {0.75, 1.0, 1.33, 1.67, 2.0, 2.5}) {
        const bool whole = periods == 1 || periods == 2;
        if (curve.periodic && !whole) continue;  // it has to close
        out.push_back((curve.periodic ? 2 * std::numbers::pi : range) / periods);
      }
      break;
  }
  return out;
}

double value_of(Form form, const Curve& curve, double shape, double phase_rad, double x) {
  const double along = std::max(0.0, x - curve.at.front());
  switch (form) {
    case Form::step:
      return x >= shape ? 1 : 0;
    case Form::ramp:
      return std::max(0.0, x - shape) / range_of(curve);
    case Form::power:
      return std::pow(along / range_of(curve), shape);
    case Form::exponential:
      return std::exp(-along / shape);
    case Form::saturation:
      return 1 - std::exp(-along / shape);
    case Form::sinusoid:
      return std::sin(2 * std::numbers::pi * x / shape + phase_rad);
  }
  return 0;
}

std::vector<FormFit> fit_forms(const System& system, const Discrepancy& discrepancy, const Marginal& beside) {
  std::vector<FormFit> out;
  if (!beside.valid()) return out;
  const auto likelihoods = discrepancy.added(beside);
  for (std::size_t k = 0; k < likelihoods.size(); ++k) {
    const Curve& curve = system.curves()[k];
    for (const Form form : {Form::step, Form::ramp, Form::power, Form::exponential, Form::saturation, Form::sinusoid}) {
      const auto weighed = [&](const Shape& shape) {
        VectorXd f(static_cast<Index>(curve.at.size()));
        for (Index i = 0; i < f.size(); ++i)
          f[i] = value_of(form, curve, shape.value, shape.phase_rad, curve.at[static_cast<std::size_t>(i)]);
        return weigh(f, discrepancy.visible_size(k, f), likelihoods[k]);
      };
      FormFit one{.curve = k, .form = form};
      const auto shapes = shapes_of(form, curve);
      if (shapes.empty()) continue;
      std::vector<double> logs;
      std::size_t best = 0;
      for (const Shape& shape : shapes) {
        logs.push_back(weighed(shape).log);
        if (logs.back() > logs[best]) best = logs.size() - 1;
      }
      one.log_bayes_factor = log_sum(logs) - std::log(static_cast<double>(logs.size()));
      const Weighed likeliest = weighed(shapes[best]);
      one.amplitude = likeliest.amplitude, one.amplitude_sd = likeliest.amplitude_sd;
      one.shape = one.shape_low = one.shape_high = shapes[best].value;
      one.phase_rad = shapes[best].phase_rad;
      double from = one.shape, to = one.shape;
      for (const Shape& shape : shapes) {
        if (shape.value < one.shape && (from == one.shape || shape.value > from)) from = shape.value;
        if (shape.value > one.shape && (to == one.shape || shape.value < to)) to = shape.value;
      }
      refine(one, curve, from, to, weighed);
      out.push_back(one);
    }
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const auto& a, const auto& b) { return a.log_bayes_factor > b.log_bayes_factor; });
  return out;
}

double log_bayes_factor(const std::vector<FormFit>& forms) {
  std::vector<double> logs;
  for (const FormFit& one : forms) logs.push_back(one.log_bayes_factor);
  return log_sum(logs) - std::log(static_cast<double>(logs.size()));
}

double log_bayes_factor(const std::vector<CurveFactor>& curves) {
  std::vector<double> logs;
  for (const CurveFactor& one : curves) logs.push_back(one.log_bayes_factor);
  return log_sum(logs) - std::log(static_cast<double>(logs.size()));
}

}  // namespace bevel::inference
