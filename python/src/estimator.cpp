// SPDX-License-Identifier: MIT
#include "estimator.hpp"

#include <nanobind/stl/filesystem.h>

#include <cmath>
#include <filesystem>
#include <utility>

#include <bevel/estimator/health.hpp>
#include <bevel/io/config.hpp>
#include <bevel/io/estimator_config.hpp>
#include <bevel/io/live_effects.hpp>
#include "arrays.hpp"
#include "io_error.hpp"
#include "module.hpp"
#include "motion.hpp"

namespace bevel::python {
namespace {

using estimator::Estimate;
using estimator::EstimatorConfig;

// The estimator with counters of its samples: two measurements of the same time and camera differ by their number.
struct Estimator {
  estimator::NeedleEstimator needle;
  std::int64_t seq = 0;
  std::int64_t newest_utime = 0;
};

void require_finite(const Eigen::Vector3d& v, const char* what) {
  if (!v.allFinite()) throw ArgumentError(std::string(what) + " is not finite");
}

using Sigma = std::variant<double, Vector3>;

// Diagonal information of standard deviations; 0 for an axis that was not measured.
Eigen::Matrix3d information_of(const Sigma& sigma) {
  Eigen::Vector3d sd = std::holds_alternative<double>(sigma) ? Eigen::Vector3d::Constant(std::get<double>(sigma))
                                                             : to_eigen(std::get<Vector3>(sigma));
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (!(sd[i] > 0))
      throw ArgumentError("sigma_mm is " + std::to_string(sd[i]) +
                          " mm; allowed: above 0, inf for an axis that was not measured");
    information(i, i) = std::isinf(sd[i]) ? 0 : 1 / (sd[i] * sd[i]);
  }
  return information;
}

Eigen::Matrix3d information_of(const nb::DRef<const Eigen::MatrixXd>& matrix, const char* name) {
  if (matrix.rows() != 3 || matrix.cols() != 3)
    throw ArgumentError(std::string(name) + " is " + std::to_string(matrix.rows()) + " x " +
                        std::to_string(matrix.cols()) + "; allowed: 3 x 3");
  if (!matrix.allFinite()) throw ArgumentError(std::string(name) + " is not finite");
  return matrix;
}

void add_motion(Estimator& self, double time_s, double insertion_mm, double rotation_rad, double insertion_rate,
                double rotation_rate) {
  constexpr auto kEnabled = static_cast<std::int32_t>(model::AxisStatus::enabled);
  require_finite({insertion_mm, rotation_rad, insertion_rate + rotation_rate}, "insertion, rotation or a rate");
  model::ActuatorState state;
  state.utime = utime_of(time_s);
  state.seq = ++self.seq;
  state.axis_status = {kEnabled, kEnabled};
  state.insertion_mm = insertion_mm;
  state.rotation_rad = rotation_rad;
  state.insertion_rate_mm_s = insertion_rate;
  state.rotation_rate_rad_s = rotation_rate;
  self.newest_utime = std::max(self.newest_utime, state.utime);
  self.needle.add(state);
}

void add_position(Estimator& self, double time_s, const Vector3& position_mm, const Sigma& sigma_mm,
                  const std::optional<nb::DRef<const Eigen::MatrixXd>>& information, int camera) {
  model::TipMeasurement tip;
  tip.utime = utime_of(time_s);
  tip.seq = ++self.seq;
  tip.camera = camera;
  tip.position_mm = to_eigen(position_mm);
  tip.information_per_mm2 =
      information ? information_of(*information, "information_per_mm2") : information_of(sigma_mm);
  require_finite(tip.position_mm, "position_mm");
  self.newest_utime = std::max(self.newest_utime, tip.utime);
  self.needle.add(tip);
}

void add_heading(Estimator& self, double time_s, const Vector3& heading, double sigma_rad, int camera) {
  constexpr double kUnit = 1e-3;
  model::TipHeading reading;
  reading.utime = utime_of(time_s);
  reading.seq = ++self.seq;
  reading.camera = camera;
  reading.heading = to_eigen(heading);
  require_finite(reading.heading, "heading");
  if (std::abs(reading.heading.norm() - 1) > kUnit)
    throw ArgumentError("heading has length " + std::to_string(reading.heading.norm()) + "; allowed: 1, within 0.001");
  if (!(sigma_rad > 0)) throw ArgumentError("sigma_rad is " + std::to_string(sigma_rad) + "; allowed: above 0");
  reading.heading.normalize();
  reading.information_per_rad2 =
      (Eigen::Matrix3d::Identity() - reading.heading * reading.heading.transpose()) / (sigma_rad * sigma_rad);
  self.newest_utime = std::max(self.newest_utime, reading.utime);
  self.needle.add(reading);
}

Estimate estimate(const Estimator& self, const std::optional<double>& now_s) {
  return self.needle.estimate(now_s ? utime_of(*now_s) : self.newest_utime);
}

// A setting with its place in the configuration.
template <class Get>
void setting(nb::class_<EstimatorConfig>& config, const char* name, Get get, const char* doc) {
  using Value = std::remove_reference_t<decltype(get(std::declval<EstimatorConfig&>()))>;
  config.def_prop_rw(
      name, [get](EstimatorConfig& c) -> Value { return get(c); },
      [get, name](EstimatorConfig& c, Value value) {
        if constexpr (std::is_same_v<Value, double>)
          if (!(value >= 0) || !std::isfinite(value))
            throw ArgumentError(std::string(name) + " is " + std::to_string(value) + "; allowed: 0 and above, finite");
        get(c) = value;
      },
      doc);
}

void bind_config(nb::module_& m) {
  nb::class_<EstimatorConfig> config(m, "EstimatorConfig",
                                     "Settings of the estimator. The means of the prior are those of the model.");
  config.def(nb::init<>())
      .def_static(
          "load",
          [](const std::filesystem::path& path) {
            return with_io_errors([&] {
              EstimatorConfig loaded;
              io::ConfigFile file = io::ConfigFile::load(path.string());
              io::read_estimator_config(file.root(), loaded);
              file.finish();
              return loaded;
            });
          },
          "path"_a,
          "Reads the settings of a TOML file (docs/estimator.md).\n\n"
          "Raises:\n"
          "    ConfigurationError: the content is invalid; the message lists every fault.");
#define BEVEL_SETTING(name, member, doc) \
  setting(                               \
      config, name, [](EstimatorConfig & c) -> auto& { return c.member; }, doc)
  BEVEL_SETTING("curvature_sd_per_mm", prior.curvature_sd_per_mm, "Prior standard deviation of k, 1/mm.");
  BEVEL_SETTING("lambda1_sd_per_rad", prior.lambda1_sd_per_rad, "Prior standard deviation of lambda1, 1/rad.");
  BEVEL_SETTING("lambda2_sd", prior.lambda2_sd, "Prior standard deviation of lambda2.");
  BEVEL_SETTING("wheelbase_sd_mm", prior.wheelbase_sd_mm,
                "Prior standard deviation of the wheelbase, mm; 0: it is not a state.");
  BEVEL_SETTING("position_sd_mm", prior.position_sd_mm, "Prior standard deviation of the tip at the entry, mm.");
  BEVEL_SETTING("tilt_sd_rad", prior.tilt_sd_rad, "Prior standard deviation of the heading about body x and y, rad.");
  BEVEL_SETTING("roll_sd_rad", prior.roll_sd_rad, "Prior standard deviation of the roll, rad.");
  BEVEL_SETTING("process_position_mm", process.position_mm, "Process noise of the position, mm per sqrt(mm).");
  BEVEL_SETTING("process_tilt_rad", process.tilt_rad, "Process noise of the heading, rad per sqrt(mm).");
  BEVEL_SETTING("process_roll_rad", process.roll_rad, "Process noise of the roll, rad per sqrt(mm).");
  BEVEL_SETTING("process_roll_per_sqrt_rad", process.roll_per_sqrt_rad,
                "Process noise of the roll, rad per sqrt(rad) of rotation.");
  BEVEL_SETTING("process_curvature_per_mm", process.curvature_per_mm, "Process noise of k, 1/mm per sqrt(mm).");
  BEVEL_SETTING("process_lambda1_per_rad", process.lambda1_per_rad, "Process noise of lambda1, 1/rad per sqrt(mm).");
  BEVEL_SETTING("process_lambda2", process.lambda2, "Process noise of lambda2, per sqrt(mm).");
  BEVEL_SETTING("gate_probability", gate.probability, "Share of good measurements that pass the gate.");
  BEVEL_SETTING("gap_s", axes.gap_s,
                "Longest interval between axis samples in which motion is interpolated, s; 0: any.");
  BEVEL_SETTING("relinearised_steps", relinearised_steps,
                "Past steps that are kept and linearised again as the estimate improves; 0: none.");
  BEVEL_SETTING("midpoint_derivatives", midpoint_derivatives,
                "Short steps take the derivatives of the midpoint rule; False: exact derivatives.");
  BEVEL_SETTING("through_channel", through_channel, "A retracted needle follows the channel that it has cut.");
  BEVEL_SETTING("start_at_axes", start_at_axes,
                "The first axis sample gives the depth and roll of a needle already inserted; False: it is the entry.");
#undef BEVEL_SETTING
}

void bind_estimate(nb::module_& m) {
  nb::class_<Estimate>(m, "Estimate", "State of the needle at the newest axis sample.")
      .def_prop_ro(
          "time_s", [](const Estimate& e) { return time_of(e.utime); }, "Time for which the estimate holds, s.")
      .def_prop_ro(
          "valid", [](const Estimate& e) { return e.utime != 0; }, "False before the first axis sample.")
      .def_prop_ro(
          "position_mm", [](const Estimate& e) { return e.tip.p_mm; }, "Tip in {A}, mm, shape (3,).")
      .def_prop_ro(
          "rotation", [](const Estimate& e) { return e.tip.R; }, "Orientation of {B} in {A}, shape (3, 3).")
      .def_prop_ro(
          "heading", [](const Estimate& e) -> Eigen::Vector3d { return e.tip.R.col(2); },
          "Heading in {A}, unit vector, shape (3,).")
      .def_prop_ro(
          "curvature_per_mm", [](const Estimate& e) { return e.state.curvature_per_mm; }, "k, 1/mm.")
      .def_prop_ro(
          "lambda1_per_rad", [](const Estimate& e) { return e.state.lambda1_per_rad; }, "lambda1, 1/rad.")
      .def_prop_ro(
          "lambda2", [](const Estimate& e) { return e.state.lambda2; }, "lambda2.")
      .def_prop_ro(
          "wheelbase_mm", [](const Estimate& e) { return e.state.wheelbase_mm; }, "Wheelbase, mm.")
      .def_prop_ro(
          "covariance", [](const Estimate& e) { return e.state.covariance; },
          "Covariance, shape (9, 9): position (mm) and rotation (rad) as perturbations in {B}, k, lambda1, lambda2.")
      .def_prop_ro(
          "position_sd_mm",
          [](const Estimate& e) -> Eigen::Vector3d {
            const Eigen::Matrix3d& R = e.state.pose.R;
            return (R * e.state.covariance.topLeftCorner<3, 3>() * R.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
          },
          "Standard deviations of the position along the axes of {A}, mm, shape (3,).")
      .def_prop_ro(
          "health", [](const Estimate& e) { return e.health; }, "Health bits; 0: healthy.")
      .def_prop_ro(
          "health_flags", [](const Estimate& e) { return names_of_health(e.health); }, "Health bits by name.")
      .def_prop_ro(
          "usable", [](const Estimate& e) { return e.utime != 0 && estimator::lost(e.health) == 0; },
          "Whether no health bit forbids steering by the estimate.")
      .def_prop_ro(
          "reset_count", [](const Estimate& e) { return e.state.reset_count; }, "Declared resets so far.")
      .def_prop_ro(
          "accepted", [](const Estimate& e) { return e.newest_update.accepted; },
          "Whether the gate accepted the newest position.")
      .def_prop_ro(
          "mahalanobis2", [](const Estimate& e) { return e.newest_update.mahalanobis2; },
          "Squared Mahalanobis distance of the newest position.")
      .def_prop_ro(
          "test_ratio", [](const Estimate& e) { return e.newest_update.test_ratio; },
          "mahalanobis2 over the gate of its rank; above 1 is rejected.")
      .def_prop_ro(
          "rank", [](const Estimate& e) { return e.newest_update.rank; }, "Axes that the newest position measured.")
      .def("__repr__", [](const Estimate& e) {
        std::array<char, 160> text{};
        std::snprintf(text.data(), text.size(),
                      "<Estimate at %.6f s: tip (%.3f, %.3f, %.3f) mm, k %.5f /mm, health %d>", time_of(e.utime),
                      e.tip.p_mm.x(), e.tip.p_mm.y(), e.tip.p_mm.z(), e.state.curvature_per_mm, e.health);
        return std::string(text.data());
      });
}

}  // namespace

EstimatorConfig for_model(EstimatorConfig config, const io::ModelFile& model) {
  config.prior.needle = model.needle;
  config.prior.variation = model.variation.value_or(model::Variation{});
  config.effects = io::live_effects(model.effects, model.discrepancies).active;
  return config;
}

std::vector<std::string> names_of_health(std::int32_t health) {
  static constexpr std::array kNames{
      std::pair{estimator::kNoMeasurement, "no_measurement"},
      std::pair{estimator::kMeasurementStale, "measurement_stale"},
      std::pair{estimator::kActuatorStale, "actuator_stale"},
      std::pair{estimator::kUncertain, "uncertain"},
      std::pair{estimator::kRejecting, "rejecting"},
      std::pair{estimator::kOutsideModel, "outside_model"},
      std::pair{estimator::kNotFromEntry, "not_from_entry"},
      std::pair{estimator::kCameraSilent, "camera_silent"},
      std::pair{estimator::kCameraFrozen, "camera_frozen"},
      std::pair{estimator::kInputRefused, "input_refused"},
      std::pair{estimator::kUnsure, "unsure"},
      std::pair{estimator::kHeadingUncertain, "heading_uncertain"},
      std::pair{estimator::kResetByRejects, "reset_by_rejects"},
      std::pair{estimator::kResetByBevel, "reset_by_bevel"},
      std::pair{estimator::kResetByGap, "reset_by_gap"},
      std::pair{estimator::kResetByRestart, "reset_by_restart"},
      std::pair{estimator::kResetByClock, "reset_by_clock"},
  };
  std::vector<std::string> names;
  for (const auto& [bit, name] : kNames)
    if ((health & bit) != 0) names.emplace_back(name);
  return names;
}

void bind_estimator(nb::module_& m) {
  bind_config(m);
  bind_estimate(m);
  nb::class_<Estimator>(m, "Estimator",
                        "Extended Kalman filter of the needle, fed sample by sample.\n\n"
                        "Samples may arrive late or out of order: each is applied at its own time. The state is the "
                        "pose of the tip, k, lambda1 and lambda2.")
      .def(
          "__init__",
          [](Estimator* self, const io::ModelFile& model, const EstimatorConfig& config, std::size_t history) {
            constexpr std::size_t kLeast = 4, kMost = 100'000;
            if (history < kLeast || history > kMost)
              throw ArgumentError("history is " + std::to_string(history) + "; allowed: 4 to 100000");
            new (self) Estimator{estimator::NeedleEstimator(for_model(config, model), history)};
          },
          "model"_a, "config"_a = EstimatorConfig{}, "history"_a = 64,
          nb::sig(
              "def __init__(self, model: Model | Needle, config: EstimatorConfig = ..., history: int = 64) -> None"),
          "Args:\n"
          "    model: a Model or a Needle: means of the prior, and the effects that are known before an insertion.\n"
          "    config: settings.\n"
          "    history: number of samples that are kept for late measurements.")
      .def("add_motion", &add_motion, "time_s"_a, "insertion_mm"_a, "rotation_rad"_a = 0.0,
           "insertion_rate_mm_s"_a = 0.0, "rotation_rate_rad_s"_a = 0.0,
           "Adds a sample of the axes. Motion is linear between two samples.\n\n"
           "Args:\n"
           "    time_s: time of the sample, s, at least 0.\n"
           "    insertion_mm, rotation_rad: positions of the axes.\n"
           "    insertion_rate_mm_s, rotation_rate_rad_s: rates, used by extrapolation only.")
      .def("add_position", &add_position, "time_s"_a, "position_mm"_a, "sigma_mm"_a = 0.2, nb::kw_only(),
           "information_per_mm2"_a = nb::none(), "camera"_a = 0,
           nb::sig("def add_position(self, time_s: float, position_mm: numpy.typing.ArrayLike, sigma_mm: float | "
                   "numpy.typing.ArrayLike = 0.2, *, information_per_mm2: numpy.typing.NDArray[numpy.float64] | None = "
                   "None, camera: int = 0) -> None"),
           "Adds a measured position of the tip.\n\n"
           "Args:\n"
           "    time_s: time of capture, s.\n"
           "    position_mm: tip in {A}, mm, 3 numbers.\n"
           "    sigma_mm: standard deviation, mm: one number, or one for each axis of {A}; inf: not measured.\n"
           "    information_per_mm2: inverse covariance, 1/mm^2, shape (3, 3), any rank, in place of sigma_mm.\n"
           "    camera: number of the camera.")
      .def("add_heading", &add_heading, "time_s"_a, "heading"_a, "sigma_rad"_a, nb::kw_only(), "camera"_a = 0,
           nb::sig("def add_heading(self, time_s: float, heading: numpy.typing.ArrayLike, sigma_rad: float, *, "
                   "camera: int = 0) -> None"),
           "Adds a measured heading.\n\n"
           "Args:\n"
           "    time_s: time of capture, s.\n"
           "    heading: unit vector in {A}.\n"
           "    sigma_rad: standard deviation to any side, rad.\n"
           "    camera: number of the sensor.")
      .def("estimate", &estimate, "now_s"_a = nb::none(),
           "Returns the estimate at the newest axis sample.\n\n"
           "Args:\n"
           "    now_s: present time for the age limits of the health, s; None: the time of the newest sample.")
      .def(
          "restart", [](Estimator& self) { self.needle.restart(); },
          "Starts again at the prior with the next axis sample; a declared reset.")
      .def_prop_ro(
          "positions_offered", [](const Estimator& self) { return self.needle.counters().positions.offered; },
          "Number of positions added.")
      .def_prop_ro(
          "positions_too_old", [](const Estimator& self) { return self.needle.counters().positions.too_old; },
          "Number of positions older than the history, which were not used.");
}

}  // namespace bevel::python
