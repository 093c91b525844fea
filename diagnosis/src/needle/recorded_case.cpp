#include <bevel/diagnosis/needle/recorded_case.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include <bevel/diagnosis/needle/scatter_near_entry.hpp>
#include <bevel/diagnosis/statistics/median.hpp>

namespace bevel::diagnosis {
namespace {

constexpr double kRankTolerance = 1e-9;
constexpr double kSameAxis = 0.99;       // cosine
constexpr double kSameDirection = 0.05;  // what information mixes into other directions, as a share
constexpr double kClocksApart_s = 1.0;
constexpr double kDifferentRig = 3.0;  // ratio of frame periods or of claimed noise

// Between two stops of recordings without a clock: what is a second of a camera's noise is five stops.
constexpr std::int64_t kStop_us = 200'000;

std::string channel_name(int camera, const Eigen::Vector3d& axis, bool heading) {
  std::ostringstream text;
  text << (heading ? "heading" : "tip");
  if (camera != 0) text << '[' << camera << ']';
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) > kSameAxis) return text.str() + "." + "xyz"[i];
  text.precision(2);
  text << ".(" << axis.x() << ' ' << axis.y() << ' ' << axis.z() << ')';
  return text.str();
}

// What one message says, as a point: where the tip is, or the x and y components of its heading.
struct Point {
  std::int64_t utime = 0;
  int camera = 0;
  bool heading = false;
  Eigen::Vector3d value;
  Eigen::Matrix3d information;
};

// A heading h by its x and y: h moves by J d(x, y), J = (1 0; 0 1; -x/z -y/z). Without information where it lies
// across.
Point point_of(const model::TipHeading& m) {
  constexpr double kAcross = 0.1;  // z component
  Point point{.utime = m.utime,
              .camera = m.camera,
              .heading = true,
              .value = {m.heading.x(), m.heading.y(), 0},
              .information = Eigen::Matrix3d::Zero()};
  if (!(m.heading.z() > kAcross)) return point;
  Eigen::Matrix<double, 3, 2> J;
  J << 1, 0, 0, 1, -m.heading.x() / m.heading.z(), -m.heading.y() / m.heading.z();
  point.information.topLeftCorner<2, 2>() = J.transpose() * m.information_per_rad2 * J;
  return point;
}
Point point_of(const model::TipMeasurement& m) {
  return {.utime = m.utime,
          .camera = m.camera,
          .heading = false,
          .value = m.position_mm,
          .information = m.information_per_mm2};
}

using SeenAxes = std::vector<std::pair<Eigen::Vector3d, double>>;

// Axes that a message sees, each with its information, of which nothing is lost.
SeenAxes principal_axes(const Eigen::Matrix3d& information, double rank_tolerance) {
  SeenAxes axes;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information);
  for (int i = 0; i < 3; ++i)
    if (eigen.eigenvalues()[i] > rank_tolerance * eigen.eigenvalues()[2]) {
      Eigen::Vector3d axis = eigen.eigenvectors().col(i);
      Eigen::Index at = 0;
      axis.cwiseAbs().maxCoeff(&at);
      axes.emplace_back(axis[at] < 0 ? Eigen::Vector3d(-axis) : axis, eigen.eigenvalues()[i]);
    }
  return axes;
}

// The coordinate axes that a camera sees, where they are as many as all that it sees, each with the information of its
// own marginal. The principal axes turn with the needle, which is seen better across than along, and a channel does
// not; what correlates two channels within one message is left out.
SeenAxes coordinate_axes(const SeenAxes& principal) {
  Eigen::Matrix3d seen = Eigen::Matrix3d::Zero(), covariance = Eigen::Matrix3d::Zero();
  for (const auto& [axis, information] : principal) {
    seen += axis * axis.transpose();
    covariance += axis * axis.transpose() / information;
  }
  SeenAxes axes;
  for (int i = 0; i < 3; ++i)
    if (seen(i, i) > kSameAxis * kSameAxis) axes.emplace_back(Eigen::Vector3d::Unit(i), 1 / covariance(i, i));
  return axes.size() == principal.size() ? axes : SeenAxes{};
}

