// SPDX-License-Identifier: MIT
#include <bevel/analysis/replay/replay.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <utility>

#include <bevel/error.hpp>
#include <bevel/io/motion_gap.hpp>
#include <bevel/io/recording.hpp>

namespace bevel::analysis {
namespace {

// As of a channel that may be left out of a log (bevel/io/recording.hpp).
constexpr double kLargestShareTooOld = 0.2;

double square(double x) { return x * x; }

// Of this thread: what the work costs, whatever else the machine does.
double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

template <class Reading>
AppliedRow applied_row(const Reading& reading, const estimator::Update& update) {
  return {reading.utime, reading.seq, reading.camera, update.accepted, update.rank, update.mahalanobis2};
}

struct Sink {
  std::vector<InnovationRow>* rows;
  std::vector<HeadingRow>* headings;
  const estimator::NeedleFilter* filter;

  static void take(void* context, const estimator::NeedleEstimator::Applied& applied) {
    const Sink& sink = *static_cast<Sink*>(context);
    if (applied.heading != nullptr) {
      sink.headings->push_back({applied_row(*applied.heading, applied.update), applied.update.innovation.head<2>()});
      return;
    }
    const model::TipMeasurement& m = *applied.measurement;
    InnovationRow row;
    static_cast<AppliedRow&>(row) = applied_row(m, applied.update);
    row.position_mm = m.position_mm;
    row.innovation_mm = m.position_mm - sink.filter->seen_position_mm(applied.state_before);
    const Eigen::Matrix3d& R = applied.state_before.pose.R;
    row.state_variance_mm2 = (R * applied.state_before.covariance.topLeftCorner<3, 3>() * R.transpose()).diagonal();
    for (int i = 0; i < 3; ++i) {
      const double information = m.information_per_mm2(i, i);
      row.sees[static_cast<std::size_t>(i)] = information > 0;
      row.noise_variance_mm2[i] = information > 0 ? 1 / information : 0;
    }
    sink.rows->push_back(row);
  }
};

model::TipMeasurement with_noise(model::TipMeasurement m, const std::vector<NoiseColour>& noise) {
  for (std::size_t i = 0; i < noise.size() && i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    if (m.information_per_mm2(axis, axis) > 0 && noise[i].sd_mm > 0) {
      m.information_per_mm2.row(axis).setZero();
      m.information_per_mm2.col(axis).setZero();
      // A filter for white noise learns as much from frames of correlated noise as they are worth when their white
      // equivalent over many frames is put in: (1 + rho)/(1 - rho) times the variance.
      m.information_per_mm2(axis, axis) = (1 - noise[i].rho) / (1 + noise[i].rho) / square(noise[i].sd_mm);
    }
  }
  return m;
}

bool is_finite(const estimator::Estimate& estimate) {
  const estimator::FilterState& s = estimate.state;
  return s.pose.p_mm.allFinite() && s.pose.R.allFinite() && std::isfinite(s.curvature_per_mm) &&
         std::isfinite(s.lambda1_per_rad) && std::isfinite(s.lambda2) && s.covariance.allFinite() &&
         (s.covariance.diagonal().array() >= 0).all() && s.tenth_variance >= 0;
}

// The estimate at a truth's time: the state row before it, moved by the share of the increment.
void compare(Replay& result, const std::vector<needle_state_t>& truths, const estimator::NeedleFilter& filter) {
  double position2 = 0, lateral2 = 0, tilt2 = 0, roll2 = 0;
  TruthFigures& figures = result.truth;
  for (const needle_state_t& truth : truths) {
    const auto after = std::lower_bound(result.states.begin(), result.states.end(), truth.utime,
                                        [](const StateRow& row, std::int64_t utime) { return row.utime < utime; });
    if (after == result.states.end() || (after == result.states.begin() && after->utime != truth.utime)) continue;
    const auto row = static_cast<std::size_t>(after - result.states.begin());
    estimator::FilterState state = filter_state(result, after->utime == truth.utime ? row : row - 1);
    if (after->utime != truth.utime) {
      const StateRow& before = *(after - 1);
      const double share =
          static_cast<double>(truth.utime - before.utime) / static_cast<double>(after->utime - before.utime);
      filter.predict(state, share * (after->insertion_mm - before.insertion_mm),
                     share * (after->rotation_rad - before.rotation_rad),
                     static_cast<double>(truth.utime - before.utime) * 1e-6);
    }
    model::Pose pose;
    pose.p_mm = {truth.position_mm[0], truth.position_mm[1], truth.position_mm[2]};
    const double* q = truth.orientation_wxyz;
    pose.R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    // What effects say of the tip is the model's; here it is what the filter itself estimates, but for a stiff shaft.
    const model::Pose tip = state.bending_mm > 0 ? filter.tip_pose(state) : state.pose;
    const model::Vector6d error = model::log_se3(tip.inverse() * pose);
    const Eigen::Vector3d offset = pose.p_mm - tip.p_mm;
    position2 += offset.squaredNorm();
    lateral2 += offset.head<2>().squaredNorm();
    tilt2 += error.segment<2>(3).squaredNorm();
    roll2 += square(error[5]);
    figures.pose_nees.add(error.dot(state.covariance.topLeftCorner<6, 6>().ldlt().solve(error)), 6);
    for (Eigen::Index i = 0; i < 6; ++i)
      figures.axis_nees[static_cast<std::size_t>(i)].add(square(error[i]) / state.covariance(i, i), 1);
    figures.last_position_error_mm = offset.norm();
    ++figures.count;
  }
  if (figures.count == 0) return;
  const auto n = static_cast<double>(figures.count);
  figures.position_rmse_mm = std::sqrt(position2 / n);
  figures.lateral_rmse_mm = std::sqrt(lateral2 / n);
  figures.tilt_rmse_rad = std::sqrt(tilt2 / n);
  figures.roll_rmse_rad = std::sqrt(roll2 / n);
}

// Limits of the axes of a recording. A log with a long period has no gap in each period (io::longest_interval_s).
estimator::AxisLimits axes_of(const io::Recording& recording, estimator::AxisLimits axes, bool rates_of_log) {
  std::vector<model::ActuatorState> sorted = recording.actuators;
  std::ranges::stable_sort(sorted, {}, &model::ActuatorState::utime);
  double fastest_mm_s = 0, fastest_rad_s = 0;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const model::ActuatorState &a = sorted[i - 1], &b = sorted[i];
    const double period_s = static_cast<double>(b.utime - a.utime) * 1e-6;
    if (!(period_s > 0)) continue;
    fastest_mm_s = std::max(fastest_mm_s, std::abs(b.insertion_mm - a.insertion_mm) / period_s);
    fastest_rad_s = std::max(fastest_rad_s, std::abs(b.rotation_rad - a.rotation_rad) / period_s);
  }
  if (sorted.size() < 2 || !(axes.gap_s > 0)) return axes;
  axes.gap_s = io::longest_interval_s(sorted, axes.gap_s);
  if (rates_of_log) axes.insertion_rate_mm_s = fastest_mm_s, axes.rotation_rate_rad_s = fastest_rad_s;
  return axes;
}

// Insertion (mm) and rotation (rad) of the base at a time, between actuator states.
Eigen::Vector2d axes_at(const Replay& replay, std::int64_t utime) {
  const auto after = std::lower_bound(replay.states.begin(), replay.states.end(), utime,
                                      [](const StateRow& row, std::int64_t t) { return row.utime < t; });
  if (after == replay.states.end()) return {replay.states.back().insertion_mm, replay.states.back().rotation_rad};
  if (after == replay.states.begin()) return {after->insertion_mm, after->rotation_rad};
  const StateRow& before = *(after - 1);
  const double share = static_cast<double>(utime - before.utime) / static_cast<double>(after->utime - before.utime);
  return {before.insertion_mm + share * (after->insertion_mm - before.insertion_mm),
          before.rotation_rad + share * (after->rotation_rad - before.rotation_rad)};
}

}  // namespace

