// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/latency/latency_fit.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include <bevel/error.hpp>
#include <bevel/model/effects/open_loop.hpp>

namespace bevel::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kPolynomial = 3;  // c0, c1, c2
constexpr int kFewestReadings = 30;
constexpr double kWithdrawn_mm = 0.1;       // against the deepest so far; less is the noise of an encoder
constexpr double kHalfDifference_s = 5e-3;  // of the derivative: the path is a chain of chords between axis samples

// The tip as the model has it, at each sample of the axes and on straight lines in between.
struct Path {
  std::vector<double> time_s;  // from the first sample, ascending
  std::vector<double> depth_mm;
  std::vector<Eigen::Vector3d> position_mm, heading;
  std::int64_t start_utime = 0;

  struct Point {
    Eigen::Vector3d position_mm, heading;
    double depth_mm;
  };
  // Before the first sample and after the last the base stands.
  Point at(double when_s) const {
    const auto after = std::ranges::lower_bound(time_s, when_s);
    if (after == time_s.begin()) return {position_mm.front(), heading.front(), depth_mm.front()};
    if (after == time_s.end()) return {position_mm.back(), heading.back(), depth_mm.back()};
    const auto i = static_cast<std::size_t>(after - time_s.begin());
    const double share = (when_s - time_s[i - 1]) / (time_s[i] - time_s[i - 1]);
    return {position_mm[i - 1] + share * (position_mm[i] - position_mm[i - 1]), heading[i],
            depth_mm[i - 1] + share * (depth_mm[i] - depth_mm[i - 1])};
  }
};

// In order of time, one of each time, up to the deepest point before the first withdrawal.
std::vector<model::ActuatorState> going_in(std::span<const model::ActuatorState> actuators) {
  std::vector<model::ActuatorState> axes(actuators.begin(), actuators.end());
  std::ranges::stable_sort(axes, {}, &model::ActuatorState::utime);
  const auto at_once = [](const auto& a, const auto& b) { return a.utime == b.utime; };
  axes.erase(std::unique(axes.begin(), axes.end(), at_once), axes.end());
  std::size_t deepest = 0;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i].insertion_mm >= axes[deepest].insertion_mm) deepest = i;
    if (axes[i].insertion_mm < axes[deepest].insertion_mm - kWithdrawn_mm) {
      axes.resize(deepest + 1);
      break;
    }
  }
  return axes;
}

Path path_of(const model::AugmentedNeedle& needle, const std::vector<model::ActuatorState>& axes) {
  std::vector<std::int64_t> utimes;
  Path path;
  for (const model::ActuatorState& a : axes) {
    utimes.push_back(a.utime);
    path.time_s.push_back(static_cast<double>(a.utime - axes.front().utime) * 1e-6);
    path.depth_mm.push_back(a.insertion_mm);
  }
  model::OpenLoop open_loop;
  if (!model::predict(needle, model::make_motion(axes, utimes), open_loop, true))
    throw DomainError("the model's needle leaves the domain of the slip law (25) along this motion");
  path.position_mm = std::move(open_loop.position_mm);
  path.heading = std::move(open_loop.heading);
  path.start_utime = axes.front().utime;
  return path;
}

// A reading as what it says along the needle.
struct Reading {
  double time_s;
  Eigen::Vector3d position_mm;
  Eigen::Matrix3d seen;            // projector onto the directions that the camera sees
  Eigen::Matrix3d covariance_mm2;  // within those
};

std::vector<Reading> readings_of(std::span<const model::TipMeasurement> tips, const Path& path) {
  std::vector<Reading> readings;
  for (const model::TipMeasurement& m : tips) {
    if (m.status != 0) continue;
    const double time_s = static_cast<double>(m.utime - path.start_utime) * 1e-6;
    if (time_s < path.time_s.front() || time_s > path.time_s.back()) continue;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(m.information_per_mm2);
    const Eigen::Vector3d& information = eigen.eigenvalues();
    if (!(information[2] > 0)) continue;
    Reading r{time_s, m.position_mm, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
    for (int k = 0; k < 3; ++k) {
      if (information[k] < 1e-9 * information[2]) continue;
      const Eigen::Matrix3d onto = eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).transpose();
      r.seen += onto;
      r.covariance_mm2 += onto / information[k];
    }
    readings.push_back(r);
  }
  std::ranges::sort(readings, {}, &Reading::time_s);
  return readings;
}

