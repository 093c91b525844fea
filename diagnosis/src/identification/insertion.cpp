// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/identification/insertion.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <bevel/error.hpp>

namespace bevel::diagnosis {
namespace {

constexpr double kMaxLeg_mm = 5.0;
constexpr double kMaxLeg_rad = 0.25;
constexpr double kProportional_rad = 1e-3;  // roll may leave the straight line by this much within one leg
constexpr double kStill = 1e-9;             // mm and rad

// Axis positions at one moment, and the measurement taken then, if any.
struct Waypoint {
  double insertion_mm;
  double rotation_rad;
  std::optional<std::size_t> measurement;
};

Waypoint at(const model::ActuatorState& a) { return {std::max(a.insertion_mm, 0.0), a.rotation_rad, std::nullopt}; }

// The actuators' samples with the measurements' moments put in between.
std::vector<Waypoint> merge(const std::vector<model::ActuatorState>& actuators,
                            const std::vector<model::TipMeasurement>& measurements, std::size_t& skipped) {
  std::vector<Waypoint> way;
  std::size_t next = 0;
  const auto usable = [](const model::TipMeasurement& m) { return m.status == 0; };
  for (; next < measurements.size() && measurements[next].utime < actuators.front().utime; ++next) ++skipped;
  for (std::size_t i = 0; i < actuators.size(); ++i) {
    const auto& b = actuators[i];
    if (i > 0) {
      const auto& a = actuators[i - 1];
      if (b.utime < a.utime) throw ArgumentError("actuator samples run backwards in time");
      for (; next < measurements.size() && measurements[next].utime < b.utime; ++next) {
        const double t =
            static_cast<double>(measurements[next].utime - a.utime) / static_cast<double>(b.utime - a.utime);
        const double insertion_mm = a.insertion_mm + t * (b.insertion_mm - a.insertion_mm);
        if (!usable(measurements[next]) || insertion_mm < 0) {
          ++skipped;
          continue;
        }
        way.push_back({insertion_mm, a.rotation_rad + t * (b.rotation_rad - a.rotation_rad), next});
      }
    }
    way.push_back(at(b));
    for (; next < measurements.size() && measurements[next].utime == b.utime; ++next) {
      if (!usable(measurements[next]) || b.insertion_mm < 0) {
        ++skipped;
        continue;
      }
      way.push_back(at(b));
      way.back().measurement = next;
    }
  }
  skipped += measurements.size() - next;
  return way;
}

// Whether waypoints first..last can be one leg.
bool proportional(const std::vector<Waypoint>& way, std::size_t first, std::size_t last) {
  const double ds = way[last].insertion_mm - way[first].insertion_mm;
  const double dphi = way[last].rotation_rad - way[first].rotation_rad;
  if (std::abs(ds) > kMaxLeg_mm || std::abs(dphi) > kMaxLeg_rad) return false;
  const bool by_insertion = std::abs(ds) > kStill;
  double previous = 0;
  for (std::size_t i = first + 1; i <= last; ++i) {
    const double s = way[i].insertion_mm - way[first].insertion_mm;
    const double phi = way[i].rotation_rad - way[first].rotation_rad;
    const double along = by_insertion ? s / ds : (std::abs(dphi) > kStill ? phi / dphi : 0);
    if (along < previous - 1e-12 || along > 1 + 1e-12) return false;
    if (std::abs(phi - along * dphi) > kProportional_rad || std::abs(s - along * ds) > kStill) return false;
    previous = along;
  }
  return true;
}

}  // namespace

int whiten(const Eigen::Matrix3d& information_per_mm2, Eigen::Matrix3d& whitening) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information_per_mm2);
  whitening.setZero();
  int rank = 0;
  for (int i = 2; i >= 0; --i) {
    const double value = eigen.eigenvalues()(i);
    if (!(value > 1e-9 * eigen.eigenvalues()(2)) || !(value > 0)) break;
    whitening.row(rank++) = std::sqrt(value) * eigen.eigenvectors().col(i).transpose();
  }
  return rank;
}

