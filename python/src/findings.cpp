// SPDX-License-Identifier: MIT
#include <utility>

#include <bevel/diagnosis/mismatch/findings.hpp>
#include "arrays.hpp"
#include "module.hpp"

namespace bevel::python {
namespace {

using diagnosis::DetectableSize;
using diagnosis::Explanation;
using diagnosis::FitFigures;
using diagnosis::FoundEffect;
using diagnosis::FoundInRecording;
using diagnosis::FoundParameter;
using diagnosis::HeldOut;
using diagnosis::NeedleEstimate;
using diagnosis::NextExperiment;
using diagnosis::TriedEffect;
using diagnosis::VariationEstimate;

template <class... Arguments>
std::string printed(const char* format, Arguments... arguments) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, arguments...);
  return text.data();
}

void bind_effects(nb::module_& m) {
  nb::class_<FoundParameter>(m, "FoundParameter", "An estimated parameter of an effect.")
      .def_ro("name", &FoundParameter::name, "Name; it ends with the unit.")
      .def_ro("value", &FoundParameter::value, "Estimate.")
      .def_ro("std_error", &FoundParameter::std_error, "Standard error.")
      .def_ro("ci95", &FoundParameter::ci95, "Interval that holds 95 % of the posterior.")
      .def_ro("at_bound", &FoundParameter::at_bound, "The estimate is at a bound of the parameter.")
      .def_ro("none", &FoundParameter::none, "Value at which the effect vanishes, or NaN.")
      .def("__repr__",
           [](const FoundParameter& p) { return printed("<%s %.6g +- %.2g>", p.name.c_str(), p.value, p.std_error); });
  nb::class_<FoundInRecording>(m, "FoundInRecording", "Parameters of an effect in one recording.")
      .def_ro("log", &FoundInRecording::log, "Name of the recording.")
      .def_prop_ro(
          "parameters", [](const FoundInRecording& r) { return r.parameters; }, "Estimates.");
  nb::class_<FoundEffect>(m, "FoundEffect", "An effect that the recordings show and the model leaves out.")
      .def_ro("name", &FoundEffect::name, "Name in the effect library.")
      .def_ro("meaning", &FoundEffect::meaning, "Description of the effect, a clause.")
      .def_ro("probability", &FoundEffect::probability, "Posterior probability of the effect.")
      .def_ro("joint_probability", &FoundEffect::joint_probability,
              "Posterior probability of the effect or one of its confounders.")
      .def_prop_ro(
          "ambiguous_with", [](const FoundEffect& e) { return e.ambiguous_with; }, "Names of the confounders.")
      .def_prop_ro(
          "parameters", [](const FoundEffect& e) { return e.parameters; }, "Estimates common to all recordings.")
      .def_prop_ro(
          "recordings", [](const FoundEffect& e) { return e.recordings; }, "Estimates of single recordings.")
      .def_ro("log_bayes_factor", &FoundEffect::log_bayes_factor,
              "Natural logarithm of the Bayes factor for the effect.")
      .def_ro("moved_at_depth_mm", &FoundEffect::moved_at_depth_mm,
              "Displacement of the tip by the effect at the deepest measurement, root mean square over the recordings, "
              "mm; NaN: without the effect the needle leaves the model's domain.")
      .def("__repr__", [](const FoundEffect& e) {
        return printed("<FoundEffect '%s', probability %.3f>", e.name.c_str(), e.probability);
      });
  nb::class_<Explanation>(m, "Explanation", "A candidate model: a set of effects with its posterior probability.")
      .def_prop_ro(
          "effects", [](const Explanation& e) { return e.effects; }, "Names of the effects.")
      .def_ro("probability", &Explanation::probability, "Posterior probability.")
      .def("__repr__", [](const Explanation& e) {
        std::string names;
        for (const auto& name : e.effects) names += (names.empty() ? "" : " + ") + name;
        return printed("<Explanation %s: %.4f>", names.empty() ? "(no effect)" : names.c_str(), e.probability);
      });
  nb::class_<TriedEffect>(m, "TriedEffect", "An effect that was compared with its absence.")
      .def_ro("name", &TriedEffect::name, "Name, with the kind of the effect where it has several.")
      .def_ro("log_bayes_factor", &TriedEffect::log_bayes_factor,
              "Natural logarithm of the Bayes factor; None: not computed.")
      .def_ro("fitted", &TriedEffect::fitted, "False: estimated from the linearised model.")
      .def_prop_ro(
          "parameters",
          [](const TriedEffect& e) { return std::map<std::string, double>(e.parameters.begin(), e.parameters.end()); },
          "Values by name.");
  nb::class_<DetectableSize>(m, "DetectableSize", "The smallest size of an effect that the recordings would show.")
      .def_ro("effect", &DetectableSize::effect, "Name of the effect.")
      .def_ro("parameter", &DetectableSize::parameter, "Name of its size.")
      .def_ro("size", &DetectableSize::size,
              "Distance from the value at which the effect vanishes; inf: not detectable.")
      .def_ro("typical", &DetectableSize::typical, "Size that the literature reports.")
      .def_ro("experiment", &DetectableSize::experiment, "Motion that would show the effect at its typical size.");
}

