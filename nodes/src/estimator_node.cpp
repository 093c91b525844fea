// SPDX-License-Identifier: MIT
#include <bevel/nodes/estimator_node.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <bevel/estimator/health.hpp>
#include <bevel/model/age.hpp>
#include <bevel/nodes/needle_pose.hpp>

namespace bevel::nodes {
namespace {

constexpr double kPeriod_s = 0.01;
constexpr std::int64_t kDescribed_ns = 500'000'000;
constexpr std::int64_t kResetShown_us = 5'000'000;  // the cause of a reset in the status, long enough to be read
constexpr double kFastestCamera_hz = 1000, kFastestCycle_hz = 1200;
// How late a picture may be and still count; the history of the filter is shorter at 100 Hz.
constexpr std::int64_t kLatestPicture_us = 600'000;

io::SenderLimits tip_limits(const estimator::HealthLimits& limits) {
  return {.longest_age_us = kLatestPicture_us,
          .fastest_hz = kFastestCamera_hz,
          .silence_us = std::llround(limits.measurement_silence_s * 1e6),
          .reorder_us = kLatestPicture_us};
}

io::SenderLimits axes_limits(const estimator::HealthLimits& limits) {
  const auto age_us = std::llround(limits.actuator_age_s * 1e6);
  return {.longest_age_us = age_us, .fastest_hz = kFastestCycle_hz, .silence_us = age_us};
}

estimator::EstimatorConfig live(estimator::EstimatorConfig config, const io::MotionBounds& bounds) {
  config.start_at_axes = true;
  config.axes.gap_s = config.limits.actuator_age_s;
  config.axes.insertion_rate_mm_s = bounds.insertion_rate_mm_s;
  config.axes.rotation_rate_rad_s = bounds.rotation_rate_rad_s;
  return config;
}

}  // namespace

std::string describe(const estimator::EntryLine& entry) {
  if (!entry.is_turned()) return "";
  constexpr double kDegrees = 180 / std::numbers::pi;
  std::array<char, 160> text{};
  std::snprintf(
      text.data(), text.size(),
      "the needle goes in %.1f degrees (x) and %.1f (y) off the frame's z, each +- %.1f: camera frame or guide turned",
      kDegrees * entry.slope().x(), kDegrees * entry.slope().y(), kDegrees * entry.slope_sd());
  return text.data();
}

std::string describe(const estimator::InnovationWatch& innovations) {
  std::string text, too_large;
  for (const auto& [camera, channel] : innovations.channels()) {
    std::array<char, 64> one{};
    std::snprintf(one.data(), one.size(), "%s%.1f (camera %d)", text.empty() ? "innovations " : ", ", channel.ratio(),
                  camera);
    text += one.data();
    if (channel.is_too_large()) too_large += (too_large.empty() ? " " : ", ") + std::to_string(camera);
  }
  if (too_large.empty()) return text;
  return text + " of what is expected: too large of camera" + too_large +
         ": a camera or the needle model does not match the system file; check the calibration, [needle] and "
         "[estimator.prior] bending_mm, bending_sd_mm, guide_mm (docs/steering.md)";
}

std::string describe(const estimator::Nuisance& nuisance) {
  std::string text;
  std::array<char, 160> one{};
  const auto sd = [&nuisance](int i) { return std::sqrt(nuisance.covariance(i, i)); };
  const auto add = [&] { text += (text.empty() ? "" : ", ") + std::string(one.data()); };
  if (const int w = estimator::kWindup; sd(w) > 0) {
    std::snprintf(one.data(), one.size(), "wind-up %.2f +- %.2f rad at 100 mm", nuisance.mean[w], sd(w));
    add();
  }
  for (int camera = 0; camera < estimator::kLateCameras; ++camera) {
    if (const int l = estimator::latency_of(camera); sd(l) > 0) {
      std::snprintf(one.data(), one.size(), "camera %d late by %.0f +- %.0f ms", camera, 1e3 * nuisance.mean[l],
                    1e3 * sd(l));
      add();
    }
  }
  return text;
}

needle_state_t to_message(const estimator::Estimate& estimate, std::int64_t seq) {
  needle_state_t m{};
  const estimator::FilterState& s = estimate.state;
  m.utime = estimate.utime;
  m.seq = seq;
  m.measurement_utime = s.measurement_utime;
  write_pose(estimate.tip, m);
  m.curvature_per_mm = s.curvature_per_mm;
  m.lambda1_per_rad = s.lambda1_per_rad;
  m.lambda2 = s.lambda2;
  for (int r = 0; r < 9; ++r)
    for (int c = 0; c < 9; ++c) m.covariance[9 * r + c] = s.covariance(r, c);
  m.test_ratio = estimate.newest_update.test_ratio;
  m.rank = estimate.newest_update.rank;
  m.health = estimate.health;
  m.reset_count = s.reset_count;
  return m;
}

namespace {

needle_shaft_t shaft_message(const estimator::Estimate& estimate, double guide_mm, std::int64_t seq) {
  needle_shaft_t m{};
  m.utime = estimate.utime;
  m.seq = seq;
  m.bending_mm = estimate.state.bending_mm;
  m.bending_sd_mm = std::sqrt(estimate.state.tenth_variance);
  m.guide_mm = guide_mm;
  return m;
}

}  // namespace

EstimatorNode::EstimatorNode(lcm::LCM& lcm, const estimator::EstimatorConfig& config, const io::MotionBounds& bounds)
    : bounds_(bounds),
      port_(lcm),
      estimator_(live(config, bounds)),
      entry_line_(entry_line_config(live(config, bounds))),
      status_(port_, "bevel-estimator", kPeriod_s),
      words_(port_, status_, Receiver::estimator, [this](Word word, const steering_target_t&) { on_word(word); }),
      cameras_(config.limits.measurement_silence_s),
      headings_(config.limits.measurement_silence_s) {
  estimator_.observe(
      [](void* context, const estimator::NeedleEstimator::Applied& applied) {
        if (applied.measurement)
          static_cast<estimator::InnovationWatch*>(context)->see(applied.camera, applied.utime,
                                                                 applied.update.mahalanobis2, applied.update.rank);
      },
      &innovations_);
  port_.on_trouble = [this](const InputTrouble& trouble) { on_trouble(trouble); };
  port_.subscribe<tip_measurement_t>(io::channel::kTipMeasurement, tip_limits(config.limits),
                                     [this](const tip_measurement_t& m) { on_tip(m); });
  port_.subscribe<tip_heading_t>(io::channel::kTipHeading, tip_limits(config.limits),
                                 [this](const tip_heading_t& m) { on_heading(m); });
  port_.subscribe<actuator_state_t>(
      io::channel::kActuatorState, axes_limits(config.limits), [this](const actuator_state_t& m) { on_axes(m); },
      io::axes_check(bounds));
}

void EstimatorNode::on_axes(const actuator_state_t& m) {
  // A sequence that begins anew is that of a restarted driver, which has another zero. A jump is a new zero too: axes
  // that are off do not move, and a jump of others arrives here only after an operator has armed. The estimate begins
  // at the reported position.
  const bool new_zero = axes_ && (m.seq < axes_->seq || io::check_jump(*axes_, m, bounds_));
  axes_ = m;
  if (new_zero) entry_.restart();
  if (entry_.see_axes(m.insertion_mm) || new_zero) restart();
  const model::ActuatorState axes = io::to_sample(m);
  estimator_.add(axes);
  entry_line_.add(axes);
  publish(estimator_.estimate(port_.now().utime));
}

void EstimatorNode::on_tip(const tip_measurement_t& m) {
  cameras_.hear(m, axes_ ? axes_->insertion_mm : 0, port_.now().ns);
  if (m.status == 0 && m.information_per_mm2[8] > 0) entry_.see_tip(m.position_mm[2]);
  const model::TipMeasurement measurement = io::to_sample(m);
  estimator_.add(measurement);
  entry_line_.add(measurement);
  publish_evidence();
}

void EstimatorNode::on_heading(const tip_heading_t& m) {
  headings_.hear(m, axes_ ? axes_->insertion_mm : 0, port_.now().ns);
  estimator_.add(io::to_sample(m));
  publish_evidence();
}

void EstimatorNode::restart() {
  estimator_.restart();
  entry_line_.restart();
  innovations_.restart();
}

void EstimatorNode::on_word(Word word) {
  switch (word) {
    case Word::arm:
    case Word::arm_to_retract:
      break;
    case Word::entry:
      restart();
      entry_.restart();
      break;
    case Word::confirm:
      entry_.confirm();
      break;
    case Word::stop:
    case Word::start:
    case Word::hold:
    case Word::follow:
    case Word::way_point:
    case Word::retract:
      return;  // of motion
  }
  port_.forget_senders();
  cameras_.restart();
  headings_.restart();
  estimator_.forget_rejects();
  input_refused_ = false;
  remark_.clear();
}

void EstimatorNode::on_trouble(const InputTrouble& trouble) {
  if (trouble.kind == InputTrouble::Kind::clock_step) {
    const std::int64_t step_us = std::llround(trouble.clock_step_s * 1e6);
    estimator_.shift_time(step_us);
    published_utime_ += step_us;
  } else {
    if (input_refused_) return;  // the first reason stays
    input_refused_ = true;
    status_.renew_session();
  }
  remark_ = describe(trouble);
}

std::int32_t EstimatorNode::health() const {
  std::int32_t health = estimator_.estimate(port_.now().utime).health | cameras_.health(port_.now().ns);
  // The estimate stands without headings: that they fall silent is no reason to stop, that they are false is.
  health |= headings_.health(port_.now().ns) & estimator::kCameraFrozen;
  if (axes_ && !entry_.from_entry()) health |= estimator::kNotFromEntry;
  if (input_refused_) health |= estimator::kInputRefused;
  return health;
}

void EstimatorNode::publish_evidence() {
  if (!axes_) return;
  const std::int64_t now_utime = port_.now().utime;
  const double ahead_s = model::age_s(now_utime, axes_->utime);
  if (!(ahead_s <= estimator_.filter().config().limits.actuator_age_s)) return;  // rates of then say nothing of now
  model::ActuatorState axes = io::to_sample(*axes_);
  axes.utime = now_utime;
  axes.insertion_mm += axes.insertion_rate_mm_s * ahead_s;
  axes.rotation_rad += axes.rotation_rate_rad_s * ahead_s;
  publish(estimator_.estimate_ahead(axes, now_utime));
}

void EstimatorNode::publish(estimator::Estimate estimate) {
  if (estimate.utime <= published_utime_) return;
  published_utime_ = estimate.utime;
  estimate.health = health();
  // First: who acts on the state knows the shaft by then.
  if (const double guide_mm = estimator_.filter().config().prior.guide_mm; estimate.state.bending_mm > 0)
    port_.publish(io::channel::kNeedleShaft, shaft_message(estimate, guide_mm, seq_));
  port_.publish(io::channel::kNeedleState, to_message(estimate, seq_++));
}

void EstimatorNode::step(const Now& now) {
  port_.tell_time(now);
  port_.rethrow();
  if (status_.name_taken() && !input_refused_) {
    input_refused_ = true;
    status_.renew_session();
    remark_ = "another bevel-estimator is heard on this network";
  }
  if (now.ns - described_ns_ >= kDescribed_ns) {  // numbers that change all the time
    innovations_.forget_silent(now.utime);
    innovation_text_ = describe(innovations_);
    entry_text_ = describe(entry_line_);
    nuisance_text_ = describe(estimator_.estimate(now.utime).state.nuisance);
    described_ns_ = now.ns;
  }
  const estimator::FilterState state = estimator_.estimate(now.utime).state;
  const bool is_shown = model::age_us(now.utime, state.reset_utime) < kResetShown_us;
  std::string reason = estimator::describe_health(health() | (is_shown ? estimator::reset_bit(state.reset_cause) : 0));
  for (const std::string& more : {innovation_text_, entry_text_, nuisance_text_, remark_, words_.refusal()})
    if (!more.empty()) reason += "; " + more;
  status_.report(axes_ ? io::ProcessState::running : io::ProcessState::waiting, reason);
}

}  // namespace bevel::nodes