// The coordinate axes wherever they will do.
SeenAxes seen_axes(const Point& point) {
  const Eigen::Matrix3d& information = point.information;
  SeenAxes axes;
  const double largest = information.cwiseAbs().maxCoeff();
  if (!(largest > 0) || !information.allFinite() || !point.value.allFinite()) return axes;
  const Eigen::Matrix3d off = information - Eigen::Matrix3d(information.diagonal().asDiagonal());
  // A heading's components are hardly correlated, and what that makes of a direction nobody sees is no information.
  const double mixed = point.heading ? kSameDirection : kRankTolerance;
  const double rank = point.heading ? mixed * mixed : kRankTolerance;
  if (off.cwiseAbs().maxCoeff() < mixed * largest) {
    for (int i = 0; i < 3; ++i)
      if (information(i, i) > rank * largest) axes.emplace_back(Eigen::Vector3d::Unit(i), information(i, i));
    return axes;
  }
  const SeenAxes principal = principal_axes(information, rank);
  axes = coordinate_axes(principal);
  return axes.empty() ? principal : axes;
}

std::size_t channel_of(std::vector<Channel>& channels, const Point& point, const Eigen::Vector3d& axis) {
  for (std::size_t c = 0; c < channels.size(); ++c)
    if (channels[c].camera == point.camera && channels[c].heading == point.heading &&
        channels[c].axis.dot(axis) > kSameAxis)
      return c;
  channels.push_back({.camera = point.camera,
                      .axis = axis,
                      .name = channel_name(point.camera, axis, point.heading),
                      .heading = point.heading});
  return channels.size() - 1;
}

// Known channels first: of equal eigenvalues any directions in their plane are eigenvectors, and the last digits of a
// message would choose others for the next.
SeenAxes axes_of(const Point& point, const std::vector<Channel>& channels) {
  auto axes = seen_axes(point);
  SeenAxes known;
  for (const Channel& channel : channels) {
    if (channel.camera != point.camera || channel.heading != point.heading) continue;
    const Eigen::Vector3d seen = point.information * channel.axis;
    const double information = channel.axis.dot(seen);
    if (information > (point.heading ? kSameDirection * kSameDirection : kRankTolerance) *
                          point.information.cwiseAbs().maxCoeff() &&
        (seen - information * channel.axis).norm() < kSameDirection * information)
      known.emplace_back(channel.axis, information);
  }
  return known.size() == axes.size() ? known : axes;
}

// Times of the readings and of the base replaced by the number of the stop.
void count_stops(RawRecording& raw) {
  std::vector<std::int64_t> times;
  for (const auto& state : raw.actuators) times.push_back(state.utime);
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  const auto stop_of = [&](std::int64_t utime) {
    const auto at = std::ranges::lower_bound(times, utime) - times.begin();
    return (at + 1) * kStop_us;
  };
  for (auto& state : raw.actuators) state.utime = stop_of(state.utime);
  for (auto& tip : raw.tips) tip.utime = stop_of(tip.utime);
  for (auto& heading : raw.headings) heading.utime = stop_of(heading.utime);
}

std::vector<Point> usable_points(const RawRecording& raw) {
  std::vector<Point> points;
  const auto take = [&](const auto& messages) {
    for (const auto& one : messages)
      if (one.status == 0)
        if (Point point = point_of(one); !seen_axes(point).empty()) points.push_back(std::move(point));
  };
  take(raw.tips);
  take(raw.headings);
  std::ranges::stable_sort(points, {}, &Point::utime);
  return points;
}

