// SPDX-License-Identifier: MIT
#include <bevel/view/live_view.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include <bevel/estimator/health.hpp>
#include <bevel/io/process_state.hpp>

namespace bevel::view {

using json = nlohmann::json;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// Data this much newer than before belong to another insertion.
constexpr std::int64_t kGap_us = 10'000'000;
// Data this much older than before on the same channel (for measurements: of the same camera) belong to another
// playback. The stamps of one sender grow; messages that the network delays differ by less than a second.
constexpr std::int64_t kBackward_us = 1'000'000;
// A message this much older or newer than the clock was not made now: it is played back.
constexpr std::int64_t kPlayedBack_us = 5'000'000;
// Twenty rows a second for ten minutes; after that every second row of the older half goes.
constexpr std::size_t kMostRows = 12'000;
constexpr std::size_t kMostOfPath = 4'000;
// A rig has up to four cameras and seven processes. Numbers and names of other senders must not fill the memory.
constexpr std::size_t kMostCameras = 16;
constexpr std::size_t kMostProcesses = 32;
constexpr double kForgotten_s = 60;  // an entry without a message for so long makes place for a new one

// JSON has no NaN.
json figure(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

double age_s(const Moment& arrived, const Moment& now) { return static_cast<double>(now.ns - arrived.ns) * 1e-9; }

/// Returns whether `entries` has or can have an entry of that key; removes the oldest one where that is necessary.
template <class Entries>
bool make_place(Entries& entries, const typename Entries::key_type& key, std::size_t most, const Moment& now) {
  if (entries.size() < most || entries.contains(key)) return true;
  const auto oldest = std::ranges::min_element(entries, {}, [](const auto& entry) { return entry.second.arrived.ns; });
  if (age_s(oldest->second.arrived, now) < kForgotten_s) return false;
  entries.erase(oldest);
  return true;
}

template <class Container>
void thin(Container& values) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < values.size(); i += 2) values[kept++] = values[i];
  values.resize(kept);
}

Eigen::Matrix3d rotation_of(const needle_state_t& m) {
  const double* q = m.orientation_wxyz;
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

// Row-major, mm^2, in {A}; the message has it in the body's frame.
json position_covariance(const needle_state_t& m) {
  Eigen::Matrix3d P;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) P(i, j) = m.covariance[9 * i + j];
  const Eigen::Matrix3d R = rotation_of(m);
  const Eigen::Matrix3d in_a = R * P * R.transpose();
  json all = json::array();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) all.push_back(figure(in_a(i, j)));
  return all;
}

double sd_of(const needle_state_t& m, int i) {
  return std::sqrt(std::max(0.0, m.covariance[10 * static_cast<std::ptrdiff_t>(i)]));
}

json needle_json(const needle_state_t& m) {
  const Eigen::Vector3d heading = rotation_of(m).col(2);
  return {{"position_mm", m.position_mm},
          {"heading", {heading.x(), heading.y(), heading.z()}},
          {"covariance_mm2", position_covariance(m)},
          {"curvature_per_mm", m.curvature_per_mm},
          {"curvature_sd_per_mm", sd_of(m, 6)},
          {"lambda1_per_rad", m.lambda1_per_rad},
          {"lambda1_sd_per_rad", sd_of(m, 7)},
          {"lambda2", m.lambda2},
          {"lambda2_sd", sd_of(m, 8)},
          {"test_ratio", m.test_ratio},
          {"rank", m.rank},
          {"health", m.health == 0 ? "healthy" : estimator::describe_health(m.health)},
          {"healthy", estimator::lost(m.health) == 0},
          {"resets", m.reset_count}};
}

const char* name_of_axis_status(std::int32_t status) {
  constexpr const char* kNames[] = {"off", "ready", "enabled", "quick stop", "fault"};
  return status >= 0 && status < 5 ? kNames[status] : "unknown";
}

}  // namespace

template <class Message>
void LiveView::take(std::optional<Newest<Message>>& newest, const Message& message, const Moment& now) {
  newest = Newest<Message>{message, now, newest ? newest->count + 1 : 1};
}

template <class Key, class Message>
void LiveView::take(std::map<Key, Newest<Message>>& newest, const Key& key, const Message& message, const Moment& now) {
  const auto found = newest.find(key);
  const std::int64_t count = found == newest.end() ? 1 : found->second.count + 1;
  newest.insert_or_assign(key, Newest<Message>{message, now, count});
}

void LiveView::on_config() { is_new_config_ = true; }

