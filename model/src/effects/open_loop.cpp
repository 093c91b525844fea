// SPDX-License-Identifier: MIT
#include <bevel/model/effects/open_loop.hpp>

#include <algorithm>

#include <bevel/error.hpp>

namespace bevel::model {
namespace {

constexpr double kLongestLeg_mm = 1.0;
constexpr double kLongestLeg_rad = 0.2;
// A rate that changes by more between two actuator samples is a corner of the motion.
constexpr double kCorner_mm_s = 1.0;
constexpr double kCorner_rad_s = 0.5;

BaseMotion to_base(const ActuatorState& state, std::int64_t start_utime) {
  return {static_cast<double>(state.utime - start_utime) * 1e-6, state.insertion_mm, state.rotation_rad};
}

BaseMotion between(const BaseMotion& a, const BaseMotion& b, double time_s) {
  const double share = b.time_s > a.time_s ? (time_s - a.time_s) / (b.time_s - a.time_s) : 1;
  return {time_s, a.insertion_mm + share * (b.insertion_mm - a.insertion_mm),
          a.rotation_rad + share * (b.rotation_rad - a.rotation_rad)};
}

bool is_corner(const BaseMotion& a, const BaseMotion& b, const BaseMotion& c) {
  const double before_s = b.time_s - a.time_s;
  const double after_s = c.time_s - b.time_s;
  if (!(before_s > 0 && after_s > 0)) return false;
  const double jump_mm_s = (c.insertion_mm - b.insertion_mm) / after_s - (b.insertion_mm - a.insertion_mm) / before_s;
  const double jump_rad_s = (c.rotation_rad - b.rotation_rad) / after_s - (b.rotation_rad - a.rotation_rad) / before_s;
  return std::abs(jump_mm_s) > kCorner_mm_s || std::abs(jump_rad_s) > kCorner_rad_s;
}

bool is_long(const BaseMotion& a, const BaseMotion& b) {
  return std::abs(b.insertion_mm - a.insertion_mm) > kLongestLeg_mm ||
         std::abs(b.rotation_rad - a.rotation_rad) > kLongestLeg_rad;
}

}  // namespace

Motion make_motion(std::span<const ActuatorState> actuators, std::span<const std::int64_t> reading_utimes) {
  if (actuators.size() < 2) throw ArgumentError("fewer than two actuator samples: there is no motion");
  const auto backwards = [](const auto& a, const auto& b) { return b.utime < a.utime; };
  if (std::adjacent_find(actuators.begin(), actuators.end(), backwards) != actuators.end())
    throw ArgumentError("actuator samples run backwards in time");
  if (std::adjacent_find(reading_utimes.begin(), reading_utimes.end(), std::greater<>()) != reading_utimes.end())
    throw ArgumentError("tip measurements run backwards in time");

  Motion motion;
  motion.start_utime = actuators.front().utime;
  auto& nodes = motion.nodes;
  nodes.push_back(to_base(actuators.front(), motion.start_utime));
  std::size_t reading = 0;
  const auto add_readings_until = [&](const BaseMotion& a, const BaseMotion& b, bool last) {
    while (reading < reading_utimes.size()) {
      const double time_s = static_cast<double>(reading_utimes[reading] - motion.start_utime) * 1e-6;
      if (time_s > b.time_s && !last) return;
      // Before the first sample and after the last the base stands.
      if (time_s > nodes.back().time_s)
        nodes.push_back(time_s >= b.time_s ? BaseMotion{time_s, b.insertion_mm, b.rotation_rad}
                                           : between(a, b, time_s));
      motion.at.push_back(nodes.size() - 1);
      ++reading;
    }
  };
  for (std::size_t i = 1; i < actuators.size(); ++i) {
    const BaseMotion a = to_base(actuators[i - 1], motion.start_utime);
    const BaseMotion b = to_base(actuators[i], motion.start_utime);
    add_readings_until(a, b, i + 1 == actuators.size());
    const bool corner = i + 1 < actuators.size() && is_corner(a, b, to_base(actuators[i + 1], motion.start_utime));
    if (b.time_s > nodes.back().time_s && (corner || is_long(nodes.back(), b))) nodes.push_back(b);
  }
  return motion;
}

namespace {

// Where a reading that is late comes from: between two nodes, and how far.
struct Place {
  std::size_t from = 0, to = 0;
  double share = 1;
  double span_s = 0;   // between the nodes
  bool moves = false;  // with the latency
};

Place place_of(const Motion& motion, std::size_t node, const Dual& latency_s) {
  std::size_t i = node;
  const double time_s = motion.nodes[i].time_s - latency_s.value;
  while (i > 1 && motion.nodes[i - 1].time_s > time_s) --i;
  const double span_s = motion.nodes[i].time_s - motion.nodes[i - 1].time_s;
  return {.from = i - 1,
          .to = i,
          .share = std::max(0.0, (time_s - motion.nodes[i - 1].time_s) / span_s),
          .span_s = span_s,
          .moves = time_s > motion.nodes.front().time_s};
}

void resize(OpenLoop::Track& track, std::size_t count, Eigen::Index columns) {
  track.value.resize(count);
  track.jacobian.resize(static_cast<Eigen::Index>(3 * count), columns);
}

void store(const Eigen::Vector3d& value, const PointColumns& D, std::size_t at, OpenLoop::Track& track) {
  track.value[at] = value;
  if (D.cols() > 0) track.jacobian.middleRows<3>(static_cast<Eigen::Index>(3 * at)) = D;
}

// A vector of the nodes as a reading shows it; late: as it is there itself, null where the nodes' mean will do.
void look(const Place& place, const OpenLoop::Track& nodes, const OpenLoop::Track* late, std::size_t reading,
          const Dual& latency_s, Eigen::Vector3d& value, PointColumns& D) {
  const auto D_of = [](const OpenLoop::Track& track, std::size_t i) {
    return track.jacobian.middleRows<3>(static_cast<Eigen::Index>(3 * i));
  };
  D.resize(3, nodes.jacobian.cols());
  if (place.from == place.to) {
    value = nodes.value[place.to];
    if (D.cols() > 0) D = D_of(nodes, place.to);
    return;
  }
  const Eigen::Vector3d step = nodes.value[place.to] - nodes.value[place.from];
  value = late != nullptr ? late->value[reading] : Eigen::Vector3d(nodes.value[place.from] + place.share * step);
  if (D.cols() == 0) return;
  if (late != nullptr)
    D = D_of(*late, reading);
  else
    D = (1 - place.share) * D_of(nodes, place.from) + place.share * D_of(nodes, place.to);
  if (place.moves) D -= step / place.span_s * latency_s.slope().head(D.cols()).matrix().transpose();
}

}  // namespace

bool predict(const AugmentedNeedle& needle, const Motion& motion, OpenLoop& out, bool headings) {
  const Eigen::Index columns = needle.columns();
  const auto& nodes = motion.nodes;
  const std::size_t count = nodes.size(), readings = motion.at.size();
  const Dual latency_s = needle.latency_s();
  const bool late = latency_s.value != 0 || (latency_s.slope() != 0).any();
  // Between its nodes a tip that jumps is before the jump or after it.
  const bool jumps = latency_s.value > 0 && needle.is_sudden();
  resize(out.node_position_mm, count, columns);
  resize(out.node_heading, headings ? count : 0, columns);
  resize(out.late_position_mm, jumps ? readings : 0, columns);
  resize(out.late_heading, jumps && headings ? readings : 0, columns);
  out.node_blur_mm2.resize(columns == 0 ? count : 0);
  AugmentedState state = needle.entry(nodes.front());
  TipReading reading;
  HeadingReading heading;
  const auto read = [&](std::size_t at, OpenLoop::Track& position, OpenLoop::Track& direction) {
    needle.point(state, reading);
    store(reading.position_mm, reading.D, at, position);
    if (!headings) return;
    needle.heading(state, heading);
    store(heading.direction, heading.D, at, direction);
  };
  const auto seen_s = [&](std::size_t r) { return nodes[motion.at[r]].time_s - latency_s.value; };
  std::size_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (; jumps && i > 0 && next < readings && seen_s(next) < nodes[i].time_s; ++next) {
      if (!(seen_s(next) > nodes[i - 1].time_s)) continue;  // a node's own
      if (!needle.advance(state, between(nodes[i - 1], nodes[i], seen_s(next)))) return false;
      read(next, out.late_position_mm, out.late_heading);
    }
    if (i > 0 && !needle.advance(state, nodes[i])) return false;
    read(i, out.node_position_mm, out.node_heading);
    if (columns == 0) out.node_blur_mm2[i] = needle.blur_mm2(state);
  }

