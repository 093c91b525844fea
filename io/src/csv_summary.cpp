// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include <bevel/io/csv_import.hpp>

namespace bevel::io {
namespace {

struct Extent {
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  void add(double value) { lowest = std::min(lowest, value), highest = std::max(highest, value); }
  bool empty() const { return lowest > highest; }
};

template <class... Arguments>
std::string text(const char* format, Arguments... arguments) {
  std::array<char, 400> buffer;
  std::snprintf(buffer.data(), buffer.size(), format, arguments...);
  return buffer.data();
}

template <class Sample>
double seconds(const std::vector<Sample>& samples) {
  return samples.empty() ? 0 : static_cast<double>(samples.back().utime - samples.front().utime) * 1e-6;
}

template <class Sample>
std::string rate(const std::vector<Sample>& samples, bool has_clock) {
  std::string out = text("%zu readings", samples.size());
  const double span_s = seconds(samples);
  if (has_clock && span_s > 0) out += text(", %.4g a second", static_cast<double>(samples.size() - 1) / span_s);
  return out;
}

std::string base_lines(const ImportedRecording& r) {
  Extent depth_mm, angle_rad;
  double fastest_mm_s = 0, fastest_rad_s = 0, turned_rad = 0, gap_s = 0, step_mm = 0;
  for (std::size_t i = 0; i < r.actuators.size(); ++i) {
    const model::ActuatorState& a = r.actuators[i];
    depth_mm.add(a.insertion_mm);
    angle_rad.add(a.rotation_rad);
    fastest_mm_s = std::max(fastest_mm_s, std::abs(a.insertion_rate_mm_s));
    fastest_rad_s = std::max(fastest_rad_s, std::abs(a.rotation_rate_rad_s));
    if (i == 0) continue;
    const model::ActuatorState& before = r.actuators[i - 1];
    turned_rad += std::abs(a.rotation_rad - before.rotation_rad);
    gap_s = std::max(gap_s, static_cast<double>(a.utime - before.utime) * 1e-6);
    step_mm = std::max(step_mm, std::abs(a.insertion_mm - before.insertion_mm));
  }
  std::string out = "  base     " + rate(r.actuators, r.has_clock);
  if (r.has_clock) out += text("; longest gap %.4g s, longest step %.4g mm", gap_s, step_mm);
  out += text("\n  depth    %.4g to %.4g mm", depth_mm.lowest, depth_mm.highest);
  if (r.has_clock) out += text(", fastest %.4g mm/s", fastest_mm_s);
  // A tenth of a millimetre, in all readings alike, is more than their noise leaves open.
  if (std::abs(r.actuators.front().insertion_mm) > 0.01)
    out += text("; begins at %.4g mm, not at 0: that is taken for the entry point", r.actuators.front().insertion_mm);
  out += text("\n  turning  %.4g rad in all (%.4g turns), from %.4g to %.4g rad", turned_rad,
              turned_rad / (2 * std::numbers::pi), angle_rad.lowest, angle_rad.highest);
  if (r.has_clock) out += text(", fastest %.4g rad/s", fastest_rad_s);
  return out + "\n";
}

std::string tip_line(const ImportedRecording& r) {
  std::string out = "  tip      " + rate(r.tips, r.has_clock);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    Extent extent_mm;
    std::size_t seen = 0;
    for (const model::TipMeasurement& tip : r.tips) {
      if (!(tip.information_per_mm2(axis, axis) > 0)) continue;
      extent_mm.add(tip.position_mm[axis] + 0.0);  // -0 is 0
      ++seen;
    }
    const char name = "xyz"[axis];
    if (extent_mm.empty()) {
      out += text("; %c not measured", name);
      continue;
    }
    out += text("; %c %.4g to %.4g mm", name, extent_mm.lowest, extent_mm.highest);
    if (seen < r.tips.size()) out += text(" (in %zu of them)", seen);
  }
  return out + "\n";
}

std::string heading_line(const ImportedRecording& r) {
  if (r.headings.empty()) return "";
  double farthest_rad = 0;
  for (const model::TipHeading& m : r.headings)
    farthest_rad = std::max(farthest_rad, std::acos(std::clamp(m.heading.dot(r.headings.front().heading), -1.0, 1.0)));
  return "  heading  " + rate(r.headings, r.has_clock) +
         text("; up to %.3g rad from the first, which is (%.3g, %.3g, %.3g)\n", farthest_rad,
              r.headings.front().heading.x(), r.headings.front().heading.y(), r.headings.front().heading.z());
}

std::string frame_line(const ImportedRecording& r) {
  if (!r.frame) return "";
  const EntryFrame& f = *r.frame;
  const Eigen::Vector3d z = f.to_A.conjugate() * Eigen::Vector3d::UnitZ();
  return text(
             "  frame    by an arc through %zu tips: z of {A} is (%.4f, %.4f, %.4f) of tip.axes, +- %.2g rad; origin "
             "(%.4g, "
             "%.4g, %.4g) mm, +- %.2g mm\n",
             f.tips, z.x(), z.y(), z.z(), f.direction_sd_rad, f.origin_mm.x(), f.origin_mm.y(), f.origin_mm.z(),
             f.origin_sd_mm) +
         text(
             "           radius %.4g mm, %.4g mm of path per mm of insertion, rms error %.2g mm per axis; the roll "
             "about z is "
             "that of tip.axes\n",
             f.radius_mm, f.scale, f.rms_mm);
}

std::string lag_line(const ImportedRecording& r) {
  if (!r.lag) return "";
  const BaseLag& lag = *r.lag;
  const std::string value = text("%.2f +- %.2f s", lag.lag_s, lag.sd_s);
  if (!lag.determined) return "  lag      of the base relative to the tip: not determined by this motion\n";
  if (!lag.significant()) return "  lag      of the base relative to the tip: " + value + ", consistent with none\n";
  return "  lag      of the base relative to the tip: " + value +
         "; not corrected. To correct it, put into the map: " + r.lag_setting + "\n";
}

}  // namespace

std::string summary(const ImportedRecording& r) {
  std::string out = text("  rows     %d, %d without data, %d between steps, %d left out", r.rows, r.rows_without_data,
                         r.rows_unsettled, r.rows_implausible);
  if (r.base_rows > 0) out += text("; %d of the base", r.base_rows);
  out += "; " + r.format + "\n  time     ";
  out += r.has_clock ? text("%.6g s", seconds(r.actuators)) : "no clock: the order of stops alone";
  out += "\n" + base_lines(r);
  for (const std::string& held : r.held) out += "  held     " + held + "\n";
  return out + tip_line(r) + heading_line(r) + frame_line(r) + lag_line(r);
}

}  // namespace bevel::io
