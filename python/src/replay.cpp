// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <utility>

#include <bevel/error.hpp>
#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/io/live_effects.hpp>
#include <bevel/io/motion_gap.hpp>
#include "arrays.hpp"
#include "estimator.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "recording.hpp"

namespace bevel::python {
namespace {

using Integers = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 1>;

// One row per axis sample, and one per measured position.
struct Replay {
  Eigen::VectorXd time_s, insertion_mm, rotation_rad, curvature_per_mm, lambda1_per_rad, lambda2;
  Rows3 position_mm, position_sd_mm, heading;
  Integers health, reset_count;
  Eigen::VectorXd measured_s, mahalanobis2;
  Rows3 measured_mm, innovation_mm;
  Integers camera, rank;
  Eigen::Array<bool, Eigen::Dynamic, 1> accepted;
};

struct Row {
  double time_s = 0, insertion_mm = 0, rotation_rad = 0;
  Eigen::Vector3d curvature_and_slip, position_mm, position_sd_mm, heading;
  std::int32_t health = 0, reset_count = 0;
};
struct MeasuredRow {
  double time_s = 0;
  Eigen::Vector3d measured_mm, innovation_mm;
  std::int32_t camera = 0, rank = 0;
  double mahalanobis2 = 0;
  bool accepted = false;
};

struct Observed {
  const Recording* recording;
  const estimator::NeedleFilter* filter;
  std::vector<MeasuredRow>* rows;

  static void take(void* context, const estimator::NeedleEstimator::Applied& applied) {
    const Observed& self = *static_cast<Observed*>(context);
    if (applied.measurement == nullptr) return;
    const Eigen::Vector3d& measured = applied.measurement->position_mm;
    self.rows->push_back({self.recording->time_s(applied.utime), measured,
                          measured - self.filter->seen_position_mm(applied.state_before), applied.camera,
                          applied.update.rank, applied.update.mahalanobis2, applied.update.accepted});
  }
};

template <class Rows, class Member>
Eigen::VectorXd gather(const Rows& rows, Member member) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) out[static_cast<Eigen::Index>(i)] = rows[i].*member;
  return out;
}
template <class Rows, class Member>
Integers gather_integers(const Rows& rows, Member member) {
  Integers out(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) out[static_cast<Eigen::Index>(i)] = rows[i].*member;
  return out;
}
template <class Rows, class Member>
Rows3 gather_points(const Rows& rows, Member member) {
  Rows3 out(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = rows[i].*member;
  return out;
}

Replay assemble(const std::vector<Row>& rows, std::vector<MeasuredRow> measured) {
  std::ranges::stable_sort(measured, {}, &MeasuredRow::time_s);
  Replay out;
  out.time_s = gather(rows, &Row::time_s);
  out.insertion_mm = gather(rows, &Row::insertion_mm);
  out.rotation_rad = gather(rows, &Row::rotation_rad);
  const Rows3 needle = gather_points(rows, &Row::curvature_and_slip);
  out.curvature_per_mm = needle.col(0);
  out.lambda1_per_rad = needle.col(1);
  out.lambda2 = needle.col(2);
  out.position_mm = gather_points(rows, &Row::position_mm);
  out.position_sd_mm = gather_points(rows, &Row::position_sd_mm);
  out.heading = gather_points(rows, &Row::heading);
  out.health = gather_integers(rows, &Row::health);
  out.reset_count = gather_integers(rows, &Row::reset_count);
  out.measured_s = gather(measured, &MeasuredRow::time_s);
  out.measured_mm = gather_points(measured, &MeasuredRow::measured_mm);
  out.innovation_mm = gather_points(measured, &MeasuredRow::innovation_mm);
  out.camera = gather_integers(measured, &MeasuredRow::camera);
  out.rank = gather_integers(measured, &MeasuredRow::rank);
  out.mahalanobis2 = gather(measured, &MeasuredRow::mahalanobis2);
  out.accepted.resize(static_cast<Eigen::Index>(measured.size()));
  for (std::size_t i = 0; i < measured.size(); ++i) out.accepted[static_cast<Eigen::Index>(i)] = measured[i].accepted;
  return out;
}

Replay run(const Recording& recording, estimator::EstimatorConfig config, std::size_t history, Task& task) {
  constexpr std::size_t kReported = 1024;  // samples between two checks for an interrupt
  const io::Recording& data = *recording.data;
  std::vector<model::ActuatorState> sorted = data.actuators;
  std::ranges::stable_sort(sorted, {}, &model::ActuatorState::utime);
  if (sorted.empty()) throw ArgumentError(recording.name + ": has no axis sample; at least one is needed");
  if (config.axes.gap_s > 0 && sorted.size() > 1) config.axes.gap_s = io::longest_interval_s(sorted, config.axes.gap_s);
  estimator::NeedleEstimator needle(config, history);
  std::vector<Row> rows;
  std::vector<MeasuredRow> measured;
  Observed observed{&recording, &needle.filter(), &measured};
  needle.observe(&Observed::take, &observed);
  std::size_t count = 0;
  for (const io::Arrival& arrival : data.arrivals) {
    if (++count % kReported == 0) task.report("");
    if (arrival.channel == io::Arrival::Channel::tip) needle.add(data.tips[arrival.index]);
    if (arrival.channel == io::Arrival::Channel::heading) needle.add(data.headings[arrival.index]);
    if (arrival.channel != io::Arrival::Channel::actuator) continue;
    const model::ActuatorState& axes = data.actuators[arrival.index];
    needle.add(axes);
    const estimator::Estimate estimate = needle.estimate(axes.utime);
    if (estimate.utime != axes.utime) continue;
    const estimator::FilterState& state = estimate.state;
    const Eigen::Matrix3d& R = state.pose.R;
    const Eigen::Vector3d variance = (R * state.covariance.topLeftCorner<3, 3>() * R.transpose()).diagonal();
    rows.push_back({recording.time_s(axes.utime), axes.insertion_mm, axes.rotation_rad,
                    Eigen::Vector3d(state.curvature_per_mm, state.lambda1_per_rad, state.lambda2), estimate.tip.p_mm,
                    variance.cwiseMax(0).cwiseSqrt(), estimate.tip.R.col(2), estimate.health, state.reset_count});
  }
  return assemble(rows, std::move(measured));
}

Replay replay(const Recording& recording, const io::ModelFile& model, estimator::EstimatorConfig config,
              std::size_t history) {
  config = for_model(std::move(config), model);
  // A recording knows its own event times and phases.
  config.effects = io::active_effects(model, recording.name);
  return compute_interruptible(
      [recording, config = std::move(config), history](Task& task) { return run(recording, config, history, task); },
      nb::none());
}

}  // namespace