// Rows of the linear problem at one latency, each divided by its reading's standard deviation.
struct Rows {
  Eigen::MatrixXd design;  // c0, c1, c2, then the latency
  VectorXd error;          // sd
  VectorXd sd_mm;
};

// Lets only what is new in each row stand, for errors that are correlated by rho over `spacing_s`.
void whiten(const std::vector<Reading>& readings, double rho, double spacing_s, Rows& rows) {
  if (rho <= 0) return;
  for (Index i = rows.error.size() - 1; i > 0; --i) {
    const double apart_s =
        readings[static_cast<std::size_t>(i)].time_s - readings[static_cast<std::size_t>(i - 1)].time_s;
    const double r = std::pow(rho, apart_s / spacing_s);
    const double scale = 1 / std::sqrt(1 - std::min(r * r, 0.9999));
    rows.design.row(i) = scale * (rows.design.row(i) - r * rows.design.row(i - 1));
    rows.error[i] = scale * (rows.error[i] - r * rows.error[i - 1]);
  }
}

class Problem {
 public:
  Problem(const Path& path, const std::vector<Reading>& readings, double spacing_s)
      : path_(path), readings_(readings), spacing_s_(spacing_s), deepest_mm_(std::max(1.0, path.depth_mm.back())) {}

  Rows rows(double latency_s, double rho) const {
    const auto n = static_cast<Index>(readings_.size());
    Rows rows{Eigen::MatrixXd(n, kPolynomial + 1), VectorXd(n), VectorXd(n)};
    for (Index i = 0; i < n; ++i) {
      const Reading& r = readings_[static_cast<std::size_t>(i)];
      const double when_s = r.time_s - latency_s;
      const Path::Point p = path_.at(when_s);
      const Eigen::Vector3d along = r.seen * p.heading;
      const double length2 = std::max(along.squaredNorm(), 1e-6);
      rows.sd_mm[i] = std::sqrt(along.dot(r.covariance_mm2 * along)) / length2;
      const auto as_seen = [&](const Eigen::Vector3d& v) { return along.dot(v) / length2 / rows.sd_mm[i]; };
      rows.error[i] = as_seen(r.position_mm - p.position_mm);
      const double depth = p.depth_mm / deepest_mm_;
      rows.design.row(i).head<kPolynomial>() = Eigen::RowVector3d(1, depth, depth * depth) / rows.sd_mm[i];
      rows.design(i, kPolynomial) = -as_seen(path_.at(when_s + kHalfDifference_s).position_mm -
                                             path_.at(when_s - kHalfDifference_s).position_mm) /
                                    (2 * kHalfDifference_s);
    }
    whiten(readings_, rho, spacing_s_, rows);
    return rows;
  }

  // Sum of squares with c0, c1, c2 at their best.
  double profile(double latency_s, double rho) const {
    const Rows r = rows(latency_s, rho);
    const auto polynomial = r.design.leftCols<kPolynomial>();
    const VectorXd c = polynomial.colPivHouseholderQr().solve(r.error);
    return (r.error - polynomial * c).squaredNorm();
  }

  double best_on_grid(double rho) const {
    constexpr double kStep_s = 0.02;
    double best_s = 0, least = std::numeric_limits<double>::infinity();
    const auto steps = std::lround((kLatencyHighest_s - kLatencyLowest_s) / kStep_s);
    for (long i = 0; i <= steps; ++i) {
      const double at_s = kLatencyLowest_s + static_cast<double>(i) * kStep_s;
      if (const double sum = profile(at_s, rho); sum < least) least = sum, best_s = at_s;
    }
    return best_s;
  }