void bind_figures(nb::module_& m) {
  nb::class_<VariationEstimate>(m, "VariationEstimate", "Standard deviation of one quantity between insertions.")
      .def_ro("name", &VariationEstimate::name, "Name of the quantity.")
      .def_ro("unit", &VariationEstimate::unit, "Unit.")
      .def_ro("sd", &VariationEstimate::sd, "Posterior mean of the standard deviation.")
      .def_ro("low", &VariationEstimate::low, "Lower end of the 95 % interval.")
      .def_ro("high", &VariationEstimate::high, "Upper end of the 95 % interval.");
  nb::class_<NeedleEstimate>(m, "NeedleEstimate", "Estimated parameters of the needle.")
      .def_prop_ro(
          "needle", [](const NeedleEstimate& n) { return n.value; }, "Estimates as a Needle.")
      .def_ro("curvature_sd_per_mm", &NeedleEstimate::curvature_sd_per_mm, "Standard deviation of k, 1/mm.")
      .def_ro("lambda1_sd_per_rad", &NeedleEstimate::lambda1_sd_per_rad, "Standard deviation of lambda1, 1/rad.")
      .def_ro("lambda2_sd", &NeedleEstimate::lambda2_sd, "Standard deviation of lambda2.")
      .def_ro("slip_determined", &NeedleEstimate::slip_determined,
              "False: the shaft rotates too little to determine lambda1 and lambda2.");
  nb::class_<FitFigures>(m, "FitFigures", "Errors of predicted recordings.")
      .def_ro("rmse_mm", &FitFigures::rmse_mm, "Root mean square per axis, mm.")
      .def_ro("max_mm", &FitFigures::max_mm, "Largest error, mm.")
      .def_ro("chi2_per_dof", &FitFigures::chi2_per_dof,
              "Chi-square per measurement; 1 is consistent with the predicted uncertainty.")
      .def_ro("log_density", &FitFigures::log_density, "Predictive log density per measurement, natural.");
  nb::class_<HeldOut>(m, "HeldOut", "Each recording predicted from the others.")
      .def_ro("as_it_stands", &HeldOut::as_it_stands, "Predicted by the model file.")
      .def_ro("before", &HeldOut::before, "With the needle refitted to the other recordings.")
      .def_ro("after", &HeldOut::after, "With the needle and the effects that the other recordings select.")
      .def_ro("noise_floor", &HeldOut::noise_floor, "Expected for an exact prediction: noise alone.")
      .def_ro("gain", &HeldOut::gain, "Gain of log predictive density over all recordings, natural.");
  nb::class_<NextExperiment>(m, "NextExperiment", "A motion that separates two explanations.")
      .def_ro("script", &NextExperiment::script, "Motion to command.")
      .def_ro("separates", &NextExperiment::separates, "The two explanations.")
      .def_ro("expected_gain", &NextExperiment::expected_gain, "Expected difference of chi-square in one recording.");
}

}  // namespace

void bind_findings(nb::module_& m) {
  bind_effects(m);
  bind_figures(m);
}

}  // namespace bevel::python
