// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <bevel/error.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/model/effects/open_loop.hpp>
#include <bevel/model/effects/prediction_spread.hpp>
#include "arrays.hpp"
#include "module.hpp"
#include "motion.hpp"
#include "recording.hpp"

namespace bevel::python {
namespace {

constexpr Eigen::Index kNeedleColumns = 4;

struct Prediction {
  Eigen::VectorXd time_s;
  Rows3 position_mm, heading;
  std::optional<Rows3> sd_mm;
  // 3 rows for each time, by k, lambda1, lambda2, ell.
  std::optional<Eigen::Matrix<double, Eigen::Dynamic, kNeedleColumns, Eigen::RowMajor>> jacobian;
};

[[noreturn]] void fail_in_domain(const model::AugmentedNeedle& needle, const model::Motion& motion) {
  model::AugmentedState state = needle.entry(motion.nodes.front());
  std::size_t i = 1;
  while (i < motion.nodes.size() && needle.advance(state, motion.nodes[i])) ++i;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "the needle leaves the domain of the slip law (Eq. 25) at %.3f s, %.1f mm of insertion, with its "
                "heading at %.0f degrees to z",
                state.base.time_s, state.base.insertion_mm, model::tilt_rad(state.pose) * 180 / std::numbers::pi);
  throw DomainError(text.data());
}

Prediction predict_at(const io::ModelFile& model, const std::string& log, const std::vector<model::ActuatorState>& axes,
                      const std::vector<std::int64_t>& utimes, bool with_jacobian) {
  const auto effects = io::active_effects(model, log);
  model::NeedleColumns columns;
  if (with_jacobian) columns.curvature = 0, columns.lambda1 = 1, columns.lambda2 = 2, columns.wheelbase = 3;
  const model::AugmentedNeedle needle(model.needle, effects, with_jacobian ? kNeedleColumns : 0, columns);
  const model::Motion motion = model::make_motion(axes, utimes);
  model::OpenLoop path;
  if (!model::predict(needle, motion, path, true)) fail_in_domain(needle, motion);
  Prediction out;
  out.position_mm = stack(path.position_mm);
  out.heading = stack(path.heading);
  if (with_jacobian) out.jacobian = path.jacobian;
  if (model.variation || !model.discrepancies.empty()) {
    const auto covariances =
        model::reading_covariances(model.needle, io::active_effects(model.effects, log), model.discrepancies,
                                   model.variation.value_or(model::Variation{}), motion);
    std::vector<Eigen::Vector3d> sd;
    for (const Eigen::Matrix3d& covariance : covariances) sd.push_back(covariance.diagonal().cwiseMax(0).cwiseSqrt());
    out.sd_mm = stack(sd);
  }
  return out;
}

Prediction predict_motion(const io::ModelFile& model, const AxisMotion& motion, const std::optional<Column>& at_s,
                          bool with_jacobian) {
  const Eigen::VectorXd times = at_s ? Eigen::VectorXd(*at_s) : motion.time_s;
  const std::vector<model::ActuatorState> axes = actuator_states(motion);
  std::vector<std::int64_t> utimes;
  for (const double time_s : times) utimes.push_back(utime_of(time_s));
  if (!std::ranges::is_sorted(utimes)) throw ArgumentError("at_s decreases; allowed: times in order");
  const nb::gil_scoped_release release;
  Prediction out = predict_at(model, "", axes, utimes, with_jacobian);
  out.time_s = times;
  return out;
}

Prediction predict_recording(const io::ModelFile& model, const Recording& recording, bool with_jacobian) {
  const nb::gil_scoped_release release;
  std::vector<model::ActuatorState> axes = recording.data->actuators;
  std::ranges::stable_sort(axes, {}, &model::ActuatorState::utime);
  std::vector<std::int64_t> utimes;
  for (const model::TipMeasurement& tip : recording.data->tips) utimes.push_back(tip.utime);
  if (axes.empty() || utimes.empty())
    throw ArgumentError(recording.name + ": has no axis sample or no position; both are needed");
  if (!std::ranges::is_sorted(utimes))
    throw ArgumentError(recording.name + ": positions are not in order of time; allowed: a log in order of time");
  Prediction out = predict_at(model, recording.name, axes, utimes, with_jacobian);
  out.time_s.resize(static_cast<Eigen::Index>(utimes.size()));
  for (std::size_t i = 0; i < utimes.size(); ++i)
    out.time_s[static_cast<Eigen::Index>(i)] = recording.time_s(utimes[i]);
  return out;
}

// Constant rates within each leg.
AxisMotion motion_from_legs(const nb::DRef<const Eigen::MatrixXd>& legs, double rate_hz) {
  constexpr double kSlowest_hz = 1e-3, kFastest_hz = 1e5;
  if (legs.cols() != 3 || legs.rows() == 0)
    throw ArgumentError("legs is " + std::to_string(legs.rows()) + " x " + std::to_string(legs.cols()) +
                        "; allowed: n x 3, n above 0: insertion_mm, rotation_rad, duration_s");
  if (!(rate_hz >= kSlowest_hz && rate_hz <= kFastest_hz))
    throw ArgumentError("rate_hz is " + std::to_string(rate_hz) + "; allowed: 0.001 to 100000");
  std::vector<Eigen::Vector3d> nodes{Eigen::Vector3d::Zero()};  // time, insertion, rotation
  for (Eigen::Index i = 0; i < legs.rows(); ++i) {
    const double duration_s = legs(i, 2);
    if (!(duration_s > 0) || !std::isfinite(duration_s))
      throw ArgumentError("duration of leg " + std::to_string(i) + " is " + std::to_string(duration_s) +
                          " s; allowed: above 0");
    const Eigen::Vector3d from = nodes.back();
    const double steps = std::max(1.0, std::round(duration_s * rate_hz));
    for (double step = 1; step <= steps; ++step)
      nodes.emplace_back(from + step / steps * Eigen::Vector3d(duration_s, legs(i, 0), legs(i, 1)));
  }
  const Rows3 all = stack(nodes);
  AxisMotion motion{all.col(0), all.col(1), all.col(2)};
  motion.validate();
  return motion;
}

void bind_motion(nb::module_& m) {
  nb::class_<AxisMotion>(m, "Motion", "Motion of the two axes: samples over time, linear in between.")
      .def(
          "__init__",
          [](AxisMotion* self, const Column& time_s, const Column& insertion_mm,
             const std::optional<Column>& rotation) {
            AxisMotion motion{time_s, insertion_mm,
                              rotation ? Eigen::VectorXd(*rotation) : Eigen::VectorXd::Zero(time_s.size()).eval()};
            motion.validate();
            new (self) AxisMotion(std::move(motion));
          },
          "time_s"_a, "insertion_mm"_a, "rotation_rad"_a = nb::none(),
          "Args:\n"
          "    time_s: increasing times, s, shape (n,), n at least 2. They are rounded to 1 us.\n"
          "    insertion_mm: insertion of the shaft past the entry point, mm, shape (n,).\n"
          "    rotation_rad: rotation of the shaft, rad, shape (n,); None: no rotation.\n\n"
          "Raises:\n"
          "    ValueError: lengths differ, a number is not finite, or times do not increase.")
      .def_static("from_legs", &motion_from_legs, "legs"_a, "rate_hz"_a = 100.0,
                  "Makes a motion of legs with constant rates, from insertion 0 and rotation 0 at 0 s.\n\n"
                  "Args:\n"
                  "    legs: increments of each leg, shape (n, 3): insertion_mm, rotation_rad, duration_s.\n"
                  "    rate_hz: samples per second.")
      .def_ro("time_s", &AxisMotion::time_s, "Times, s, shape (n,).")
      .def_ro("insertion_mm", &AxisMotion::insertion_mm, "Insertion, mm, shape (n,).")
      .def_ro("rotation_rad", &AxisMotion::rotation_rad, "Rotation, rad, shape (n,).")
      .def("__len__", [](const AxisMotion& motion) { return motion.time_s.size(); })
      .def("__repr__", [](const AxisMotion& motion) {
        std::array<char, 96> text{};
        std::snprintf(text.data(), text.size(), "<Motion: %lld samples, %.6g s, %.6g mm>",
                      static_cast<long long>(motion.time_s.size()), motion.time_s[motion.time_s.size() - 1],
                      motion.insertion_mm[motion.insertion_mm.size() - 1]);
        return std::string(text.data());
      });
}

}  // namespace