estimator::FilterState filter_state(const Replay& replay, std::size_t row) {
  estimator::FilterState state = replay.states[row].state.unpacked();
  if (!replay.effects.empty()) state.effects = replay.effects[row];
  return state;
}

Replay replay_log(std::span<const std::uint8_t> log, const std::string& name, const estimator::EstimatorConfig& config,
                  const ReplayOptions& options) {
  Replay result;
  result.name = name;
  const auto start = std::chrono::steady_clock::now();
  const double start_processor_s = processor_s();
  const io::Recording recording = io::read_recording(log);
  io::require_usable(name, recording);
  result.remarks = recording.remarks(name);
  result.order_note = recording.order_note(name);
  result.config = config;
  result.config.axes = axes_of(recording, config.axes, options.rates_of_log);
  // An actuator state takes about 100 bytes of a log, a measurement 170.
  result.states.reserve(log.size() / 150 + 16);
  result.innovations.reserve(log.size() / 250 + 16);
  estimator::NeedleEstimator estimator(result.config, options.history);
  Sink sink{&result.innovations, &result.headings, &estimator.filter()};
  estimator.observe(&Sink::take, &sink);
  for (const io::Arrival& arrival : recording.arrivals) {
    if (arrival.channel == io::Arrival::Channel::tip)
      estimator.add(with_noise(recording.tips[arrival.index], options.noise_by_axis));
    if (arrival.channel == io::Arrival::Channel::heading && options.use_headings)
      estimator.add(recording.headings[arrival.index]);
    if (arrival.channel != io::Arrival::Channel::actuator) continue;
    const model::ActuatorState& actuator = recording.actuators[arrival.index];
    estimator.add(actuator);
    const estimator::Estimate estimate = estimator.estimate(actuator.utime);
    if (estimate.utime != actuator.utime) continue;
    StateRow& row = result.states.emplace_back();
    row.utime = actuator.utime;
    row.insertion_mm = actuator.insertion_mm;
    row.rotation_rad = actuator.rotation_rad;
    row.state = estimate.state;
    if (!config.effects.empty()) result.effects.push_back(estimate.state.effects);
    row.test_ratio = estimate.newest_update.test_ratio;
    row.health = estimate.health;
    if (!is_finite(estimate))
      throw DomainError(name + ": the estimate is not finite from " +
                        std::to_string(static_cast<double>(actuator.utime - result.states.front().utime) * 1e-6) +
                        " s on; check the measurements before that time, and the model file");
  }
  result.processor_s = processor_s() - start_processor_s;
  result.run_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.damage = recording.damage;
  result.refused_messages = recording.rejected();
  result.counters = estimator.counters();
  for (const auto* c : {&result.counters.positions, &result.counters.headings})
    if (static_cast<double>(c->too_old) > kLargestShareTooOld * static_cast<double>(c->offered))
      result.remarks += name + ": " + std::to_string(c->too_old) + " of " + std::to_string(c->offered) +
                        (c == &result.counters.positions ? " positions" : " headings") +
                        " were not used: they stand in the log after their time has left the estimator's history. " +
                        "Is the log in the order of time?\n";
  if (result.states.empty())
    throw DomainError(name + ": no state estimated from its " + std::to_string(recording.actuators.size()) +
                      " ACTUATOR_STATE messages; at least one is needed");
  result.log_s = static_cast<double>(result.states.back().utime - result.states.front().utime) * 1e-6;
  compare(result, recording.truths, estimator.filter());
  if (result.headings.empty()) return result;
  ReplayOptions without = options;
  without.use_headings = false;
  const Replay alone = replay_log(log, name, config, without);
  result.without_headings = alone.states.back();
  result.truth_without_headings = alone.truth;
  return result;
}