  out.position_mm.resize(readings);
  out.jacobian.resize(static_cast<Eigen::Index>(3 * readings), columns);
  out.blur_mm2.resize(columns == 0 ? readings : 0);
  out.heading.resize(headings ? readings : 0);
  out.heading_jacobian.resize(headings ? static_cast<Eigen::Index>(3 * readings) : 0, columns);
  for (std::size_t r = 0; r < readings; ++r) {
    const std::size_t node = motion.at[r];
    const Place place = late && node > 0 ? place_of(motion, node, latency_s) : Place{.from = node, .to = node};
    const bool own = jumps && place.share > 0 && place.share < 1;
    look(place, out.node_position_mm, own ? &out.late_position_mm : nullptr, r, latency_s, reading.position_mm,
         reading.D);
    needle.through_cameras(reading);
    out.position_mm[r] = reading.position_mm;
    if (columns > 0)
      out.jacobian.middleRows<3>(static_cast<Eigen::Index>(3 * r)) = reading.D;
    else
      out.blur_mm2[r] = out.node_blur_mm2[place.to];
    if (!headings) continue;
    look(place, out.node_heading, own ? &out.late_heading : nullptr, r, latency_s, heading.direction, heading.D);
    needle.through_frame(heading);
    out.heading[r] = heading.direction;
    if (columns > 0) out.heading_jacobian.middleRows<3>(static_cast<Eigen::Index>(3 * r)) = heading.D;
  }
  return true;
}

}  // namespace bevel::model