void AxisMotion::validate() const {
  const Eigen::Index n = time_s.size();
  if (n < 2 || insertion_mm.size() != n || rotation_rad.size() != n)
    throw ArgumentError("time_s, insertion_mm and rotation_rad have " + std::to_string(n) + ", " +
                        std::to_string(insertion_mm.size()) + " and " + std::to_string(rotation_rad.size()) +
                        " samples; allowed: the same number, at least 2");
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::string at = " of sample " + std::to_string(i);
    if (!std::isfinite(insertion_mm[i]) || !std::isfinite(rotation_rad[i]))
      throw ArgumentError("insertion or rotation" + at + " is not finite");
    if (i > 0 && utime_of(time_s[i]) <= utime_of(time_s[i - 1]))
      throw ArgumentError("time_s" + at + " is " + std::to_string(time_s[i]) + " s, after " +
                          std::to_string(time_s[i - 1]) + " s; allowed: later by 1 us or more");
  }
}

std::int64_t utime_of(double time_s) {
  constexpr double kLatest_s = 1e10;
  if (!(time_s >= 0 && time_s <= kLatest_s))
    throw ArgumentError("time is " + std::to_string(time_s) + " s; allowed: 0 to 1e10 s");
  return kZero_us + std::llround(time_s * 1e6);
}

