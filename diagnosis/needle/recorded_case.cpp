#include "diagnosis/needle/recorded_case.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "diagnosis/statistics/median.hpp"
#include "model/effects/covariates.hpp"

namespace bevel::diagnosis {
namespace {

constexpr double kRankTolerance = 1e-9;
constexpr double kSameAxis = 0.99;       // cosine
constexpr double kSameDirection = 0.05;  // what information mixes into other directions, as a share
constexpr double kClocksApart_s = 1.0;
constexpr double kDifferentRig = 3.0;  // ratio of frame periods or of claimed noise

std::string channel_name(int camera, const Eigen::Vector3d& axis) {
  std::ostringstream text;
  text << "tip";
  if (camera != 0) text << '[' << camera << ']';
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) > kSameAxis) return text.str() + "." + "xyz"[i];
  text.precision(2);
  text << ".(" << axis.x() << ' ' << axis.y() << ' ' << axis.z() << ')';
  return text.str();
}

// Axes that a message sees, each with its information; the coordinate axes where the matrix is diagonal.
std::vector<std::pair<Eigen::Vector3d, double>> seen_axes(const Eigen::Matrix3d& information) {
  std::vector<std::pair<Eigen::Vector3d, double>> axes;
  const double largest = information.cwiseAbs().maxCoeff();
  if (!(largest > 0) || !information.allFinite()) return axes;
  const Eigen::Matrix3d off = information - Eigen::Matrix3d(information.diagonal().asDiagonal());
  if (off.cwiseAbs().maxCoeff() < kRankTolerance * largest) {
    for (int i = 0; i < 3; ++i)
      if (information(i, i) > kRankTolerance * largest) axes.emplace_back(Eigen::Vector3d::Unit(i), information(i, i));
    return axes;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information);
  for (int i = 0; i < 3; ++i)
    if (eigen.eigenvalues()[i] > kRankTolerance * largest) {
      Eigen::Vector3d axis = eigen.eigenvectors().col(i);
      Eigen::Index at = 0;
      axis.cwiseAbs().maxCoeff(&at);
      axes.emplace_back(axis[at] < 0 ? Eigen::Vector3d(-axis) : axis, eigen.eigenvalues()[i]);
    }
  return axes;
}

std::size_t channel_of(std::vector<Channel>& channels, int camera, const Eigen::Vector3d& axis) {
  for (std::size_t c = 0; c < channels.size(); ++c)
    if (channels[c].camera == camera && channels[c].axis.dot(axis) > kSameAxis) return c;
  channels.push_back({camera, axis, channel_name(camera, axis), 0});
  return channels.size() - 1;
}

// Known channels first: of equal eigenvalues any directions in their plane are eigenvectors, and the last digits of a
// message would choose others for the next.
std::vector<std::pair<Eigen::Vector3d, double>> axes_of(const model::TipMeasurement& tip,
                                                        const std::vector<Channel>& channels) {
  auto axes = seen_axes(tip.information_per_mm2);
  std::vector<std::pair<Eigen::Vector3d, double>> known;
  for (const Channel& channel : channels) {
    if (channel.camera != tip.camera) continue;
    const Eigen::Vector3d seen = tip.information_per_mm2 * channel.axis;
    const double information = channel.axis.dot(seen);
    if (information > kRankTolerance * tip.information_per_mm2.cwiseAbs().maxCoeff() &&
        (seen - information * channel.axis).norm() < kSameDirection * information)
      known.emplace_back(channel.axis, information);
  }
  return known.size() == axes.size() ? known : axes;
}

