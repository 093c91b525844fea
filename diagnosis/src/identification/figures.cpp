// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/identification/figures.hpp>

#include <cmath>
#include <limits>

#include <bevel/error.hpp>

namespace bevel::diagnosis {
namespace {

// The model's lateral position where it first reaches depth z, from the ends of its legs; beyond the last it goes on
// along its heading, so that a path that is a little short still has an answer.
double lateral_at_depth(const std::vector<Path::Node>& nodes, double z_mm) {
  const auto& last = nodes.back().pose;
  if (z_mm > last.p_mm.z()) {
    const Eigen::Vector3d heading = last.R.col(2);
    const double beyond_mm = (z_mm - last.p_mm.z()) / heading.z();
    if (!(heading.z() > 0.1) || beyond_mm > 10) return std::numeric_limits<double>::quiet_NaN();
    return last.p_mm.y() + beyond_mm * heading.y();
  }
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const double z0 = nodes[i].pose.p_mm.z();
    const double z1 = nodes[i + 1].pose.p_mm.z();
    if (!(z0 <= z_mm && z_mm <= z1) || z1 == z0) continue;
    // Newton on the leg's cubic in z, which is nearly linear.
    const auto value = [&](int axis, double t) {
      const double t2 = t * t;
      const double t3 = t2 * t;
      return (2 * t3 - 3 * t2 + 1) * nodes[i].pose.p_mm(axis) + (t3 - 2 * t2 + t) * nodes[i].velocity_mm(axis) +
             (3 * t2 - 2 * t3) * nodes[i + 1].pose.p_mm(axis) + (t3 - t2) * nodes[i + 1].arrival_mm(axis);
    };
    double t = (z_mm - z0) / (z1 - z0);
    for (int k = 0; k < 3; ++k) t -= (value(2, t) - z_mm) / (z1 - z0);
    return value(1, t);
  }
  return nodes.front().pose.p_mm.y();  // seen before the entry, by noise
}

}  // namespace

std::vector<double> path_errors_mm(const Insertion& insertion, const model::NeedleParameters& needle, Compare compare,
                                   const Entry& entry) {
  Path path;
  if (!integrate(insertion, needle, entry, false, path))
    throw DomainError(insertion.name + ": with these parameters the tip leaves the domain of the slip law, (25)");
  std::vector<double> errors;
  for (std::size_t i = 0; i < insertion.observations.size(); ++i) {
    const Observation& o = insertion.observations[i];
    if (compare == Compare::same_depth) {
      errors.push_back(lateral_at_depth(path.nodes, o.position_mm.z()) - o.position_mm.y());
      continue;
    }
    Eigen::Matrix3d seen_axes = Eigen::Matrix3d::Zero();
    for (int r = 0; r < o.rank; ++r) {
      const Eigen::Vector3d axis = o.whitening.row(r).normalized();
      seen_axes += axis * axis.transpose();
    }
    errors.push_back((seen_axes * (path.position_mm[i] - o.position_mm)).norm());
  }
  return errors;
}

ErrorFigures summarise(const Insertion& insertion, const std::vector<double>& errors_mm) {
  ErrorFigures f;
  double squares = 0;
  for (std::size_t i = 0; i < errors_mm.size(); ++i) {
    if (std::isnan(errors_mm[i])) continue;
    squares += errors_mm[i] * errors_mm[i];
    ++f.count;
    if (std::abs(errors_mm[i]) <= f.largest_mm) continue;
    f.largest_mm = std::abs(errors_mm[i]);
    f.largest_at_mm = insertion.observations[i].insertion_mm;
  }
  f.rms_mm = f.count > 0 ? std::sqrt(squares / static_cast<double>(f.count)) : 0;
  return f;
}

ErrorFigures error_figures(const std::vector<Insertion>& insertions, const model::NeedleParameters& needle,
                           Compare compare, const std::vector<Entry>& entries) {
  ErrorFigures all;
  double squares = 0;
  for (std::size_t i = 0; i < insertions.size(); ++i) {
    const Entry entry = i < entries.size() ? entries[i] : Entry(Entry::Zero());
    const auto f = summarise(insertions[i], path_errors_mm(insertions[i], needle, compare, entry));
    squares += f.rms_mm * f.rms_mm * static_cast<double>(f.count);
    all.count += f.count;
    if (f.largest_mm > all.largest_mm) {
      all.largest_mm = f.largest_mm;
      all.largest_at_mm = f.largest_at_mm;
    }
  }
  all.rms_mm = all.count > 0 ? std::sqrt(squares / static_cast<double>(all.count)) : 0;
  return all;
}

Insertion mean_of_trials(const std::vector<Insertion>& trials) {
  if (trials.empty()) throw ArgumentError("the mean of no trials");
  Insertion mean = trials.front();
  mean.name = "mean of " + std::to_string(trials.size()) + " trials";
  for (std::size_t k = 1; k < trials.size(); ++k) {
    if (trials[k].observations.size() != mean.observations.size())
      throw ArgumentError(trials[k].name + " has " + std::to_string(trials[k].observations.size()) +
                          " measurements and " + trials[0].name + " has " + std::to_string(mean.observations.size()) +
                          ": their mean wants the same number");
    for (std::size_t i = 0; i < mean.observations.size(); ++i)
      mean.observations[i].position_mm += trials[k].observations[i].position_mm;
  }
  for (auto& o : mean.observations) {
    o.position_mm /= static_cast<double>(trials.size());
    o.whitening *= std::sqrt(static_cast<double>(trials.size()));
  }
  return mean;
}

}  // namespace bevel::diagnosis