void LiveView::begin_anew_if(std::int64_t utime, Source source, std::int32_t camera) {
  if (utime <= 0) return;
  std::int64_t& newest_of_source = newest_of_[{source, camera}];
  const bool another =
      first_utime_ == 0 || is_new_config_ || utime < newest_of_source - kBackward_us || utime > newest_utime_ + kGap_us;
  if (!another) {
    newest_of_source = std::max(newest_of_source, utime);
    newest_utime_ = std::max(newest_utime_, utime);
    return;
  }
  is_new_config_ = false;
  newest_of_.clear();
  newest_of_[{source, camera}] = first_utime_ = newest_utime_ = utime;
  ++beginnings_;
  rows_.clear();
  path_.clear();
  test_ratio_.clear();
  // Nothing of the insertion before is drawn. Counts of positions and pictures go on: pages recognise them by these.
  axes_.reset();
  command_.reset();
  needle_.reset();
  truth_.reset();
  target_.reset();
}

void LiveView::extend_path(const needle_state_t& m) {
  const std::array<double, 3> at{m.position_mm[0], m.position_mm[1], m.position_mm[2]};
  if (!path_.empty()) {
    const auto& last = path_.back();
    if (std::hypot(at[0] - last[0], at[1] - last[1], at[2] - last[2]) < path_step_mm_) return;
  }
  path_.push_back(at);
  if (path_.size() < kMostOfPath) return;
  thin(path_);
  path_step_mm_ *= 2;
}

void LiveView::on(const tip_measurement_t& message, const Moment& now) {
  begin_anew_if(message.utime, Source::tip, message.camera);
  if (make_place(tips_, message.camera, kMostCameras, now)) take(tips_, message.camera, message, now);
}

void LiveView::on(const actuator_state_t& message, const Moment& now) {
  begin_anew_if(message.utime, Source::axes);
  take(axes_, message, now);
  new_row_ = true;
}

void LiveView::on(const motion_command_t& message, const Moment& now) {
  begin_anew_if(message.utime, Source::command);
  take(command_, message, now);
}

void LiveView::on(const needle_state_t& message, const Moment& now) {
  begin_anew_if(message.utime, Source::needle);
  if (!needle_ || needle_->message.reset_count != message.reset_count) path_.clear();
  take(needle_, message, now);
  for (const auto& [camera, tip] : tips_)
    if (tip.message.utime == message.measurement_utime) test_ratio_[camera] = message.test_ratio;
  extend_path(message);
  new_row_ = true;
}

void LiveView::on(const steering_target_t& message, const Moment& now) {
  constexpr std::int32_t kSetTarget = 1;
  // As armed: a way-point and a target that moves carry places of their own, a stop has none.
  if (message.request != kSetTarget) return;
  begin_anew_if(message.utime, Source::target);
  take(target_, message, now);
}

void LiveView::on(const process_status_t& message, const Moment& now) {
  if (make_place(processes_, message.process, kMostProcesses, now)) take(processes_, message.process, message, now);
}

void LiveView::on(const camera_picture_t& message, const Moment& now) {
  if (make_place(pictures_, message.camera, kMostCameras, now)) take(pictures_, message.camera, message, now);
}

std::string LiveView::picture(std::int32_t camera, std::int64_t count) const {
  const auto found = pictures_.find(camera);
  if (found == pictures_.end() || found->second.count != count) return "";
  const auto& jpeg = found->second.message.jpeg;
  return {jpeg.begin(), jpeg.end()};
}

void LiveView::on_truth(const needle_state_t& message, const Moment& now) {
  begin_anew_if(message.utime, Source::truth);
  take(truth_, message, now);
}

LiveView::Row LiveView::row_now() const {
  Row row{static_cast<double>(newest_utime_ - first_utime_) * 1e-6, {}};
  row.values.fill(kNone);
  auto& v = row.values;
  if (command_) {
    const bool run = command_->message.mode != 0;
    v[0] = run ? command_->message.insertion_rate_mm_s : 0;
    v[2] = run ? command_->message.rotation_rate_rad_s : 0;
  }
  if (axes_) {
    v[1] = axes_->message.insertion_rate_mm_s;
    v[3] = axes_->message.rotation_rate_rad_s;
  }
  if (needle_) {
    v[4] = needle_->message.curvature_per_mm;
    v[5] = needle_->message.lambda1_per_rad;
    v[6] = needle_->message.lambda2;
    if (target_) {
      const double* p = needle_->message.position_mm;
      const double* t = target_->message.position_mm;
      v[7] = std::hypot(p[0] - t[0], p[1] - t[1], p[2] - t[2]);
    }
  }
  std::size_t at = 8;
  for (const auto& [camera, ratio] : test_ratio_)
    if (at < v.size()) v[at++] = ratio;
  return row;
}