Recording make_recording(RawRecording& raw, std::vector<Channel>& channels) {
  Recording recording;
  recording.name = raw.name;
  const auto by_time = [](const auto& a, const auto& b) { return a.utime < b.utime; };
  std::stable_sort(raw.actuators.begin(), raw.actuators.end(), by_time);
  std::stable_sort(raw.tips.begin(), raw.tips.end(), by_time);
  if (raw.actuators.size() < 2)
    throw std::invalid_argument(raw.name + ": " + std::to_string(raw.actuators.size()) +
                                " ACTUATOR_STATE messages; the motion of the base needs at least two");
  std::vector<model::TipMeasurement> usable;
  for (const auto& tip : raw.tips)
    if (tip.status == 0 && tip.position_mm.allFinite() && !seen_axes(tip.information_per_mm2).empty())
      usable.push_back(tip);
  recording.skipped = raw.tips.size() - usable.size();
  if (usable.empty())
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

  std::vector<std::int64_t> utimes;
  for (const auto& tip : usable) utimes.push_back(tip.utime);
  recording.motion = model::make_motion(raw.actuators, utimes);
  for (std::size_t i = 0; i < usable.size(); ++i) {
    recording.position_mm.push_back(usable[i].position_mm);
    for (const auto& [axis, information] : axes_of(usable[i], channels)) {
      const std::size_t c = channel_of(channels, usable[i].camera, axis);
      if (recording.series.size() < channels.size()) recording.series.resize(channels.size());
      Series& series = recording.series[c];
      const double time_s = seconds(usable[i].utime);
      if (!series.time_s.empty() && time_s <= series.time_s.back()) continue;  // the same picture twice
      series.message.push_back(i);
      series.time_s.push_back(time_s);
      series.measured.push_back(axis.dot(usable[i].position_mm));
      series.relative_sd.push_back(1 / std::sqrt(information));
    }
  }
  return recording;
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
      if (recording.series[c].time_s.size() < 2 || first.series[c].time_s.size() < 2)
        throw std::invalid_argument(where + "channel " + channel + " is not in both");
      const double a_s = period(recording.series[c]);
      const double b_s = period(first.series[c]);
      if (differ(a_s, b_s))
        throw std::invalid_argument(where + "a reading of " + channel + " every " + std::to_string(a_s) +
                                    " s and every " + std::to_string(b_s) + " s");
      const double a_mm = median(recording.series[c].relative_sd);
      const double b_mm = median(first.series[c].relative_sd);
      if (differ(a_mm, b_mm))
        throw std::invalid_argument(where + "the standard deviation claimed for " + channel + " is " +
                                    std::to_string(a_mm) + " mm and " + std::to_string(b_mm) + " mm");
    }
}

}  // namespace

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
  for (auto& one : raw) recorded.recordings.push_back(make_recording(one, recorded.channels));
  for (auto& recording : recorded.recordings) recording.series.resize(recorded.channels.size());
  check_same_rig(recorded);
  std::vector<double> periods;
  for (std::size_t c = 0; c < recorded.channels.size(); ++c) {
    std::vector<double> claimed;
    for (const auto& recording : recorded.recordings) {
      const auto& series = recording.series[c];
      claimed.insert(claimed.end(), series.relative_sd.begin(), series.relative_sd.end());
      for (std::size_t i = 1; i < series.time_s.size(); ++i) periods.push_back(series.time_s[i] - series.time_s[i - 1]);
    }
    recorded.channels[c].claimed_sigma_mm = median(claimed);
    for (auto& recording : recorded.recordings)
      for (double& sd : recording.series[c].relative_sd) sd /= recorded.channels[c].claimed_sigma_mm;
  }
  recorded.frame_s = median(periods);
  return recorded;
}

double Covariates::operator[](model::Covariate covariate) const {
  switch (covariate) {
    case model::Covariate::time_s:
      return time_s;
    case model::Covariate::depth_mm:
      return depth_mm;
    case model::Covariate::speed_mm_s:
      return speed_mm_s;
    case model::Covariate::turn_rate_rad_s:
      return turn_rate_rad_s;
    case model::Covariate::since_stop_s:
      return since_stop_s;
    case model::Covariate::since_reversal_mm:
      return since_reversal_mm;
    case model::Covariate::roll_rad:
      return roll_rad;
  }
  return time_s;
}

std::vector<Covariates> find_covariates(const model::Motion& motion) {
  std::vector<Covariates> all;
  model::CovariateTracker tracker(motion.nodes.front());
  for (std::size_t i = 0; i < motion.nodes.size(); ++i) {
    if (i > 0) tracker.advance(motion.nodes[i - 1], motion.nodes[i]);
    Covariates at{.time_s = motion.nodes[i].time_s,
                  .depth_mm = motion.nodes[i].insertion_mm,
                  .speed_mm_s = tracker[model::Covariate::speed_mm_s],
                  .turn_rate_rad_s = tracker[model::Covariate::turn_rate_rad_s],
                  .since_stop_s = tracker[model::Covariate::since_stop_s],
                  .since_reversal_mm = tracker[model::Covariate::since_reversal_mm],
                  .roll_rad = motion.nodes[i].rotation_rad};
    all.push_back(at);
  }
  return all;
}

}  // namespace bevel::diagnosis
