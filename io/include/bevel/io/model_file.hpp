// SPDX-License-Identifier: MIT
/// \file
/// Model files: needle parameters, effects, discrepancy terms and the variation between insertions, as TOML.
///
/// \code{.unparsed}
/// [needle]                      # curvature_per_mm, wheelbase_mm, lambda1_per_rad, lambda2 are required;
/// ...                           # slip = "isotropic" and front_wheel = "published" are the defaults
/// [[effect]]                    # zero or more
/// name = "lost_steps"           # a name from model/src/effects/registry.cpp
/// rotation_rad = 0.8            # its parameters; the default is the value at which the effect vanishes; a parameter
///                               # without such a value (the depth of a layer) is required
/// [effect.recordings."rec03.lcm"]  # parameters of one recording (an event time, a phase), by the log's file name;
/// at_s = 3.31                      # for recordings without this table they are in [[effect]] itself; default 0
///
/// [[discrepancy]]               # zero or more; with the effects at most model::kMaxEffects
/// component = "curvature_bevel" # a component from bevel/model/effects/discrepancy.hpp; it sets the unit of values
/// covariate = "depth_mm"        # a name of model::Covariate
/// knots = [0.0, 40.0, 80.0]     # ascending; for roll_rad 2 pi i / n, periodic, unless periodic = false
/// values = [0.0, 4e-4, 5e-4]    # at the knots; linear between them, constant outside
/// std_errors = [1e-5, 2e-5, 9e-5]  # standard errors of the values
///
/// [variation]                   # between-insertion standard deviations; default 0
/// curvature_relative = 0.05     # in units of curvature_per_mm
/// entry_angle_rad = 0.007       # about x and about y, each
/// entry_point_mm = 0.12         # along x and along y, each
/// roll_rad = 0.04
/// \endcode
///
/// Programs reject a file with a part that they do not support. To ignore the part would mean to treat its uncertainty
/// as zero.
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

/// One [[effect]] of a model file.
struct EffectEntry {
  std::string name;                            ///< name in the effect library, "lost_steps" for instance
  std::map<std::string, double> parameters{};  ///< as given, without defaults; the unit is in the parameter's name
  /// Parameters of model::Scope::recording, by the file name of the log; folders precede the name where file names are
  /// not unique.
  std::map<std::string, std::map<std::string, double>> recordings{};

  /// Compares all members.
  /// @return true if they are equal
  bool operator==(const EffectEntry&) const = default;
};

/// Contents of a model file.
struct ModelFile {
  model::NeedleParameters needle;                        ///< [needle]
  std::vector<EffectEntry> effects{};                    ///< [[effect]], in the order of the file
  std::vector<model::DiscrepancyCurve> discrepancies{};  ///< [[discrepancy]], in the order of the file
  std::optional<model::Variation> variation{};           ///< [variation]; empty if the variation is unknown

  /// Compares all members.
  /// @return true if they are equal
  bool operator==(const ModelFile&) const = default;
};

/// Reads a model file.
/// @param path  TOML file
/// @return the contents
/// @throws ConfigError with all faults of the file, including parameters outside the model's domain (Eqs. 23, 24, 26)
ModelFile load_model_file(const std::string& path);
/// Reads a model file from text.
/// @param text  TOML text
/// @param name  file name for error messages
/// @return the contents
/// @throws ConfigError as load_model_file()
ModelFile parse_model_file(std::string_view text, const std::string& name);

/// Reads a section [needle], for files that contain a needle among other sections. Faults are reported by
/// ConfigFile::finish().
/// @param needle  section with the needle's parameters
/// @return the parameters; those with faults have their default
model::NeedleParameters read_needle(Section needle);
/// Reads the tables [[effect]] of a section. Faults are reported by ConfigFile::finish().
/// @param parent  section that contains the tables; at most model::kMaxEffects
/// @return the effects in the order of the file
std::vector<EffectEntry> read_effects(Section parent);

/// Selects the effects with all their parameters for one recording, as model::AugmentedNeedle takes them.
///
/// Parameters of the recording take precedence over those of the effect. Parameters that are in neither have their
/// default.
/// @param effects  effects of a model file
/// @param recording_name  path or name of the recording's log; empty for no recording. The longest name in
/// EffectEntry::recordings that matches the end of the path applies.
/// @return one entry for each effect, in the same order
/// @throws ArgumentError if an effect or a parameter does not exist, or if a required parameter is missing
std::vector<model::ActiveEffect> active_effects(const std::vector<EffectEntry>& effects,
                                                std::string_view recording_name);
/// Selects effects and discrepancy terms for one recording.
/// @param effects  effects of a model file
/// @param discrepancies  discrepancy terms of a model file
/// @param recording_name  path or name of the recording's log; empty for no recording
/// @return the effects, followed by the discrepancy terms
/// @throws ArgumentError if an effect or a parameter does not exist, or if a required parameter is missing
std::vector<model::ActiveEffect> active_effects(const std::vector<EffectEntry>& effects,
                                                const std::vector<model::DiscrepancyCurve>& discrepancies,
                                                std::string_view recording_name);
/// Selects effects and discrepancy terms of a model file for one recording.
/// @param model  model file
/// @param recording_name  path or name of the recording's log; empty for no recording
/// @return the effects, followed by the discrepancy terms
/// @throws ArgumentError if an effect or a parameter does not exist, or if a required parameter is missing
std::vector<model::ActiveEffect> active_effects(const ModelFile& model, std::string_view recording_name);

/// Formats a model file. parse_model_file() returns the same values, bit by bit.
/// @param model  contents
/// @return TOML text
std::string to_toml(const ModelFile& model);
/// Writes a model file completely or not at all.
/// @param model  contents
/// @param path  destination; an existing file is replaced
/// @throws IoError with the file and the reason
void save_model_file(const ModelFile& model, const std::string& path);

}  // namespace bevel::io