  // From the grid's best on; a step that does not lower the sum is halved.
  double refined(double latency_s, double rho) const {
    double sum = profile(latency_s, rho);
    for (int i = 0; i < 20; ++i) {
      const Rows r = rows(latency_s, rho);
      double step_s = r.design.colPivHouseholderQr().solve(r.error)[kPolynomial];
      step_s = std::clamp(step_s, -0.05, 0.05);
      double next = profile(latency_s + step_s, rho);
      while (next > sum && std::abs(step_s) > 1e-7) step_s /= 2, next = profile(latency_s + step_s, rho);
      if (next > sum) break;
      latency_s += step_s, sum = next;
      if (std::abs(step_s) < 1e-6) break;
    }
    return latency_s;
  }

  // Of the errors of readings that follow each other without a gap, 0 to 0.99.
  double correlation(double latency_s) const {
    const Rows r = rows(latency_s, 0);
    const VectorXd left = r.error - r.design * r.design.colPivHouseholderQr().solve(r.error);
    double both = 0, squares = 0;
    for (Index i = 1; i < left.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (readings_[k].time_s - readings_[k - 1].time_s > 1.5 * spacing_s_) continue;
      both += left[i] * left[i - 1];
      squares += 0.5 * (left[i] * left[i] + left[i - 1] * left[i - 1]);
    }
    return squares > 0 ? std::clamp(both / squares, 0.0, 0.99) : 0;
  }

 private:
  const Path& path_;
  const std::vector<Reading>& readings_;
  double spacing_s_, deepest_mm_;
};

// Where a stretch of readings begins whose errors are taken as independent of those before: in the middle of each rest
// of the axis. Readings where it never rests are cut into stretches of equal number.
std::vector<Index> stretches_of(const std::vector<double>& rates_mm_s, double fastest_mm_s) {
  constexpr double kRest = 0.25;  // of the fastest
  constexpr Index kFewest = 5, kEqual = 10;
  const auto n = static_cast<Index>(rates_mm_s.size());
  std::vector<Index> begins{0};
  for (Index i = 0; i < n;) {
    Index end = i;
    while (end < n && rates_mm_s[static_cast<std::size_t>(end)] < kRest * fastest_mm_s) ++end;
    const bool inside = i > 0 && end < n;
    if (inside && end > i && (i + end) / 2 - begins.back() >= kFewest) begins.push_back((i + end) / 2);
    i = std::max(end, i + 1);
  }
  if (static_cast<Index>(begins.size()) >= kFewest) return begins;
  begins.clear();
  for (Index k = 0; k < kEqual; ++k) begins.push_back(k * n / kEqual);
  return begins;
}

// Standard error of the latency by the jackknife, each stretch left out in turn.
double jackknife_sd_s(const Rows& rows, const std::vector<Index>& begins) {
  using Normal = Eigen::Matrix4d;
  const Normal all = rows.design.transpose() * rows.design;
  const Eigen::Vector4d right = rows.design.transpose() * rows.error;
  const auto groups = static_cast<Index>(begins.size());
  VectorXd without(groups);
  for (Index g = 0; g < groups; ++g) {
    const Index from = begins[static_cast<std::size_t>(g)];
    const Index to = g + 1 < groups ? begins[static_cast<std::size_t>(g + 1)] : rows.error.size();
    const auto design = rows.design.middleRows(from, to - from);
    const Normal rest = all - design.transpose() * design;
    without[g] = rest.ldlt().solve(right - design.transpose() * rows.error.segment(from, to - from))[kPolynomial];
  }
  const double share = static_cast<double>(groups - 1) / static_cast<double>(groups);
  return std::sqrt(share * (without.array() - without.mean()).square().sum());
}

