// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include <bevel/diagnosis/identification/angle_rate.hpp>
#include <bevel/diagnosis/identification/candidates.hpp>
#include <bevel/error.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/io/second_insertion.hpp>
#include "arrays.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "recording.hpp"

namespace bevel::python {
namespace {

using diagnosis::Candidate;
using diagnosis::ErrorFigures;
using diagnosis::FitOptions;
using diagnosis::FittedParameter;
using diagnosis::HeldParameter;

struct Identification {
  std::vector<Candidate> candidates;
  std::size_t preferred = 0;
  model::NeedleParameters needle;
  std::optional<ErrorFigures> before;
  ErrorFigures after;
};

const char* name_of(diagnosis::Parameter parameter) {
  return diagnosis::kParameterNames.at(static_cast<std::size_t>(parameter));
}

diagnosis::Insertion insertion_of(const Recording& recording) {
  std::vector<model::ActuatorState> actuators = recording.data->actuators;
  std::vector<model::TipMeasurement> tips = recording.data->tips;
  io::require_one_insertion(recording.name, actuators);
  std::ranges::stable_sort(actuators, {}, &model::ActuatorState::utime);
  std::ranges::stable_sort(tips, {}, &model::TipMeasurement::utime);
  return diagnosis::make_insertion(recording.name, actuators, tips);
}

diagnosis::Priors priors_of(const std::string& name) {
  if (name == "none") return {};
  if (name == "table1-agar") return diagnosis::table_one_agar();
  if (name == "table1-plastisol") return diagnosis::table_one_plastisol();
  throw ArgumentError("prior is \"" + name + "\"; allowed: \"none\", \"table1-agar\", \"table1-plastisol\"");
}

void require_needle_alone(const io::ModelFile& model) {
  if (!model.effects.empty() || !model.discrepancies.empty() || model.variation)
    throw ArgumentError(
        "the model has effects, discrepancy terms or a variation; identify() fits the needle alone, use diagnose()");
}

Identification identify(const std::vector<Recording>& recordings, const model::NeedleParameters& start,
                        const FitOptions& options, bool angle_rate, bool bicycle) {
  std::vector<diagnosis::Insertion> insertions;
  for (const Recording& recording : recordings) insertions.push_back(insertion_of(recording));
  Identification out;
  out.candidates = diagnosis::fit_candidates(insertions, options);
  out.preferred = bicycle ? 0 : diagnosis::preferred(out.candidates);
  const Candidate& preferred = out.candidates[out.preferred];
  if (!preferred.possible) throw DomainError(preferred.model + ": " + preferred.why);
  out.needle = preferred.fit.needle;
  if (angle_rate) {
    out.needle = diagnosis::fit_angle_rate(insertions, start).needle;
    if (const auto violation = model::find_domain_violation(out.needle))
      throw DomainError("the angle-rate fit leaves the model's domain: " + model::describe(*violation));
  }
  try {
    out.before = diagnosis::error_figures(insertions, start, diagnosis::Compare::same_insertion);
  } catch (const DomainError&) {  // the start need not be able to follow the recordings
  }
  out.after = diagnosis::error_figures(insertions, out.needle, diagnosis::Compare::same_insertion,
                                       angle_rate ? std::vector<diagnosis::Entry>{} : preferred.fit.entries);
  return out;
}

Identification identify_recordings(const std::vector<Recording>& recordings, const io::ModelFile& model,
                                   const std::string& method, const std::string& prior, bool bicycle,
                                   bool fit_wheelbase, bool fit_slip_in_plane, double entry_tilt_rad,
                                   double entry_roll_rad, double entry_offset_mm) {
  if (method != "trajectory" && method != "angle-rate")
    throw ArgumentError("method is \"" + method + "\"; allowed: \"trajectory\", \"angle-rate\"");
  if (recordings.empty()) throw ArgumentError("no recording is given; at least one is needed");
  require_needle_alone(model);
  FitOptions options;
  options.start = model.needle;
  options.priors = priors_of(prior);
  options.fitted[diagnosis::kNeedleWheelbase] = fit_wheelbase;
  options.fit_slip_in_plane = fit_slip_in_plane;
  options.entry_sigma(diagnosis::kEntryTiltX) = options.entry_sigma(diagnosis::kEntryTiltY) = entry_tilt_rad;
  options.entry_sigma(diagnosis::kEntryRoll) = entry_roll_rad;
  options.entry_sigma(diagnosis::kEntryOffsetX) = options.entry_sigma(diagnosis::kEntryOffsetY) = entry_offset_mm;
  return compute_interruptible([recordings, start = model.needle, options, angle_rate = method == "angle-rate",
                                bicycle](Task&) { return identify(recordings, start, options, angle_rate, bicycle); },
                               nb::none());
}

void bind_fit(nb::module_& m) {
  nb::class_<FittedParameter>(m, "FittedParameter", "An estimated parameter of the needle.")
      .def_prop_ro(
          "name", [](const FittedParameter& p) { return name_of(p.parameter); }, "Name; it ends with the unit.")
      .def_ro("value", &FittedParameter::value, "Estimate.")
      .def_ro("std_error", &FittedParameter::std_error, "Standard error.")
      .def_prop_ro(
          "ci95", [](const FittedParameter& p) { return std::pair(p.low95, p.high95); }, "Confidence interval, 95 %.")
      .def_ro("prior_share", &FittedParameter::prior_share, "Share of the prior in the weight of the estimate, 0 to 1.")
      .def_ro("at_bound", &FittedParameter::at_bound,
              "The estimate is at the bound of the model's domain; its standard error is then not valid.")
      .def("__repr__", [](const FittedParameter& p) {
        std::array<char, 96> text{};
        std::snprintf(text.data(), text.size(), "<%s %.6g +- %.2g>", name_of(p.parameter), p.value, p.std_error);
        return std::string(text.data());
      });
  nb::class_<HeldParameter>(m, "HeldParameter", "A parameter that the recordings do not determine.")
      .def_prop_ro(
          "name", [](const HeldParameter& p) { return name_of(p.parameter); }, "Name; it ends with the unit.")
      .def_ro("value", &HeldParameter::value, "Value at which it is held.")
      .def_ro("reason", &HeldParameter::reason, "Why it is not determined, a clause.");
  nb::class_<Candidate>(m, "CandidateFit", "One kinematic model fitted to the recordings.")
      .def_ro("model", &Candidate::model, "Name: 'bicycle', 'extended, isotropic, published', ...")
      .def_ro("possible", &Candidate::possible, "False: the model cannot follow the insertions.")
      .def_ro("why", &Candidate::why, "The reason where it is not possible.")
      .def_ro("bic", &Candidate::bic, "Bayesian information criterion; only differences have a meaning.")
      .def_prop_ro(
          "needle", [](const Candidate& c) { return c.fit.needle; }, "Fitted needle.")
      .def_prop_ro(
          "parameters", [](const Candidate& c) { return c.fit.parameters; }, "Estimates with standard errors.")
      .def_prop_ro(
          "held", [](const Candidate& c) { return c.fit.held; }, "Parameters that are not determined.")
      .def_prop_ro(
          "covariance", [](const Candidate& c) { return c.fit.covariance; },
          "Covariance of the parameters in their order, shape (p, p).")
      .def_prop_ro(
          "noise_scale", [](const Candidate& c) { return c.fit.noise_scale; },
          "Noise relative to the measurements' stated covariances.")
      .def_prop_ro(
          "converged", [](const Candidate& c) { return c.fit.converged; }, "Whether the fit converged.")
      .def_prop_ro(
          "rms_mm", [](const Candidate& c) { return c.at_insertion.rms_mm; },
          "Root mean square error at equal insertion, mm.");
  nb::class_<ErrorFigures>(m, "ErrorFigures", "Errors of a path against the measured positions, at equal insertion.")
      .def_ro("rms_mm", &ErrorFigures::rms_mm, "Root mean square, mm.")
      .def_ro("largest_mm", &ErrorFigures::largest_mm, "Largest error, mm.")
      .def_ro("largest_at_mm", &ErrorFigures::largest_at_mm, "Insertion at the largest error, mm.")
      .def_ro("count", &ErrorFigures::count, "Number of positions.");
}

}  // namespace

void bind_identification(nb::module_& m) {
  bind_fit(m);
  nb::class_<Identification>(m, "Identification", "Result of identify().")
      .def_ro("needle", &Identification::needle, "Identified needle.")
      .def_prop_ro(
          "model", [](const Identification& i) { return io::ModelFile{.needle = i.needle}; },
          "The needle as a Model, for save() and predict().")
      .def_prop_ro(
          "candidates", [](const Identification& i) { return i.candidates; }, "Every model that was fitted.")
      .def_prop_ro(
          "preferred", [](const Identification& i) { return i.candidates[i.preferred]; },
          "The candidate with the lowest BIC.")
      .def_prop_ro(
          "parameters", [](const Identification& i) { return i.candidates[i.preferred].fit.parameters; },
          "Estimates of the preferred candidate.")
      .def_ro("before", &Identification::before,
              "Errors with the starting needle; None where it cannot follow the recordings.")
      .def_ro("after", &Identification::after, "Errors with the identified needle.");
  m.def("identify", &identify_recordings, "recordings"_a, "model"_a = io::ModelFile{}, nb::kw_only(),
        "method"_a = "trajectory", "prior"_a = "none", "bicycle"_a = false, "fit_wheelbase"_a = false,
        "fit_slip_in_plane"_a = false, "entry_tilt_rad"_a = 0.0, "entry_roll_rad"_a = 0.0, "entry_offset_mm"_a = 0.0,
        nb::sig("def identify(recordings: collections.abc.Sequence[Recording], model: Model | Needle = ..., *, "
                "method: str = 'trajectory', prior: str = 'none', bicycle: bool = False, fit_wheelbase: bool = False, "
                "fit_slip_in_plane: bool = False, entry_tilt_rad: float = 0.0, entry_roll_rad: float = 0.0, "
                "entry_offset_mm: float = 0.0) -> Identification"),
        "Identifies the parameters of a needle from recorded insertions.\n\n"
        "Args:\n"
        "    recordings: insertions of one needle in one tissue.\n"
        "    model: start of the fit.\n"
        "    method: 'trajectory' (maximum likelihood) or 'angle-rate' (Section IV of the paper).\n"
        "    prior: 'none', 'table1-agar' or 'table1-plastisol', on lambda1 and lambda2.\n"
        "    bicycle: select the bicycle whatever its BIC is.\n"
        "    fit_wheelbase: estimate the wheelbase too.\n"
        "    fit_slip_in_plane: estimate lambda although no shaft rotates.\n"
        "    entry_tilt_rad, entry_roll_rad, entry_offset_mm: standard deviations of each insertion's entry; 0: "
        "nominal.\n\n"
        "Raises:\n"
        "    ValueError: an invalid argument, or a recording without usable positions.\n"
        "    KeyboardInterrupt: Ctrl-C was pressed.");
}

}  // namespace bevel::python