namespace {
bool moves(std::int32_t state_code) {
  const auto state = static_cast<io::ProcessState>(state_code);
  return state == io::ProcessState::steering || state == io::ProcessState::retracting;
}
}  // namespace

std::string LiveView::snapshot(const Moment& now) {
  json j;
  j["insertion"] = beginnings_;
  j["played_back"] = newest_utime_ != 0 && std::abs(newest_utime_ - now.utime) > kPlayedBack_us;
  j["utime"] = newest_utime_;
  json& ages = j["age_s"] = json::object();
  if (needle_) {
    j["needle"] = needle_json(needle_->message);
    ages["needle"] = age_s(needle_->arrived, now);
  }
  if (truth_) {
    j["truth_mm"] = truth_->message.position_mm;
    ages["truth"] = age_s(truth_->arrived, now);
  }
  if (axes_) {
    const auto& m = axes_->message;
    j["axes"] = {{"insertion_mm", m.insertion_mm},
                 {"insertion_rate_mm_s", m.insertion_rate_mm_s},
                 {"rotation_rad", m.rotation_rad},
                 {"rotation_rate_rad_s", m.rotation_rate_rad_s},
                 {"status", {name_of_axis_status(m.axis_status[0]), name_of_axis_status(m.axis_status[1])}}};
    ages["axes"] = age_s(axes_->arrived, now);
  }
  if (command_) {
    j["command"] = {{"run", command_->message.mode != 0},
                    {"insertion_rate_mm_s", command_->message.insertion_rate_mm_s},
                    {"rotation_rate_rad_s", command_->message.rotation_rate_rad_s}};
    ages["command"] = age_s(command_->arrived, now);
  }
  if (target_)
    j["target"] = {{"position_mm", target_->message.position_mm}, {"tolerance_mm", target_->message.tolerance_mm}};
  json& tips = j["tips"] = json::array();
  for (const auto& [camera, tip] : tips_) {
    const auto& m = tip.message;
    const std::array<double, 3> seen{m.information_per_mm2[0], m.information_per_mm2[4], m.information_per_mm2[8]};
    json position = json::array();  // null along an axis that the camera does not see
    for (int i = 0; i < 3; ++i)
      position.push_back(m.status == 0 && seen[i] > 0 ? figure(m.position_mm[i]) : json(nullptr));
    const auto ratio = test_ratio_.find(camera);
    tips.push_back({{"camera", camera},
                    {"status", m.status},
                    {"position_mm", position},
                    {"count", tip.count},
                    {"age_s", age_s(tip.arrived, now)},
                    {"test_ratio", ratio == test_ratio_.end() ? json(nullptr) : figure(ratio->second)}});
  }
  json& pictures = j["pictures"] = json::array();
  for (const auto& [camera, picture] : pictures_) {
    const auto& m = picture.message;
    pictures.push_back({{"camera", camera},
                        {"count", picture.count},
                        {"width_px", m.width_px},
                        {"height_px", m.height_px},
                        {"tip_px", m.status == 0 ? json(m.tip_px) : json(nullptr)},
                        {"age_s", age_s(picture.arrived, now)}});
  }
  json& processes = j["processes"] = json::array();
  for (const auto& [name, status] : processes_) {
    const auto& m = status.message;
    processes.push_back({{"name", name},
                         {"state", m.state},
                         {"stopped", io::is_latched_stop(m.state_code)},
                         {"moves", moves(m.state_code)},
                         {"reason", m.reason},
                         {"run_max_ms", 1e3 * m.loop_run_max_s},
                         {"late_max_ms", 1e3 * m.loop_late_max_s},
                         {"overruns", m.overruns},
                         {"received", m.received},
                         {"rejected", m.rejected},
                         {"age_s", age_s(status.arrived, now)}});
  }
  if (new_row_) {
    new_row_ = false;
    rows_.push_back(row_now());
    if (rows_.size() > kMostRows) thin(rows_);
    json& row = j["row"] = json::array({rows_.back().t_s});
    for (const double v : rows_.back().values) row.push_back(figure(v));
  }
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string LiveView::history() const {
  json j;
  j["insertion"] = beginnings_;
  j["path_mm"] = path_;
  json& columns = j["rows"] = json::array();
  for (std::size_t c = 0; c < 1 + std::tuple_size_v<decltype(Row::values)>; ++c) {
    json column = json::array();
    for (const Row& row : rows_) column.push_back(figure(c == 0 ? row.t_s : row.values[c - 1]));
    columns.push_back(std::move(column));
  }
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace bevel::view
