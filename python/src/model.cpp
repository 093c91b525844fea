// SPDX-License-Identifier: MIT
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/tuple.h>

#include <cmath>
#include <filesystem>
#include <tuple>

#include <bevel/io/live_effects.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/model/effects/effect.hpp>
#include <bevel/model/needle.hpp>
#include "arrays.hpp"
#include "io_error.hpp"
#include "module.hpp"

namespace bevel::python {
namespace {

using model::NeedleParameters;

model::SlipDirection slip_of(const std::string& name) {
  if (name == "isotropic") return model::SlipDirection::isotropic;
  if (name == "bevel-plane") return model::SlipDirection::bevel_plane;
  throw ArgumentError("slip is \"" + name + "\"; allowed: \"isotropic\", \"bevel-plane\"");
}
const char* name_of(model::SlipDirection slip) {
  return slip == model::SlipDirection::isotropic ? "isotropic" : "bevel-plane";
}
model::FrontWheel front_wheel_of(const std::string& name) {
  if (name == "published") return model::FrontWheel::published;
  if (name == "nonslip") return model::FrontWheel::nonslip;
  throw ArgumentError("front_wheel is \"" + name + "\"; allowed: \"published\", \"nonslip\"");
}
const char* name_of(model::FrontWheel front_wheel) {
  return front_wheel == model::FrontWheel::published ? "published" : "nonslip";
}

NeedleParameters make_needle(double k, double lambda1, double lambda2, double wheelbase, const std::string& slip,
                             const std::string& front_wheel) {
  const NeedleParameters needle{.curvature_per_mm = k,
                                .wheelbase_mm = wheelbase,
                                .lambda1_per_rad = lambda1,
                                .lambda2 = lambda2,
                                .slip = slip_of(slip),
                                .front_wheel = front_wheel_of(front_wheel)};
  if (const auto violation = model::find_domain_violation(needle)) throw ArgumentError(model::describe(*violation));
  return needle;
}

std::string text_of(double value) { return nb::cast<std::string>(nb::repr(nb::float_(value))); }

std::string repr_of(const NeedleParameters& n) {
  return "Needle(curvature_per_mm=" + text_of(n.curvature_per_mm) + ", lambda1_per_rad=" + text_of(n.lambda1_per_rad) +
         ", lambda2=" + text_of(n.lambda2) + ", wheelbase_mm=" + text_of(n.wheelbase_mm) + ", slip='" +
         name_of(n.slip) + "', front_wheel='" + name_of(n.front_wheel) + "')";
}

std::string repr_of(const io::EffectEntry& effect) {
  std::string text = "Effect('" + effect.name + "'";
  for (const auto& [name, value] : effect.parameters) text += ", " + name + "=" + text_of(value);
  return text + ")";
}

// Names, required parameters and bounds, as in a model file.
void check(const std::vector<io::EffectEntry>& effects) {
  io::active_effects(effects, "");
  for (const io::EffectEntry& entry : effects)
    for (const model::EffectParameter& parameter : model::find_effect(entry.name)->parameters()) {
      const auto given = entry.parameters.find(std::string(parameter.name));
      if (given == entry.parameters.end()) continue;
      if (!(given->second >= parameter.lower && given->second <= parameter.upper))
        throw ArgumentError("effect \"" + entry.name + "\": " + given->first + " is " + text_of(given->second) +
                            "; allowed: " + text_of(parameter.lower) + " to " + text_of(parameter.upper));
    }
}

std::map<std::string, double> numbers(const nb::kwargs& arguments) {
  std::map<std::string, double> values;
  for (const auto& [name, value] : arguments)
    values[nb::cast<std::string>(nb::handle(name))] = nb::cast<double>(nb::handle(value));
  return values;
}

io::ModelFile make_model(const NeedleParameters& needle, std::vector<io::EffectEntry> effects,
                         const std::optional<model::Variation>& variation) {
  check(effects);
  return {.needle = needle, .effects = std::move(effects), .variation = variation};
}

void bind_needle(nb::module_& m) {
  nb::class_<NeedleParameters>(m, "Needle",
                               "Parameters of a bevel-tip needle in its tissue: the extended bicycle model.\n\n"
                               "An object does not change after its construction; see replaced().")
      .def(
          "__init__",
          [](NeedleParameters* self, double k, double lambda1, double lambda2, double wheelbase,
             const std::string& slip, const std::string& front_wheel) {
            new (self) NeedleParameters(make_needle(k, lambda1, lambda2, wheelbase, slip, front_wheel));
          },
          "curvature_per_mm"_a = NeedleParameters{}.curvature_per_mm, "lambda1_per_rad"_a = 0.0, "lambda2"_a = 0.0,
          "wheelbase_mm"_a = NeedleParameters{}.wheelbase_mm, "slip"_a = "isotropic", "front_wheel"_a = "published",
          "Args:\n"
          "    curvature_per_mm: curvature k of the path without rotation, 1/mm. k > 0 bends toward -y of the body.\n"
          "    lambda1_per_rad, lambda2: slip law alpha = lambda2 gamma - lambda1 gamma |gamma| (Eq. 25).\n"
          "    wheelbase_mm: distance ell of the wheels, mm.\n"
          "    slip: 'isotropic' or 'bevel-plane'.\n"
          "    front_wheel: sign of the slip term in Eq. 13, 'published' or 'nonslip'.\n\n"
          "Raises:\n"
          "    ValueError: the parameters are outside the model's domain (Eqs. 23, 24, 26).")
      .def_ro("curvature_per_mm", &NeedleParameters::curvature_per_mm, "Curvature k, 1/mm.")
      .def_prop_ro(
          "k", [](const NeedleParameters& n) { return n.curvature_per_mm; }, "Short name of curvature_per_mm, 1/mm.")
      .def_ro("lambda1_per_rad", &NeedleParameters::lambda1_per_rad, "lambda1 of Eq. 25, 1/rad.")
      .def_prop_ro(
          "lambda1", [](const NeedleParameters& n) { return n.lambda1_per_rad; },
          "Short name of lambda1_per_rad, 1/rad.")
      .def_ro("lambda2", &NeedleParameters::lambda2, "lambda2 of Eq. 25.")
      .def_ro("wheelbase_mm", &NeedleParameters::wheelbase_mm, "Distance ell of the wheels, mm.")
      .def_prop_ro(
          "slip", [](const NeedleParameters& n) { return name_of(n.slip); }, "'isotropic' or 'bevel-plane'.")
      .def_prop_ro(
          "front_wheel", [](const NeedleParameters& n) { return name_of(n.front_wheel); }, "'published' or 'nonslip'.")
      .def(
          "replaced",
          [](const NeedleParameters& n, std::optional<double> k, std::optional<double> lambda1,
             std::optional<double> lambda2, std::optional<double> wheelbase, std::optional<std::string> slip,
             std::optional<std::string> front_wheel) {
            return make_needle(k.value_or(n.curvature_per_mm), lambda1.value_or(n.lambda1_per_rad),
                               lambda2.value_or(n.lambda2), wheelbase.value_or(n.wheelbase_mm),
                               slip.value_or(name_of(n.slip)), front_wheel.value_or(name_of(n.front_wheel)));
          },
          nb::kw_only(), "curvature_per_mm"_a = nb::none(), "lambda1_per_rad"_a = nb::none(), "lambda2"_a = nb::none(),
          "wheelbase_mm"_a = nb::none(), "slip"_a = nb::none(), "front_wheel"_a = nb::none(),
          "Returns a copy with the given parameters replaced.")
      .def("__getstate__",
           [](const NeedleParameters& n) {
             return nb::make_tuple(n.curvature_per_mm, n.lambda1_per_rad, n.lambda2, n.wheelbase_mm, name_of(n.slip),
                                   name_of(n.front_wheel));
           })
      .def("__setstate__",
           [](NeedleParameters& self, const std::tuple<double, double, double, double, std::string, std::string>& s) {
             new (&self) NeedleParameters(std::apply(make_needle, s));
           })
      .def(
          "__eq__", [](const NeedleParameters& a, const NeedleParameters& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__repr__", [](const NeedleParameters& n) { return repr_of(n); });
}

void bind_effect_types(nb::module_& m) {
  using model::EffectParameter;
  nb::class_<EffectParameter>(m, "EffectParameter", "One parameter of an effect of the library.")
      .def_prop_ro(
          "name", [](const EffectParameter& p) { return std::string(p.name); }, "Name; it ends with the unit.")
      .def_ro("lower", &EffectParameter::lower, "Smallest allowed value.")
      .def_ro("upper", &EffectParameter::upper, "Largest allowed value.")
      .def_ro("none", &EffectParameter::none, "Value at which the effect vanishes, or NaN.")
      .def_prop_ro(
          "per_recording", [](const EffectParameter& p) { return p.scope == model::Scope::recording; },
          "Whether each recording has its own value (an event time, a phase).");
  nb::class_<model::Effect>(m, "EffectType", "An effect of the library: physics that the bicycle model leaves out.")
      .def_prop_ro(
          "name", [](const model::Effect& e) { return std::string(e.name()); }, "Name in model files and verdicts.")
      .def_prop_ro(
          "meaning", [](const model::Effect& e) { return std::string(e.meaning()); },
          "Description of the effect, a clause.")
      .def_prop_ro(
          "parameters", [](const model::Effect& e) { return e.parameters(); },
          "The parameters, a list of EffectParameter.")
      .def("__repr__", [](const model::Effect& e) { return "<EffectType '" + std::string(e.name()) + "'>"; });
  m.def(
      "effect_types",
      [] {
        nb::list all;
        for (const model::Effect* effect : model::all_effects()) all.append(nb::cast(effect, nb::rv_policy::reference));
        return all;
      },
      nb::sig("def effect_types() -> list[EffectType]"), "Lists the effects of the library.");

  nb::class_<io::EffectEntry>(m, "Effect", "An effect with the values of its parameters, for a Model.")
      .def(
          "__init__",
          [](io::EffectEntry* self, const std::string& name, const nb::kwargs& parameters) {
            const io::EffectEntry effect{.name = name, .parameters = numbers(parameters)};
            check({effect});
            new (self) io::EffectEntry(effect);
          },
          "name"_a, "parameters"_a, nb::sig("def __init__(self, name: str, **parameters: float) -> None"),
          "Args:\n"
          "    name: one of effect_types(), for example 'stick_slip'.\n"
          "    **parameters: values by name. A parameter left out has the value at which the effect vanishes.\n\n"
          "Raises:\n"
          "    ValueError: unknown effect or parameter, or a value that is missing or outside its bounds.")
      .def_ro("name", &io::EffectEntry::name, "Name in the library.")
      .def_prop_ro(
          "parameters", [](const io::EffectEntry& e) { return e.parameters; }, "Values by name.")
      .def_prop_ro(
          "recordings", [](const io::EffectEntry& e) { return e.recordings; },
          "Values of single recordings: name of the log -> values by name.")
      .def(
          "__eq__", [](const io::EffectEntry& a, const io::EffectEntry& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__repr__", [](const io::EffectEntry& e) { return repr_of(e); });
}

void bind_variation(nb::module_& m) {
  using model::Variation;
  nb::class_<Variation>(m, "Variation", "Standard deviations between insertions on one rig.")
      .def(
          "__init__",
          [](Variation* self, double curvature, double angle, double point, double roll) {
            for (const double sd : {curvature, angle, point, roll})
              if (!(sd >= 0) || !std::isfinite(sd))
                throw ArgumentError("a standard deviation is " + text_of(sd) + "; allowed: 0 and above");
            new (self) Variation{curvature, angle, point, roll};
          },
          nb::kw_only(), "curvature_relative"_a = 0.0, "entry_angle_rad"_a = 0.0, "entry_point_mm"_a = 0.0,
          "roll_rad"_a = 0.0)
      .def_ro("curvature_relative", &Variation::curvature_relative,
              "Standard deviation of the curvature, as a share of it.")
      .def_ro("entry_angle_rad", &Variation::entry_angle_rad,
              "Standard deviation of the heading at the entry about x and about y, rad.")
      .def_ro("entry_point_mm", &Variation::entry_point_mm,
              "Standard deviation of the entry point along x and along y, mm.")
      .def_ro("roll_rad", &Variation::roll_rad, "Standard deviation of the roll at the entry, rad.")
      .def("__repr__", [](const Variation& v) {
        return "Variation(curvature_relative=" + text_of(v.curvature_relative) +
               ", entry_angle_rad=" + text_of(v.entry_angle_rad) + ", entry_point_mm=" + text_of(v.entry_point_mm) +
               ", roll_rad=" + text_of(v.roll_rad) + ")";
      });
}

void bind_model_file(nb::module_& m) {
  using io::ModelFile;
  nb::class_<ModelFile>(m, "Model", "A needle with effects: the content of a model file (model.toml).")
      .def(
          "__init__",
          [](ModelFile* self, const NeedleParameters& needle, std::vector<io::EffectEntry> effects,
             std::optional<model::Variation> variation) {
            new (self) ModelFile(make_model(needle, std::move(effects), variation));
          },
          "needle"_a = NeedleParameters{}, "effects"_a = std::vector<io::EffectEntry>{}, nb::kw_only(),
          "variation"_a = nb::none(),
          nb::sig("def __init__(self, needle: Needle = ..., effects: collections.abc.Sequence[Effect] = ..., *, "
                  "variation: Variation | None = None) -> None"),
          "Args:\n"
          "    needle: parameters of the extended bicycle model.\n"
          "    effects: at most 8.\n"
          "    variation: standard deviations between insertions; None: unknown.")
      .def_static(
          "load",
          [](const std::filesystem::path& path) {
            return with_io_errors([&] { return io::load_model_file(path.string()); });
          },
          "path"_a,
          "Reads a model file.\n\n"
          "Raises:\n"
          "    ConfigurationError: the content is invalid; the message lists every fault.\n"
          "    IoError: the file cannot be read.")
      .def_static(
          "parse", [](const std::string& text) { return io::parse_model_file(text, "model"); }, "text"_a,
          "Reads the text of a model file.")
      .def(
          "save",
          [](const ModelFile& self, const std::filesystem::path& path) {
            with_io_errors([&] { io::save_model_file(self, path.string()); });
          },
          "path"_a, "Writes a model file. load() returns the same values, to the last bit.")
      .def(
          "to_toml", [](const ModelFile& self) { return io::to_toml(self); }, "Returns the text of the model file.")
      .def_ro("needle", &ModelFile::needle, "Parameters of the extended bicycle model.")
      .def_prop_ro(
          "effects", [](const ModelFile& self) { return self.effects; }, "Effects, a list.")
      .def_ro("variation", &ModelFile::variation, "Standard deviations between insertions; None: unknown.")
      .def_prop_ro(
          "discrepancies", [](const ModelFile& self) { return self.discrepancies.size(); },
          "Number of discrepancy terms (unmodelled physics without a name).")
      .def("__getstate__", [](const ModelFile& self) { return io::to_toml(self); })
      .def("__setstate__",
           [](ModelFile& self, const std::string& text) { new (&self) ModelFile(io::parse_model_file(text, "model")); })
      .def(
          "__eq__", [](const ModelFile& a, const ModelFile& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__repr__", [](const ModelFile& self) {
        std::string text = "Model(" + repr_of(self.needle);
        if (!self.effects.empty()) {
          text += ", [";
          for (const auto& effect : self.effects)
            text += (&effect == self.effects.data() ? "" : ", ") + repr_of(effect);
          text += "]";
        }
        return text + ")";
      });
  nb::implicitly_convertible<NeedleParameters, ModelFile>();
}

}  // namespace

void bind_model(nb::module_& m) {
  bind_needle(m);
  bind_effect_types(m);
  bind_variation(m);
  bind_model_file(m);
}

}  // namespace bevel::python