Recording make_recording(RawRecording& raw, std::vector<Channel>& channels) {
  Recording recording;
  recording.name = raw.name;
  recording.changed = raw.changed;
  std::ranges::stable_sort(raw.actuators, {}, &model::ActuatorState::utime);
  if (raw.actuators.size() < 2)
    throw std::invalid_argument(raw.name + ": " + std::to_string(raw.actuators.size()) +
                                " ACTUATOR_STATE messages; the motion of the base needs at least two");
  const std::vector<Point> usable = usable_points(raw);
  recording.skipped = raw.tips.size() + raw.headings.size() - usable.size();
  if (std::ranges::all_of(usable, &Point::heading))
    throw std::invalid_argument(raw.name + ": no usable TIP_MEASUREMENT (" + std::to_string(raw.tips.size()) +
                                " in the log, of which none has status 0 and information along any axis)");
  const auto seconds = [&](std::int64_t utime) {
    return static_cast<double>(utime - raw.actuators.front().utime) * 1e-6;
  };
  const double end_s = seconds(raw.actuators.back().utime);
  const double middle_s = seconds(usable[usable.size() / 2].utime);
  if (middle_s < -kClocksApart_s || middle_s > end_s + kClocksApart_s)
    throw std::invalid_argument(raw.name +
                                ": the clocks of camera and axes are apart: half of the tip measurements lie " +
                                std::to_string(std::abs(middle_s < 0 ? middle_s : middle_s - end_s)) +
                                " s outside the actuators' time; at most " + std::to_string(kClocksApart_s) +
                                " s is allowed. Set both clocks by the same source and record again");

  // A position and a heading of one time and one sensor are one message, right or wrong together.
  std::vector<std::int64_t> utimes;
  std::vector<std::size_t> message;
  for (std::size_t i = 0; i < usable.size(); ++i) {
    std::size_t partner = i;
    for (std::size_t k = i; usable[i].heading && k-- > 0 && usable[k].utime == usable[i].utime;)
      if (!usable[k].heading && usable[k].camera == usable[i].camera) partner = k;
    if (partner == i) utimes.push_back(usable[i].utime);
    message.push_back(partner == i ? utimes.size() - 1 : message[partner]);
  }
  recording.motion = model::make_motion(raw.actuators, utimes);
  recording.position_mm.assign(utimes.size(), Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t i = 0; i < usable.size(); ++i) {
    const Point& point = usable[i];
    if (!point.heading) recording.position_mm[message[i]] = point.value;
    for (const auto& [axis, information] : axes_of(point, channels)) {
      const std::size_t c = channel_of(channels, point, axis);
      if (recording.series.size() < channels.size()) recording.series.resize(channels.size());
      Series& series = recording.series[c];
      const double time_s = seconds(point.utime);
      if (!series.time_s.empty() && time_s <= series.time_s.back()) continue;  // the same picture twice
      series.message.push_back(message[i]);
      series.time_s.push_back(time_s);
      series.measured.push_back(axis.dot(point.value));
      series.relative_sd.push_back(1 / std::sqrt(information));
    }
  }
  return recording;
}

// The noise is measured beside a curve that four readings determine.
void check_lengths(const RecordedCase& recorded) {
  constexpr std::size_t kFewest = 5;
  for (std::size_t c = 0; c < recorded.channels.size(); ++c) {
    std::size_t most = 0;
    for (const auto& recording : recorded.recordings) most = std::max(most, recording.series[c].time_s.size());
    if (most < kFewest)
      throw std::invalid_argument("channel " + recorded.channels[c].name + " has " + std::to_string(most) +
                                  " readings in its longest recording; at least " + std::to_string(kFewest) +
                                  " are needed to measure its noise");
  }
}