void Predicted::add(const Predicted& other) {
  for (std::size_t i = 0; i < 2; ++i) {
    count[i] += other.count[i];
    squares_mm2[i] += other.squares_mm2[i];
  }
}

double Predicted::lateral_rmse_mm() const {
  double mean_mm2 = 0;
  for (std::size_t i = 0; i < 2; ++i)
    if (count[i] > 0) mean_mm2 += squares_mm2[i] / static_cast<double>(count[i]);
  return std::sqrt(mean_mm2);
}

Predicted predict(const Replay& replay, double ahead_mm) {
  const estimator::NeedleFilter filter(replay.config);
  Predicted result;
  for (auto from = replay.states.begin(); from != replay.states.end(); ++from) {
    // The first accepted measurement that lies so far ahead of a state, and is not yet part of it.
    const auto to = std::find_if(replay.innovations.begin(), replay.innovations.end(), [&](const InnovationRow& row) {
      return row.accepted && row.utime > from->utime && axes_at(replay, row.utime)[0] >= from->insertion_mm + ahead_mm;
    });
    if (to == replay.innovations.end()) break;
    estimator::FilterState state = filter_state(replay, static_cast<std::size_t>(from - replay.states.begin()));
    Eigen::Vector2d axes(from->insertion_mm, from->rotation_rad);
    std::int64_t utime = from->utime;
    const auto seconds_to = [&utime](std::int64_t later) {
      return static_cast<double>(later - std::exchange(utime, later)) * 1e-6;
    };
    for (auto row = from + 1; row != replay.states.end() && row->utime < to->utime; ++row) {
      filter.predict_mean(state, row->insertion_mm - axes[0], row->rotation_rad - axes[1], seconds_to(row->utime));
      axes = {row->insertion_mm, row->rotation_rad};
    }
    const Eigen::Vector2d last = axes_at(replay, to->utime) - axes;
    filter.predict_mean(state, last[0], last[1], seconds_to(to->utime));
    const Eigen::Vector3d error = to->position_mm - filter.seen_position_mm(state);
    for (std::size_t i = 0; i < 2; ++i) {
      if (!to->sees[i]) continue;
      result.squares_mm2[i] += square(error[static_cast<Eigen::Index>(i)]);
      ++result.count[i];
    }
  }
  return result;
}

