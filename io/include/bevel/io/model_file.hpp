// SPDX-License-Identifier: MIT
// The model file: the needle's parameters, the effects found by the mismatch tool, what it found and has no name for,
// and by how much insertions differ. TOML:
//
//   [needle]                      # curvature_per_mm, wheelbase_mm, lambda1_per_rad, lambda2 are required;
//   ...                           # slip = "isotropic", front_wheel = "published" unless given
//   [[effect]]                    # zero or more
//   name = "lost_steps"           # one of model/src/effects/registry.cpp
//   rotation_rad = 0.8            # its parameters; one left out has the value at which the effect vanishes, and is
//                                 # required where there is no such value (a layer's depth)
//   [effect.recordings."rec03.lcm"]  # unknowns of one recording (an instant, a phase), by the log's file name; for
//   at_s = 3.31                      # recordings without such a table they stand in [[effect]] itself, 0 if not
//
//   [[discrepancy]]               # zero or more; with the effects at most model::kMaxEffects
//   component = "curvature_bevel" # one of bevel/model/effects/discrepancy.hpp, whose unit the values have
//   covariate = "depth_mm"        # one of model::Covariate
//   knots = [0.0, 40.0, 80.0]     # ascending; over roll_rad 2 pi i / n, round the circle, unless periodic = false
//   values = [0.0, 4e-4, 5e-4]    # at the knots; linear between them, flat outside
//   std_errors = [1e-5, 2e-5, 9e-5]  # of the values
//
//   [variation]                   # standard deviations between insertions; one left out is 0
//   curvature_relative = 0.05     # of curvature_per_mm
//   entry_angle_rad = 0.007       # about x and about y, each
//   entry_point_mm = 0.12         # along x and along y, each
//   roll_rad = 0.04
//
// All of it is required reading: who cannot use a part refuses the file, or the part's uncertainty would be taken for
// knowledge.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bevel/io/config.hpp>
#include <bevel/io/model_uncertainty.hpp>
#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/needle.hpp>

namespace bevel::io {

struct EffectEntry {
  std::string name;
  std::map<std::string, double> parameters{};                         // as given, defaults not filled in
  std::map<std::string, std::map<std::string, double>> recordings{};  // log file name -> parameters of Scope::recording

  bool operator==(const EffectEntry&) const = default;
};

struct ModelFile {
  model::NeedleParameters needle;
  std::vector<EffectEntry> effects{};
  std::vector<model::DiscrepancyCurve> discrepancies{};
  std::optional<model::Variation> variation{};  // absent: nothing is known of it

  bool operator==(const ModelFile&) const = default;
};

// Throw ConfigError with every fault, the model's own domain (23), (24), (26) included.
ModelFile load_model_file(const std::string& path);
ModelFile parse_model_file(std::string_view text, const std::string& name);

// Parts of it, for files that hold a needle among other things: the [needle] section, and the [[effect]]s of a section.
model::NeedleParameters read_needle(Section needle);
std::vector<EffectEntry> read_effects(Section parent);

// The effects with all their parameters, the discrepancies behind them, as model::AugmentedNeedle
// takes them, for one recording: the path or the name of its log, empty if there is none. Throws ArgumentError
// for an effect or a parameter that does not exist.
std::vector<model::ActiveEffect> active_effects(const std::vector<EffectEntry>& effects,
                                                std::string_view recording_name);
std::vector<model::ActiveEffect> active_effects(const std::vector<EffectEntry>& effects,
                                                const std::vector<model::DiscrepancyCurve>& discrepancies,
                                                std::string_view recording_name);
std::vector<model::ActiveEffect> active_effects(const ModelFile& model, std::string_view recording_name);

// Reads back as the same values, to the last bit.
std::string to_toml(const ModelFile& model);
// Throws ParseError naming the file and the reason.
void save_model_file(const ModelFile& model, const std::string& path);

}  // namespace bevel::io
