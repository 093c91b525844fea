// SPDX-License-Identifier: MIT
#include <bevel/estimator/needle_estimator.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include <bevel/estimator/health.hpp>
#include <bevel/model/age.hpp>

namespace bevel::estimator {
namespace {

double square(double x) { return x * x; }

// About body x and y.
double largest_tilt_variance(const FilterState& state) { return state.covariance.diagonal().segment<2>(3).maxCoeff(); }

// To what standard deviation a heading must be known for steps from it to be run again: about that of an insertion's
// start, for which running them again was validated.
double known_heading_sd(const Prior& prior) {
  constexpr double kLeast_rad = 0.03;
  return std::max(kLeast_rad, 1.5 * std::hypot(prior.tilt_sd_rad, prior.variation.entry_angle_rad));
}

}  // namespace

NeedleEstimator::NeedleEstimator(const EstimatorConfig& config, std::size_t history)
    : filter_(config),
      past_(config.effects.empty() && config.prior.bending_mm == 0 && !config.nuisance.any()
                ? static_cast<std::size_t>(std::max(config.relinearised_steps, 0))
                : 0),
      known_heading_sd_rad_(known_heading_sd(config.prior)),
      walked_(std::make_unique_for_overwrite<WalkedStep[]>(past_.room())) {
  pool_.resize(std::max<std::size_t>(history, 8));
  order_.reserve(pool_.size());
  free_.reserve(pool_.size());
  for (std::size_t i = pool_.size(); i-- > 0;) free_.push_back(static_cast<std::uint32_t>(i));
}

// Finds the place of a new node and opens it; nullptr when it is a duplicate. An actuator state comes before the
// readings of the same instant, positions before headings, and those are ordered by camera and number: the order of
// arrival plays no part.
NeedleEstimator::Node* NeedleEstimator::insert(std::int64_t utime, Kind kind, std::int32_t camera, std::int64_t seq,
                                               std::size_t& index) {
  const auto key = [](const Node& n) { return std::tuple(n.utime, n.kind, n.camera, n.seq); };
  const auto wanted = std::tuple(utime, kind, camera, seq);
  index = order_.size();
  while (index > 0 && key(node(index - 1)) > wanted) --index;
  if (index > 0 && key(node(index - 1)) == wanted) return nullptr;
  if (free_.empty()) {
    drop_oldest();
    --index;
  }
  const std::uint32_t slot = free_.back();
  free_.pop_back();
  order_.insert(order_.begin() + static_cast<std::ptrdiff_t>(index), slot);
  Node& made = pool_[slot];
  made.utime = utime;
  made.kind = kind;
  made.camera = camera;
  made.seq = seq;
  made.applied_before = made.counted_in_gap = made.rejects_forgotten = false;
  return &made;
}

// The next node keeps its posterior and becomes the anchor. Where only measurements wait for the axes, and none has a
// posterior yet, the oldest of those goes: the anchor cannot.
void NeedleEstimator::drop_oldest() {
  const std::ptrdiff_t which = processed_ < 2 ? 1 : 0;
  if (which == 1) {
    ++counters_of(node(1).kind).too_old;
  } else {
    remember(node(0), node(1));
    --processed_;
  }
  free_.push_back(order_[static_cast<std::size_t>(which)]);
  order_.erase(order_.begin() + which);
}

void NeedleEstimator::restart_past(const FilterState& start) {
  past_.restart(start);
  forgotten_since_.fill(std::numeric_limits<double>::infinity());
  past_mm_ = 0;
  past_due_mm_ = kFirstRelinearisation_mm;
  past_started_ = true;
  past_waits_ = false;
}

void NeedleEstimator::remember(const Node& before, const Node& node) {
  // Steps from a heading that is hardly known would be run again along paths that the model does not hold for: the past
  // begins where it is known.
  const bool first = !past_started_ || !(largest_tilt_variance(before.state) < square(known_heading_sd_rad_));
  const bool reset = node.state.reset_count != before.state.reset_count;
  if (first || reset) restart_past(first ? before.state : node.state);
  // In the channel too: what the readings there share is not in the past's.
  const double forgotten =
      filter_.forgotten(node.insertion_mm - before.insertion_mm, node.rotation_rad - before.rotation_rad,
                        static_cast<double>(node.utime - before.utime) * 1e-6);
  for (double& since : forgotten_since_) since += forgotten;
  // Drawn back it is where it has been: the past goes on where it goes on, and what is seen meanwhile is the filter's
  // alone.
  if (node.state.channel.drawn_back_mm() > kDrawnBack_mm) {
    if (!past_waits_) past_.close(before.state, filter_);
    if (!past_waits_) left_ = {before.insertion_mm, before.rotation_rad};
    past_begins_anew_ = first || reset || (past_waits_ && past_begins_anew_);
    past_waits_ = true;
    return;
  }
  if (past_waits_ && past_begins_anew_) return restart_past(node.state);
  if (reset && !first) return;
  if (!past_.complete()) return;
  PastStep step;
  step.insertion_mm = node.insertion_mm - before.insertion_mm;
  step.rotation_rad = node.rotation_rad - before.rotation_rad;
  if (past_waits_) {
    // The bevel was turned at the front, as far as the path is concerned.
    past_waits_ = false;
    past_.add(before.state, {.rotation_rad = before.rotation_rad - left_.rotation_rad}, node.state, {}, filter_);
    past_.close(node.state, filter_);
    step.insertion_mm = node.insertion_mm - left_.insertion_mm;
  }
  step.measured = node.kind == Kind::position && node.update.accepted;
  if (step.measured) {
    step.position_mm = node.measurement.position_mm;
    double& since = forgotten_since_[node.camera == 0 ? 0 : 1];
    const double worth = filter_.worth(since);
    step.measured = worth > 0;  // nothing has been forgotten since: it is the same reading again
    step.information_per_mm2 = worth * node.measurement.information_per_mm2;
    since = 0;
  }
  if (node.kind == Kind::heading && node.update.accepted)
    (filter_.is_of_shaft(node.heading.camera) ? step.motion : step.heading) =
        filter_.made_linear(node.heading, node.state);
  past_mm_ += std::abs(step.insertion_mm);
  past_.add(before.state, step, node.state, node.moved, filter_);
}

void NeedleEstimator::relinearise_if_due() {
  if (!past_.complete() || past_waits_ || past_mm_ < past_due_mm_) return;
  FilterState& anchor = node(0).state;
  past_.close(anchor, filter_);
  if (!past_.complete()) return;
  past_due_mm_ = past_mm_ + std::max(kRelinearisedEvery_mm, past_mm_ / 8);
  if (!filter_.relinearise(anchor, past_.start(), past_.steps(), {walked_.get(), past_.room()})) return;
  ++counters_.relinearised;
  process_from(1);
}

void NeedleEstimator::add(const model::ActuatorState& actuator) {
  ++counters_.actuators;
  std::size_t index = 0;
  // The first node anchors the history: nothing older can be placed, and a full history drops its oldest first.
  if (!order_.empty() && actuator.utime <= node(0).utime) {
    ++counters_.actuators_refused;
    return;
  }
  Node* made = insert(actuator.utime, Kind::actuator, 0, 0, index);
  if (!made) {
    ++counters_.actuators_refused;
    return;
  }
  made->insertion_mm = actuator.insertion_mm;
  made->rotation_rad = actuator.rotation_rad;
  made->axes = {actuator.utime, actuator.insertion_mm, actuator.rotation_rad, actuator.axis_status};
  if (index == 0) {
    made->state = filter_.config().start_at_axes ? filter_.inserted(made->insertion_mm, made->rotation_rad)
                                                 : filter_.initial(made->insertion_mm, made->rotation_rad);
    made->state.reset_count = resets_before_;
    if (restarted_) made->state.reset_cause = ResetCause::restarted, made->state.reset_utime = actuator.utime;
  }
  // Measurements since the previous actuator state are interpolated anew.
  std::size_t from = index;
  while (from > 1 && node(from - 1).kind != Kind::actuator) --from;
  process_from(from);
  relinearise_if_due();
}

void NeedleEstimator::add(const model::TipMeasurement& measurement) {
  add_reading(Kind::position, measurement, measurement.information_per_mm2, &Node::measurement);
}

void NeedleEstimator::add(const model::TipHeading& heading) {
  add_reading(Kind::heading, heading, heading.information_per_rad2, &Node::heading);
}

template <class Reading>
void NeedleEstimator::add_reading(Kind kind, Reading reading, const Eigen::Matrix3d& information,
                                  Reading Node::*member) {
  ReadingCounters& counters = counters_of(kind);
  ++counters.offered;
  reading.utime -= filter_.latency_us();  // a camera known to stamp late saw the tip so much earlier
  if (reading.status != 0 || !(information.trace() > 0)) {
    ++counters.not_usable;
    return;
  }
  // A full history drops its oldest node, or of readings that wait for the axes the oldest: not the new one.
  if (order_.empty() || reading.utime < node(0).utime || (free_.empty() && reading.utime < node(1).utime)) {
    ++counters.too_old;
    return;
  }
  std::size_t index = 0;
  Node* made = insert(reading.utime, kind, reading.camera, reading.seq, index);
  if (!made) {
    ++counters.duplicate;
    return;
  }
  made->*member = reading;
  if (index < processed_) ++counters.late;
  process_from(index);
  relinearise_if_due();
}

void NeedleEstimator::restart() {
  if (processed_ > 0) resets_before_ = node(processed_ - 1).state.reset_count + 1;
  free_.insert(free_.end(), order_.begin(), order_.end());
  order_.clear();
  processed_ = 0;
  past_started_ = false;
  newest_update_ = {};
  newest_update_utime_ = 0;
  restarted_ = true;
}

void NeedleEstimator::forget_rejects() {
  for (const std::uint32_t slot : order_) {
    Node& n = pool_[slot];
    n.rejects_forgotten = true;
    n.state.rejects_in_row = n.state.heading_rejects_in_row = 0;
    n.state.camera_rejects_in_row = {};
  }
}

void NeedleEstimator::shift_time(std::int64_t by_us) {
  for (const std::uint32_t slot : order_) {
    Node& n = pool_[slot];
    n.utime += by_us;
    n.measurement.utime += by_us;
    n.heading.utime += by_us;
    if (n.state.measurement_utime != 0) n.state.measurement_utime += by_us;
    if (n.state.reading_utime != 0) n.state.reading_utime += by_us;
    for (std::int64_t& utime : n.state.camera_utime)
      if (utime != 0) utime += by_us;
    if (n.state.heading_utime != 0) n.state.heading_utime += by_us;
    n.axes.utime += by_us;
    ++n.state.reset_count;
    n.state.reset_cause = ResetCause::clock_set;
    n.state.reset_utime = n.utime;
  }
  newest_update_utime_ += by_us;
  past_started_ = false;  // its states carry other times
}

// Longer than motion may be interpolated over. Drives that report that they are not enabled, before and after, and that
// stand where they stood, are at rest in between: bevel-stepper reports nothing while it resets them for an arm.
bool NeedleEstimator::is_gap(const Reported& from, const Reported& to) const {
  constexpr double kRelaxes_mm = 0.1, kRelaxes_rad = 0.1;  // a motor that is switched off
  const double gap_s = filter_.config().axes.gap_s;
  if (!(gap_s > 0 && static_cast<double>(to.utime - from.utime) * 1e-6 > gap_s)) return false;
  const auto has = [&](model::AxisStatus status) {
    const auto wanted = static_cast<std::int32_t>(status);
    return std::ranges::count(from.status, wanted) + std::ranges::count(to.status, wanted);
  };
  const bool known = has(model::AxisStatus::off) < 4;  // recordings without a status have that of drives that are off
  const bool at_rest = known && has(model::AxisStatus::enabled) == 0 &&
                       std::abs(to.insertion_mm - from.insertion_mm) < kRelaxes_mm &&
                       std::abs(to.rotation_rad - from.rotation_rad) < kRelaxes_rad;
  return !at_rest;
}

// False in a gap: the axes are then left where they were before it.
bool NeedleEstimator::interpolate(std::size_t index) {
  Node& n = node(index);
  std::size_t before = index - 1;
  while (before > 0 && node(before).kind != Kind::actuator) --before;
  const Node& a = node(before);
  n.insertion_mm = a.insertion_mm;
  n.rotation_rad = a.rotation_rad;
  n.axes = node(index - 1).axes;
  if (n.utime == a.utime) return true;  // needs no later actuator state
  std::size_t after = index + 1;
  while (node(after).kind != Kind::actuator) ++after;
  const Node& b = node(after);
  if (is_gap(n.axes, b.axes)) return false;
  const double share = static_cast<double>(n.utime - a.utime) / static_cast<double>(b.utime - a.utime);
  n.insertion_mm += share * (b.insertion_mm - a.insertion_mm);
  n.rotation_rad += share * (b.rotation_rad - a.rotation_rad);
  return true;
}

void NeedleEstimator::process_from(std::size_t index) {
  std::size_t end = order_.size();
  while (end > 0 && node(end - 1).kind != Kind::actuator) --end;
  while (end > 0 && end < order_.size() && node(end).utime == node(end - 1).utime) ++end;
  for (std::size_t i = std::max<std::size_t>(index, 1); i < end; ++i) {
    Node& n = node(i);
    const Node& previous = node(i - 1);
    const bool known = n.kind == Kind::actuator || interpolate(i);
    n.state = previous.state;
    if (!known) {
      n.moved = {};
      n.update = {};
      if (!std::exchange(n.counted_in_gap, true)) ++counters_of(n.kind).in_gap;
      continue;
    }
    const double insertion_mm = n.insertion_mm - previous.insertion_mm;
    const double rotation_rad = n.rotation_rad - previous.rotation_rad;
    if (n.kind == Kind::actuator && is_gap(previous.axes, n.axes))
      filter_.pass_gap(n.state, insertion_mm, rotation_rad, static_cast<double>(n.utime - previous.axes.utime) * 1e-6,
                       n.utime);
    else
      filter_.predict(n.state, insertion_mm, rotation_rad, static_cast<double>(n.utime - previous.utime) * 1e-6);
    n.moved = {n.state.pose.p_mm - previous.state.pose.p_mm, n.state.pose.R.col(2) - previous.state.pose.R.col(2),
               filter_.motion_of(n.state) - filter_.motion_of(previous.state)};
    if (n.kind == Kind::actuator) continue;
    const bool position = n.kind == Kind::position;
    const auto apply = [&] {
      n.update = position ? filter_.update(n.state, n.measurement) : filter_.update(n.state, n.heading);
    };
    if (observer_ && !n.applied_before) {
      Applied applied{
          n.utime, n.camera, n.state, {}, position ? &n.measurement : nullptr, position ? nullptr : &n.heading};
      apply();
      applied.update = n.update;
      observer_(observer_context_, applied);
    } else {
      apply();
    }
    if (n.rejects_forgotten && !n.update.accepted && !n.update.reset) {
      n.state.rejects_in_row = previous.state.rejects_in_row;
      n.state.camera_rejects_in_row = previous.state.camera_rejects_in_row;
      n.state.heading_rejects_in_row = previous.state.heading_rejects_in_row;
    }
    n.applied_before = true;
    if (position && n.utime >= newest_update_utime_) newest_update_ = n.update, newest_update_utime_ = n.utime;
  }
  processed_ = std::max<std::size_t>(end, order_.empty() ? 0 : 1);
}

Estimate NeedleEstimator::estimate(std::int64_t now_utime) const {
  if (processed_ == 0) {
    Estimate nothing;
    nothing.health = kNoMeasurement | kActuatorStale;
    return nothing;
  }
  const Node& newest = node(processed_ - 1);
  return describe(newest.state, newest.utime, newest_update_, now_utime);
}

Estimate NeedleEstimator::estimate_ahead(const model::ActuatorState& axes, std::int64_t now_utime) const {
  if (processed_ == 0 || axes.utime <= node(order_.size() - 1).utime) return estimate(now_utime);
  const Node& from = node(processed_ - 1);
  FilterState state = from.state;
  Update newest_update = newest_update_;
  std::int64_t utime = from.utime;
  double insertion_mm = from.insertion_mm, rotation_rad = from.rotation_rad;
  const auto predict_to = [&](std::int64_t to_utime) {
    const double share = static_cast<double>(to_utime - utime) / static_cast<double>(axes.utime - utime);
    const double by_mm = share * (axes.insertion_mm - insertion_mm),
                 by_rad = share * (axes.rotation_rad - rotation_rad);
    filter_.predict(state, by_mm, by_rad, static_cast<double>(to_utime - utime) * 1e-6);
    insertion_mm += by_mm, rotation_rad += by_rad;
    utime = to_utime;
  };
  for (std::size_t i = processed_; i < order_.size(); ++i) {
    const Node& n = node(i);
    predict_to(n.utime);
    if (n.kind == Kind::heading)
      filter_.update(state, n.heading);
    else
      newest_update = filter_.update(state, n.measurement);
  }
  predict_to(axes.utime);
  return describe(state, axes.utime, newest_update, now_utime);
}

Estimate NeedleEstimator::describe(const FilterState& state, std::int64_t utime, const Update& newest_update,
                                   std::int64_t now_utime) const {
  Estimate result;
  const HealthLimits& limits = filter_.config().limits;
  result.utime = utime;
  result.state = state;
  result.tip = filter_.tip_pose(state);
  result.newest_update = newest_update;
  result.health = kHealthy;
  const auto older_than = [now_utime](std::int64_t stamp, double limit_s) {
    return model::age_s(now_utime, stamp) > limit_s;
  };
  if (older_than(node(processed_ - 1).utime, limits.actuator_age_s)) result.health |= kActuatorStale;
  if (state.measurement_utime == 0) {
    result.health |= kNoMeasurement;
  } else if (older_than(state.reading_utime, limits.measurement_age_s)) {
    result.health |= kMeasurementStale;
  }
  const double largest_variance = state.covariance.diagonal().head<3>().maxCoeff();
  if (!(largest_variance < limits.position_sd_mm * limits.position_sd_mm)) result.health |= kUncertain;
  if (!(largest_tilt_variance(state) < square(limits.heading_sd_rad))) result.health |= kHeadingUncertain;
  const Gate& gate = filter_.config().gate;
  const Rejects rejects = rejects_in_row(state, now_utime);
  if (std::max(rejects.of_all, rejects.of_one) >= gate.rejects_before_unhealthy)
    result.health |= kRejecting;
  else if (rejects.of_one >= gate.rejects_before_unsure)
    result.health |= kUnsure;
  if (state.outside_model) result.health |= kOutsideModel;
  constexpr std::int32_t kUntilKnown = kNoMeasurement | kUncertain | kHeadingUncertain;
  if ((result.health & kUntilKnown) != 0 || model::age_us(now_utime, state.reset_utime) < kResetReported_us)
    result.health |= reset_bit(state.reset_cause);
  return result;
}

}  // namespace bevel::estimator