void bind_replay(nb::module_& m) {
  nb::class_<Replay>(m, "Replay", "Estimates along a recording, one row per axis sample, and its innovations.")
      .def_ro("time_s", &Replay::time_s, "Time since the first axis sample, s, shape (n,).")
      .def_ro("insertion_mm", &Replay::insertion_mm, "Insertion, mm, shape (n,).")
      .def_ro("rotation_rad", &Replay::rotation_rad, "Rotation, rad, shape (n,).")
      .def_ro("position_mm", &Replay::position_mm, "Estimated tip in {A}, mm, shape (n, 3).")
      .def_ro("position_sd_mm", &Replay::position_sd_mm, "Standard deviations along the axes of {A}, mm, shape (n, 3).")
      .def_ro("heading", &Replay::heading, "Estimated heading in {A}, unit vectors, shape (n, 3).")
      .def_ro("curvature_per_mm", &Replay::curvature_per_mm, "Estimated k, 1/mm, shape (n,).")
      .def_ro("lambda1_per_rad", &Replay::lambda1_per_rad, "Estimated lambda1, 1/rad, shape (n,).")
      .def_ro("lambda2", &Replay::lambda2, "Estimated lambda2, shape (n,).")
      .def_ro("health", &Replay::health, "Health bits, 0 healthy, shape (n,).")
      .def_ro("reset_count", &Replay::reset_count, "Declared resets so far, shape (n,).")
      .def_ro("measured_s", &Replay::measured_s, "Times of the measured positions, s, shape (m,).")
      .def_ro("measured_mm", &Replay::measured_mm, "Measured positions in {A}, mm, shape (m, 3).")
      .def_ro("innovation_mm", &Replay::innovation_mm,
              "Measured minus predicted position before the update, mm, shape (m, 3). It has no meaning along an axis "
              "that was not measured.")
      .def_ro("camera", &Replay::camera, "Camera of the position, shape (m,).")
      .def_ro("rank", &Replay::rank, "Number of axes that the position measured, shape (m,).")
      .def_ro("mahalanobis2", &Replay::mahalanobis2,
              "Squared Mahalanobis distance of the innovation, shape (m,); its mean is the rank if the model and the "
              "noise are right.")
      .def_ro("accepted", &Replay::accepted, "Whether the gate accepted the position, shape (m,).")
      .def("__len__", [](const Replay& r) { return r.time_s.size(); });
  m.def("replay", &replay, "recording"_a, "model"_a, "config"_a = estimator::EstimatorConfig{}, "history"_a = 64,
        nb::sig("def replay(recording: Recording, model: Model | Needle, config: EstimatorConfig = ..., "
                "history: int = 64) -> Replay"),
        "Runs the estimator over a recording in the order of arrival.\n\n"
        "Args:\n"
        "    recording: the recording.\n"
        "    model: means of the prior, and the effects.\n"
        "    config: settings of the estimator.\n"
        "    history: number of samples that are kept for late measurements.\n\n"
        "Raises:\n"
        "    KeyboardInterrupt: Ctrl-C was pressed.");
}

}  // namespace bevel::python