std::vector<model::ActuatorState> actuator_states(const AxisMotion& motion) {
  std::vector<model::ActuatorState> states(static_cast<std::size_t>(motion.time_s.size()));
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    states[i].utime = utime_of(motion.time_s[at]);
    states[i].seq = static_cast<std::int64_t>(i) + 1;
    states[i].insertion_mm = motion.insertion_mm[at];
    states[i].rotation_rad = motion.rotation_rad[at];
  }
  return states;
}

void bind_prediction(nb::module_& m) {
  bind_motion(m);
  nb::class_<Prediction>(m, "Prediction", "Path of the tip as the model predicts it.")
      .def_ro("time_s", &Prediction::time_s, "Times, s, shape (n,).")
      .def_ro("position_mm", &Prediction::position_mm, "Tip in {A} as the cameras report it, mm, shape (n, 3).")
      .def_ro("heading", &Prediction::heading, "Heading in {A}, unit vectors, shape (n, 3).")
      .def_ro("sd_mm", &Prediction::sd_mm,
              "Standard deviations along the axes of {A}, mm, shape (n, 3); None where the model has neither a "
              "variation nor discrepancy terms.")
      .def_prop_ro(
          "jacobian",
          [](nb::handle self) -> nb::object {
            auto& jacobian = nb::cast<Prediction&>(self).jacobian;
            if (!jacobian) return nb::none();
            const std::size_t rows = static_cast<std::size_t>(jacobian->rows()) / 3;
            return nb::cast(nb::ndarray<nb::numpy, double, nb::shape<-1, 3, kNeedleColumns>>(
                                jacobian->data(), {rows, 3, static_cast<std::size_t>(kNeedleColumns)}, self),
                            nb::rv_policy::reference);
          },
          nb::sig("def jacobian(self) -> numpy.typing.NDArray[numpy.float64] | None"),
          "Derivatives of position_mm by curvature (mm^2), lambda1 (mm rad), lambda2 (mm) and wheelbase (1), shape "
          "(n, 3, 4); None unless asked for.")
      .def("__len__", [](const Prediction& p) { return p.time_s.size(); });
  m.def("predict", &predict_motion, "model"_a, "motion"_a, "at_s"_a = nb::none(), nb::kw_only(), "jacobian"_a = false,
        nb::sig("def predict(model: Model | Needle, motion: Motion, at_s: numpy.typing.NDArray[numpy.float64] | None = "
                "None, *, jacobian: bool = False) -> Prediction"),
        "Predicts the path of the tip from the motion of the axes alone.\n\n"
        "The first sample of the motion is the entry: the tip is at the origin of {A}, its heading along z.\n\n"
        "Args:\n"
        "    model: a Model, or a Needle for the plain extended bicycle.\n"
        "    motion: motion of the axes.\n"
        "    at_s: times to predict for, s, in order, shape (n,); None: the times of the motion.\n"
        "    jacobian: compute the derivatives by the parameters of the needle too.\n\n"
        "Raises:\n"
        "    DomainError: the needle leaves the domain of the slip law (Eq. 25).");
  m.def("predict", &predict_recording, "model"_a, "recording"_a, nb::kw_only(), "jacobian"_a = false,
        nb::sig("def predict(model: Model | Needle, recording: Recording, *, jacobian: bool = False) -> Prediction"),
        "Predicts the measured positions of a recording from the motion of its axes; one row per position.");
}

}  // namespace bevel::python
