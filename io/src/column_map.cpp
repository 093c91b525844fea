// SPDX-License-Identifier: MIT
#include <bevel/io/column_map.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

namespace bevel::io {
namespace {

const Choices<double> kLengths_mm = {{"mm", 1}, {"cm", 10}, {"m", 1000}, {"um", 1e-3}, {"in", 25.4}};
const Choices<double> kAngles_rad = {{"rad", 1}, {"deg", std::numbers::pi / 180}, {"rev", 2 * std::numbers::pi}};
const Choices<double> kTimes_us = {{"s", 1e6}, {"ms", 1e3}, {"us", 1}, {"ns", 1e-3}};

SignedColumn signed_column(const std::string& text) {
  if (text.starts_with('-')) return {text.substr(1), -1};
  if (text.starts_with('+')) return {text.substr(1), 1};
  return {text, 1};
}

std::vector<SignedColumn> read_three(Section& section, const char* key, Presence presence) {
  std::vector<std::string> names;
  section.read(key, names, presence, in_range(3, 3));
  std::vector<SignedColumn> columns;
  if (names.size() != 3) return columns;
  for (const std::string& name : names) columns.push_back(signed_column(name));
  return columns;
}

TimeColumn read_time(Section& section) {
  TimeColumn time;
  std::string seconds, column;
  section.read("seconds", seconds, optional);
  section.read("nanoseconds", time.nanoseconds, optional);
  section.read("column", column, optional);
  section.read("unit", time.us_per_unit, column.empty() ? optional : required, kTimes_us);
  section.read("rate_hz", time.rate_hz, optional, in_range(1e-3, 1e6));
  section.read("offset_s", time.offset_s, optional, in_range(-1e10, 1e10));
  time.column = seconds.empty() ? column : seconds;
  if (!section.present()) return time;
  if ((seconds.empty() ? 0 : 1) + (column.empty() ? 0 : 1) + (time.rate_hz == 0 ? 0 : 1) != 1)
    section.fail("", "one of seconds (a column), column with its unit, or rate_hz must be given, and one only");
  if (column.empty() && section.has("unit"))
    section.fail("unit", "is given without column; seconds has its unit in its name");
  if (!time.nanoseconds.empty() && seconds.empty())
    section.fail("nanoseconds", "is given without seconds, to which it is added");
  return time;
}

// "+z" to its axis and sign; anything else is a fault.
bool read_axis(const std::string& text, std::size_t& axis, double& sign) {
  const SignedColumn named = signed_column(text);
  const std::size_t found = named.name.size() == 1 ? std::string("xyz").find(named.name) : std::string::npos;
  if (found == std::string::npos) return false;
  axis = found;
  sign = named.sign;
  return true;
}

// Of the matrix whose rows are the named axes; 0 if one is named twice.
double handedness(const QuaternionColumns& q) {
  const auto [a, b, c] = q.axis;
  if (a == b || b == c || a == c) return 0;
  const bool even = (b + 3 - a) % 3 == 1;  // xyz, yzx, zxy
  return (even ? 1 : -1) * q.sign[0] * q.sign[1] * q.sign[2];
}

std::optional<QuaternionColumns> read_quaternion(Section section) {
  if (!section.present()) return std::nullopt;
  QuaternionColumns q;
  std::vector<std::string> columns, axes;
  std::string along;
  section.read("columns", columns, required, in_range(4, 4));
  section.read("along", along, required);
  section.read("axes", axes, required, in_range(3, 3));
  if (columns.size() == 4) std::copy(columns.begin(), columns.end(), q.wxyz.begin());
  if (!along.empty() && !read_axis(along, q.along, q.along_sign))
    section.fail("along", "is '" + along + "'; allowed: x, y or z, with a sign");
  if (axes.size() != 3) return q;
  for (std::size_t i = 0; i < 3; ++i)
    if (!read_axis(axes[i], q.axis[i], q.sign[i])) {
      section.fail("axes", "has '" + axes[i] + "'; allowed: x, y or z, with a sign");
      return q;
    }
  if (handedness(q) != 1)
    section.fail("axes", handedness(q) == 0 ? "names an axis twice" : "is a left-handed frame; {A} is right-handed");
  return q;
}

/// Reads [tip.transform]: a rotation matrix or a quaternion, and a translation.
std::optional<TipTransform> read_transform(Section section) {
  if (!section.present()) return std::nullopt;
  constexpr double kOrthonormalWithin = 1e-3;  // matrices are written with three digits or more
  TipTransform transform;
  const bool has_matrix = section.has("rotation"), has_quaternion = section.has("quaternion");
  std::array<double, 9> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 4> wxyz{1, 0, 0, 0};
  std::array<double, 3> translation_mm{};
  section.read("rotation", matrix, optional, in_range(-1 - kOrthonormalWithin, 1 + kOrthonormalWithin));
  section.read("quaternion", wxyz, optional, in_range(-1 - kOrthonormalWithin, 1 + kOrthonormalWithin));
  section.read("translation_mm", translation_mm, optional, in_range(-1e5, 1e5));
  transform.translation_mm = Eigen::Map<const Eigen::Vector3d>(translation_mm.data());
  if (has_matrix && has_quaternion)
    section.fail("rotation", "is given in addition to quaternion; allowed: one of them");
  if (!has_matrix && !has_quaternion && !section.has("translation_mm"))
    section.fail("", "is empty; allowed: rotation (9 numbers) or quaternion (w, x, y, z), and translation_mm");
  if (has_quaternion) {
    const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    if (!(std::abs(q.norm() - 1) <= kOrthonormalWithin)) {
      section.fail("quaternion", "has the length " + format_number(q.norm()) + "; allowed: 1 within 0.001");
      return transform;
    }
    transform.rotation = q.normalized().toRotationMatrix();
  }
  if (has_matrix) {
    const Eigen::Matrix3d given = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(matrix.data());
    const double error = (given * given.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(error <= 2 * kOrthonormalWithin))
      section.fail("rotation", "is no rotation: its rows are off length 1 or right angles by " + format_number(error) +
                                   "; allowed 0.002. Give 9 numbers, row by row, without a scale");
    else if (given.determinant() < 0)
      section.fail("rotation", "is a reflection (determinant -1); allowed: a rotation. One axis has the wrong sign");
    else
      transform.rotation = Eigen::Quaterniond(given).normalized().toRotationMatrix();
  }
  return transform;
}

void read_tip(ConfigFile& file, ColumnMap& map) {
  Section tip = file.section("tip", required);
  const auto axes = read_three(tip, "axes", required);
  if (axes.size() == 3) std::copy(axes.begin(), axes.end(), map.tip.begin());
  tip.read("unit", map.mm_per_tip_unit, required, kLengths_mm);
  map.origin = read_three(tip, "origin", optional);
  tip.read("sigma_mm", map.sigma_mm, required, at_least(0));
  for (const double sigma_mm : map.sigma_mm)  // whose information is still a number that readers accept
    if (sigma_mm != 0 && !(sigma_mm >= 1e-6 && sigma_mm <= 1e6))
      tip.fail("sigma_mm", "is " + format_number(sigma_mm) + " for an axis; allowed are 0, or 1e-06 to 1e+06");
  map.heading = read_three(tip, "heading", optional);
  map.quaternion = read_quaternion(tip.section("quaternion", optional));
  tip.read("frame", map.frame, optional,
           Choices<TipFrame>{{"axes", TipFrame::axes}, {"from-straight-insertion", TipFrame::from_straight_insertion}});
  map.transform = read_transform(tip.section("transform", optional));
  if (map.transform && map.frame != TipFrame::axes)
    tip.fail("frame", "is from-straight-insertion, and [tip.transform] is given; allowed: one of them");
  if (map.needs_all_axes() && std::ranges::any_of(map.sigma_mm, [](double sigma_mm) { return !(sigma_mm > 0); }))
    tip.fail("sigma_mm", "is 0 for an axis; with a transform or an estimated frame all three axes must be measured");
  if (!map.heading.empty() && map.quaternion) tip.fail("heading", "is given beside a quaternion; one of them");
  tip.read("heading_sd_rad", map.heading_sd_rad, map.has_heading() ? required : optional, in_range(1e-5, 1));
}

void read_axes(ConfigFile& file, ColumnMap& map) {
  Section insertion = file.section("insertion", required);
  std::string column;
  insertion.read("column", column, required);
  map.insertion = signed_column(column);
  insertion.read("unit", map.mm_per_insertion_unit, required, kLengths_mm);
  insertion.read("offset_mm", map.insertion_offset_mm, optional, in_range(-1e5, 1e5));
  insertion.read("settled", map.settled, optional);
  insertion.read("stops", map.stops, optional);
  if (map.settled && map.stops) insertion.fail("settled", "is given beside stops; one of them");
  Section rotation = file.section("rotation", optional);
  if (!rotation.present()) return;
  double gear = 1;
  column.clear();
  rotation.read("column", column, required);
  rotation.read("unit", map.rad_per_rotation_unit, required, kAngles_rad);
  rotation.read("scale", gear, optional);
  map.rad_per_rotation_unit *= gear;
  if (!column.empty()) map.rotation.push_back(signed_column(column));
}

}  // namespace

const char* TimeColumn::unit() const {
  const auto found = std::ranges::find(kTimes_us, us_per_unit, &std::pair<std::string, double>::second);
  return found == kTimes_us.end() ? "s" : found->first.c_str();
}

ColumnMap load_column_map(const std::string& path) {
  ConfigFile file = ConfigFile::load(path);
  ColumnMap map;
  read_tip(file, map);
  read_axes(file, map);
  Section time = file.section("time", map.stops ? optional : required);
  map.time = read_time(time);
  if (map.stops && time.present())
    time.fail("", "is given, but insertion.stops = true makes a log without a clock; leave one out");
  Section base = file.section("base", optional);
  if (base.present()) {
    base.read("offset_s", map.base_offset_s, optional, in_range(-1e10, 1e10));
    Section base_time = base.section("time", base.has("offset_s") ? optional : required);
    if (base_time.present()) map.base_time = read_time(base_time);
    if (base_time.present() && base.has("offset_s"))
      base.fail("offset_s", "is given in addition to [base.time]; give it there");
    if (!map.has_clock())
      base.fail("", "is given, but a stepwise insertion (settled, stops) has base and tip in the same rows");
  }
  Section rows = file.section("rows", optional);
  rows.read("nonzero", map.nonzero, optional);
  rows.read("unseen", map.unseen, optional);
  file.finish();
  return map;
}

}  // namespace bevel::io
