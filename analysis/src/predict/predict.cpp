// SPDX-License-Identifier: MIT
#include <bevel/analysis/predict/predict.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numbers>
#include <numeric>
#include <ostream>

#include <bevel/cli/exit_status.hpp>
#include <bevel/error.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/io/recording.hpp>
#include <bevel/io/second_insertion.hpp>
#include <bevel/model/effects/prediction_spread.hpp>

namespace bevel::analysis {
namespace {

// For the message alone: how far the needle gets.
[[noreturn]] void fail_in_domain(const model::AugmentedNeedle& needle, const model::Motion& motion) {
  model::AugmentedState state = needle.entry(motion.nodes.front());
  std::size_t i = 1;
  while (i < motion.nodes.size() && needle.advance(state, motion.nodes[i])) ++i;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "the needle leaves the domain of the slip law (25) %.3f s after the first actuator sample, at "
                "%.1f mm of insertion with its heading %.0f degrees off z",
                state.base.time_s, state.base.insertion_mm, model::tilt_rad(state.pose) * 180 / std::numbers::pi);
  throw DomainError(text.data());
}

// The log in order of time.
struct Ordered {
  model::Motion motion;
  std::vector<std::size_t> order;  // of the measurements
  std::vector<std::int64_t> utimes;
};

template <class Measurement>
Ordered in_order(std::span<const model::ActuatorState> actuators, std::span<const Measurement> tips) {
  if (actuators.empty()) throw ArgumentError("no ACTUATOR_STATE: nothing tells how the base moved");
  if (tips.empty()) throw ArgumentError("no TIP_MEASUREMENT: nothing tells for when to predict");
  const auto by_utime = [](const auto& a, const auto& b) { return a.utime < b.utime; };
  std::vector<model::ActuatorState> sorted(actuators.begin(), actuators.end());
  std::stable_sort(sorted.begin(), sorted.end(), by_utime);
  Ordered log;
  log.order.resize(tips.size());
  std::iota(log.order.begin(), log.order.end(), 0);
  std::stable_sort(log.order.begin(), log.order.end(), [&](auto a, auto b) { return by_utime(tips[a], tips[b]); });
  for (const auto i : log.order) log.utimes.push_back(tips[i].utime);
  log.motion = model::make_motion(sorted, log.utimes);
  return log;
}

}  // namespace

std::vector<Prediction> predict(const model::AugmentedNeedle& needle, std::span<const model::ActuatorState> actuators,
                                std::span<const model::TipMeasurement> tips) {
  const Ordered log = in_order<model::TipMeasurement>(actuators, tips);
  model::OpenLoop path;
  if (!model::predict(needle, log.motion, path)) fail_in_domain(needle, log.motion);
  std::vector<Prediction> predictions(tips.size());
  for (std::size_t i = 0; i < log.order.size(); ++i) predictions[log.order[i]] = {log.utimes[i], path.position_mm[i]};
  return predictions;
}

std::vector<Eigen::Vector3d> standard_deviations_mm(const io::ModelFile& model, const std::string& log_path,
                                                    std::span<const model::ActuatorState> actuators,
                                                    std::span<const model::TipMeasurement> tips) {
  const Ordered log = in_order<model::TipMeasurement>(actuators, tips);
  const auto covariances =
      model::reading_covariances(model.needle, io::active_effects(model.effects, log_path), model.discrepancies,
                                 model.variation.value_or(model::Variation{}), log.motion);
  std::vector<Eigen::Vector3d> out(tips.size());
  for (std::size_t i = 0; i < log.order.size(); ++i)
    out[log.order[i]] = covariances[i].diagonal().cwiseMax(0).cwiseSqrt();
  return out;
}