double at_share(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

std::string why_not(const LatencyFit& fit) {
  std::array<char, 400> text{};
  if (!std::isfinite(fit.sd_s) || fit.inflation > 10)
    std::snprintf(text.data(), text.size(),
                  "the rate of insertion, %.2f to %.2f mm/s at the readings, changes too little or too seldom: a delay "
                  "then looks like a wrong depth. Record an insertion that stops and goes: ten stops of half a second "
                  "or more, at the rate of use in between",
                  fit.slowest_mm_s, fit.fastest_mm_s);
  else
    std::snprintf(text.data(), text.size(),
                  "the delay is known to +-%.1f ms (95 %%), wanted are %.0f ms or better: %d readings with errors of "
                  "%.2f mm at up to "
                  "%.2f mm/s are too few, too noisy or too slow. Record more stops, or go in faster between them",
                  1e3 * fit.within_95_s, 1e3 * kLatencyWorst_s, fit.readings, fit.rms_mm, fit.fastest_mm_s);
  return text.data();
}

}  // namespace

LatencyFit fit_latency(const model::AugmentedNeedle& needle, std::span<const model::ActuatorState> actuators,
                       std::span<const model::TipMeasurement> tips) {
  const std::vector<model::ActuatorState> axes = going_in(actuators);
  if (axes.size() < 2)
    throw ArgumentError("fewer than two actuator samples before the first withdrawal: there is no motion");
  const Path path = path_of(needle, axes);
  const std::vector<Reading> readings = readings_of(tips, path);
  LatencyFit fit;
  fit.readings = static_cast<int>(readings.size());
  if (fit.readings < kFewestReadings) {
    fit.refusal = std::to_string(fit.readings) + " usable readings while the needle goes in, at least " +
                  std::to_string(kFewestReadings) + " are needed";
    return fit;
  }
  std::vector<double> spacings_s, rates_mm_s;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (i > 0) spacings_s.push_back(readings[i].time_s - readings[i - 1].time_s);
    rates_mm_s.push_back((path.at(readings[i].time_s + kHalfDifference_s).depth_mm -
                          path.at(readings[i].time_s - kHalfDifference_s).depth_mm) /
                         (2 * kHalfDifference_s));
  }
  fit.spacing_s = std::max(at_share(spacings_s, 0.5), 1e-4);
  fit.slowest_mm_s = at_share(rates_mm_s, 0.05);
  fit.fastest_mm_s = at_share(rates_mm_s, 0.95);

  const Problem problem(path, readings, fit.spacing_s);
  for (int i = 0; i < 4; ++i) {  // the correlation settles at once: the second round rarely moves it
    const double before = fit.correlation;
    fit.latency_s = problem.refined(problem.best_on_grid(fit.correlation), fit.correlation);
    fit.correlation = problem.correlation(fit.latency_s);
    if (std::abs(fit.correlation - before) < 1e-3) break;
  }
  const Rows plain = problem.rows(fit.latency_s, 0);
  const VectorXd c = plain.design.colPivHouseholderQr().solve(plain.error);
  fit.rms_mm = std::sqrt((plain.error - plain.design * c).cwiseProduct(plain.sd_mm).squaredNorm() / fit.readings);
  const Rows rows = problem.rows(fit.latency_s, fit.correlation);
  const std::vector<Index> begins = stretches_of(rates_mm_s, fit.fastest_mm_s);
  fit.stretches = static_cast<int>(begins.size());
  fit.sd_s = jackknife_sd_s(rows, begins);
  const boost::math::students_t student(fit.stretches - 1);
  fit.within_95_s = boost::math::quantile(student, 0.975) * fit.sd_s;
  const Eigen::Matrix4d normal = rows.design.transpose() * rows.design;
  fit.inflation = normal(kPolynomial, kPolynomial) * normal.inverse()(kPolynomial, kPolynomial);
  if (!std::isfinite(fit.sd_s) || !std::isfinite(fit.inflation) || fit.within_95_s > kLatencyWorst_s)
    fit.refusal = why_not(fit);
  else if (fit.latency_s < kLatencyLowest_s + 0.01 || fit.latency_s > kLatencyHighest_s - 0.01)
    fit.refusal = "no delay from " + std::to_string(kLatencyLowest_s) + " to " + std::to_string(kLatencyHighest_s) +
                  " s fits; are the stamps of camera and axes of one clock?";
  return fit;
}

}  // namespace bevel::diagnosis