void check_same_rig(const RecordedCase& recorded) {
  const auto& first = recorded.recordings.front();
  const auto period = [](const Series& s) {
    return (s.time_s.back() - s.time_s.front()) / static_cast<double>(std::max<std::size_t>(s.time_s.size(), 2) - 1);
  };
  const auto differ = [](double a, double b) { return a > kDifferentRig * b || b > kDifferentRig * a; };
  for (const auto& recording : recorded.recordings)
    for (std::size_t c = 0; c < recorded.channels.size(); ++c) {
      const std::string where = recording.name + " and " + first.name + ": recordings of different rigs: ";
      const std::string& channel = recorded.channels[c].name;
      if (recording.series[c].time_s.size() < 2)
        throw std::invalid_argument(recording.name + ": no channel " + channel +
                                    ", which another recording has: recordings of different rigs");
      const double a_s = period(recording.series[c]);
      const double b_s = period(first.series[c]);
      if (differ(a_s, b_s))
        throw std::invalid_argument(where + "a reading of " + channel + " every " + std::to_string(a_s) +
                                    " s and every " + std::to_string(b_s) + " s");
      const double a_sd = median(recording.series[c].relative_sd);
      const double b_sd = median(first.series[c].relative_sd);
      const std::string unit = std::string(" ") + recorded.channels[c].unit();
      if (differ(a_sd, b_sd))
        throw std::invalid_argument(where + "the standard deviation claimed for " + channel + " is " +
                                    std::to_string(a_sd) + unit + " and " + std::to_string(b_sd) + unit);
    }
}

}  // namespace

bool RecordedCase::has_headings() const { return std::ranges::any_of(channels, &Channel::heading); }
bool RecordedCase::two_groups() const { return std::ranges::any_of(recordings, &Recording::changed); }

double RecordedCase::deepest_mm() const {
  double deepest_mm = 0;
  for (const auto& recording : recordings)
    for (const auto& node : recording.motion.nodes) deepest_mm = std::max(deepest_mm, node.insertion_mm);
  return deepest_mm;
}

bool RecordedCase::has_retraction() const {
  double least_sd_mm = std::numeric_limits<double>::infinity();
  for (const Channel& channel : channels)
    if (!channel.heading) least_sd_mm = std::min(least_sd_mm, channel.claimed_sd);
  return std::ranges::any_of(recordings, [&](const Recording& recording) {
    double deepest_mm = -std::numeric_limits<double>::infinity(), retracted_mm = 0;
    for (const auto& node : recording.motion.nodes) {
      deepest_mm = std::max(deepest_mm, node.insertion_mm);
      retracted_mm = std::max(retracted_mm, deepest_mm - node.insertion_mm);
    }
    return retracted_mm > least_sd_mm;
  });
}

std::size_t RecordedCase::measurements() const {
  std::size_t count = 0;
  for (const auto& recording : recordings)
    for (const auto& series : recording.series) count += series.time_s.size();
  return count;
}

RecordedCase make_case(std::vector<RawRecording> raw) {
  if (raw.size() < 2)
    throw std::invalid_argument(
        std::to_string(raw.size()) +
        " recording given; at least two are needed: what is found in one has to predict another");
  RecordedCase recorded;
  recorded.has_clock = std::ranges::all_of(raw, &RawRecording::has_clock);
  for (auto& one : raw) {
    if (!recorded.has_clock) count_stops(one);
    recorded.recordings.push_back(make_recording(one, recorded.channels));
  }
  for (auto& recording : recorded.recordings) recording.series.resize(recorded.channels.size());
  check_same_rig(recorded);
  check_lengths(recorded);
  std::vector<double> periods;
  for (std::size_t c = 0; c < recorded.channels.size(); ++c) {
    std::vector<double> claimed;
    for (const auto& recording : recorded.recordings) {
      const auto& series = recording.series[c];
      claimed.insert(claimed.end(), series.relative_sd.begin(), series.relative_sd.end());
      for (std::size_t i = 1; i < series.time_s.size(); ++i) periods.push_back(series.time_s[i] - series.time_s[i - 1]);
    }
    recorded.channels[c].claimed_sd = median(claimed);
    for (auto& recording : recorded.recordings)
      for (double& sd : recording.series[c].relative_sd) sd /= recorded.channels[c].claimed_sd;
  }
  recorded.frame_s = median(periods);
  if (!recorded.has_clock) widen_near_entry(recorded);
  return recorded;
}

}  // namespace bevel::diagnosis