std::vector<HeadingResidual> heading_residuals(const model::AugmentedNeedle& needle,
                                               std::span<const model::ActuatorState> actuators,
                                               std::span<const model::TipHeading> headings) {
  std::vector<model::TipHeading> good;
  std::copy_if(headings.begin(), headings.end(), std::back_inserter(good),
               [](const model::TipHeading& heading) { return heading.status == 0; });
  if (good.empty()) return {};
  const Ordered log = in_order<model::TipHeading>(actuators, good);
  model::OpenLoop path;
  if (!model::predict(needle, log.motion, path, true)) fail_in_domain(needle, log.motion);
  constexpr double kMrad = 1e3;
  std::vector<HeadingResidual> out;
  for (std::size_t i = 0; i < log.order.size(); ++i) {
    const Eigen::Vector3d off = good[log.order[i]].heading - path.heading[i];
    out.push_back({.utime = log.utimes[i], .x_mrad = kMrad * off.x(), .y_mrad = kMrad * off.y()});
  }
  return out;
}

namespace {

// "TIP_HEADING: 21 readings, measured less predicted 1.2 mrad rms in x, 15.3 in y"
std::string summary_of(const std::vector<HeadingResidual>& residuals) {
  double x = 0, y = 0;
  for (const HeadingResidual& one : residuals) x += one.x_mrad * one.x_mrad, y += one.y_mrad * one.y_mrad;
  const auto n = static_cast<double>(residuals.size());
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(),
                "TIP_HEADING: %zu readings, measured less predicted %.1f mrad rms in x, %.1f in y\n", residuals.size(),
                std::sqrt(x / n), std::sqrt(y / n));
  return text.data();
}

// Of the heading taken at that moment; empty cells where there is none.
std::string cells_of(const std::vector<HeadingResidual>& residuals, std::int64_t utime) {
  const auto at = std::lower_bound(residuals.begin(), residuals.end(), utime,
                                   [](const HeadingResidual& one, std::int64_t when) { return one.utime < when; });
  if (at == residuals.end() || at->utime != utime) return ",,";
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), ",%.4f,%.4f", at->x_mrad, at->y_mrad);
  return text.data();
}

}  // namespace

int run(const std::string& model_path, const std::string& log_path, std::ostream& out, std::ostream& err) {
  const io::ModelFile model = io::load_model_file(model_path);
  const io::Recording recording = io::read_recording(log_path);
  err << recording.remarks(log_path);
  io::require_usable(log_path, recording);
  io::require_one_insertion(log_path, recording.actuators);
  const model::AugmentedNeedle needle(model.needle, io::active_effects(model, log_path));
  const bool uncertain = model.variation.has_value() || !model.discrepancies.empty();
  std::vector<Prediction> predictions;
  std::vector<Eigen::Vector3d> sd_mm;
  std::vector<HeadingResidual> headings;
  try {
    predictions = predict(needle, recording.actuators, recording.tips);
    headings = heading_residuals(needle, recording.actuators, recording.headings);
    if (uncertain) sd_mm = standard_deviations_mm(model, log_path, recording.actuators, recording.tips);
  } catch (const std::exception& e) {
    throw ParseError(log_path + ": " + e.what());
  }
  if (!headings.empty()) err << summary_of(headings);
  out << "utime,x_mm,y_mm,z_mm" << (uncertain ? ",x_sd_mm,y_sd_mm,z_sd_mm" : "")
      << (headings.empty() ? "" : ",heading_x_residual_mrad,heading_y_residual_mrad") << '\n';
  std::array<char, 192> line{};
  for (std::size_t i = 0; i < predictions.size(); ++i) {
    const Prediction& p = predictions[i];
    std::snprintf(line.data(), line.size(), "%lld,%.6f,%.6f,%.6f", static_cast<long long>(p.utime), p.position_mm.x(),
                  p.position_mm.y(), p.position_mm.z());
    out << line.data();
    if (uncertain) {
      std::snprintf(line.data(), line.size(), ",%.6f,%.6f,%.6f", sd_mm[i].x(), sd_mm[i].y(), sd_mm[i].z());
      out << line.data();
    }
    if (!headings.empty()) out << cells_of(headings, p.utime);
    out << '\n';
  }
  if (!(out << std::flush)) throw IoError("the output cannot be written");
  return recording.intact() ? cli::kOk : cli::kDamagedInput;
}

}  // namespace bevel::analysis