InnovationFigures innovation_figures(const Replay& replay) {
  InnovationFigures figures;
  std::array<std::vector<double>, 3> series;
  for (const InnovationRow& row : replay.innovations) {
    ++figures.measurements;
    if (!row.accepted) {
      ++figures.rejected;
      continue;
    }
    figures.nis.add(row.mahalanobis2, row.rank);
    for (std::size_t i = 0; i < 3; ++i) {
      if (!row.sees[i]) continue;
      const auto axis = static_cast<Eigen::Index>(i);
      const double standard =
          row.innovation_mm[axis] / std::sqrt(row.state_variance_mm2[axis] + row.noise_variance_mm2[axis]);
      series[i].push_back(standard);
      figures.axis[i].add(standard * standard, 1);
    }
  }
  for (const HeadingRow& row : replay.headings) {
    ++figures.headings;
    row.accepted ? figures.heading_nis.add(row.mahalanobis2, row.rank) : void(++figures.headings_rejected);
  }
  for (std::size_t i = 0; i < 3; ++i) figures.whiteness[i] = ljung_box(series[i]);
  if (!replay.states.empty()) figures.resets = replay.states.back().state.reset_count;
  return figures;
}

std::vector<Innovation> axis_innovations(const Replay& replay, int axis) {
  std::vector<Innovation> series;
  for (const InnovationRow& row : replay.innovations)
    if (row.accepted && row.sees[static_cast<std::size_t>(axis)])
      series.push_back({row.seq, row.innovation_mm[axis], row.state_variance_mm2[axis]});
  return series;
}

std::vector<AxisSample> axis_samples(const Replay& replay, int axis) {
  std::vector<AxisSample> series;
  for (const InnovationRow& row : replay.innovations)
    if (row.sees[static_cast<std::size_t>(axis)])
      series.push_back({row.seq, axes_at(replay, row.utime)[0], row.position_mm[axis]});
  return series;
}

}  // namespace bevel::analysis