double roll_range_rad(const Insertion& insertion) {
  double roll_rad = 0;
  double least_rad = std::numeric_limits<double>::infinity(), most_rad = -least_rad;
  for (const Leg& leg : insertion.legs) {
    const double before_rad = roll_rad;
    roll_rad += leg.rotation_rad;
    if (leg.insertion_mm == 0) continue;
    least_rad = std::min({least_rad, before_rad, roll_rad});
    most_rad = std::max({most_rad, before_rad, roll_rad});
  }
  return std::max(most_rad - least_rad, 0.0);
}

Insertion make_insertion(std::string name, const std::vector<model::ActuatorState>& actuators,
                         const std::vector<model::TipMeasurement>& measurements) {
  if (actuators.size() < 2)
    throw ArgumentError(name + ": " + std::to_string(actuators.size()) +
                        " actuator samples; an insertion has at least 2");
  Insertion out;
  out.name = std::move(name);
  std::vector<Waypoint> way = merge(actuators, measurements, out.skipped);
  // The pose is known at the entry point only: from there to the first sample the shaft is taken to have gone straight
  // to its roll and then in. Whole turns on the way there change nothing: an axis may have turned for days before.
  const double roll_rad = way.front().rotation_rad;
  const double turns_rad = roll_rad - std::remainder(roll_rad, 2 * std::numbers::pi);
  way.insert(way.begin(), {{0, turns_rad, std::nullopt}, {0, roll_rad, std::nullopt}});

  for (std::size_t first = 0; first + 1 < way.size();) {
    std::size_t last = first + 1;
    while (last + 1 < way.size() && proportional(way, first, last + 1)) ++last;
    const Leg leg{way[last].insertion_mm - way[first].insertion_mm, way[last].rotation_rad - way[first].rotation_rad};
    const std::size_t parts = std::max({1.0, std::ceil(std::abs(leg.insertion_mm) / kMaxLeg_mm - 1e-9),
                                        std::ceil(std::abs(leg.rotation_rad) / kMaxLeg_rad - 1e-9)});
    const double n = static_cast<double>(parts);
    const bool by_insertion = std::abs(leg.insertion_mm) > kStill;
    const bool by_rotation = !by_insertion && std::abs(leg.rotation_rad) > kStill;
    for (std::size_t i = first + 1; i <= last; ++i) {
      if (!way[i].measurement) continue;
      const auto& m = measurements[*way[i].measurement];
      double along = 1;
      if (by_insertion) along = (way[i].insertion_mm - way[first].insertion_mm) / leg.insertion_mm;
      if (by_rotation) along = (way[i].rotation_rad - way[first].rotation_rad) / leg.rotation_rad;
      const double place = std::clamp(along, 0.0, 1.0) * n;
      const std::size_t part = std::min(static_cast<std::size_t>(place), parts - 1);
      Observation seen;
      seen.utime = m.utime;
      seen.insertion_mm = way[i].insertion_mm;
      seen.leg = out.legs.size() + part;
      seen.fraction = place - static_cast<double>(part);
      seen.position_mm = m.position_mm;
      seen.rank = whiten(m.information_per_mm2, seen.whitening);
      if (seen.rank > 0)
        out.observations.push_back(seen);
      else
        ++out.skipped;
    }
    if (by_insertion || by_rotation)
      out.legs.insert(out.legs.end(), parts, Leg{leg.insertion_mm / n, leg.rotation_rad / n});
    else  // no motion: what was seen belongs to the end of the leg before
      for (auto o = out.observations.rbegin(); o != out.observations.rend() && o->leg == out.legs.size(); ++o) {
        o->leg = out.legs.empty() ? 0 : out.legs.size() - 1;
        o->fraction = out.legs.empty() ? 0 : 1;
      }
    first = last;
  }
  if (out.observations.empty())
    throw ArgumentError(out.name + ": none of its " + std::to_string(measurements.size()) +
                        " tip measurements is usable; wanted are status 0, an information matrix that is not "
                        "zero, and a time within the actuators'");
  if (out.legs.empty()) out.legs.push_back({0, 0});
  return out;
}

}  // namespace bevel::diagnosis
