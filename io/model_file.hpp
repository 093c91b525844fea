// The model file: the needle's parameters and the effects found by the mismatch tool. TOML:
//
//   [needle]                      # curvature_per_mm, wheelbase_mm, lambda1_per_rad, lambda2 are required;
//   ...                           # slip = "isotropic", front_wheel = "published" unless given
//   [[effect]]                    # zero or more
//   name = "torsional_windup"     # one of known_effect_names()
//   lag_at_100mm_rad = 0.6        # the effect's own parameters, all numbers
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/config.hpp"
#include "model/needle.hpp"

namespace bevel::io {

struct EffectEntry {
  std::string name;
  std::map<std::string, double> parameters;

  bool operator==(const EffectEntry&) const = default;
};

struct ModelFile {
  model::NeedleParameters needle;
  std::vector<EffectEntry> effects;

  bool operator==(const ModelFile&) const = default;
};

const std::vector<std::string>& known_effect_names();

// Throw ConfigError with every fault, the model's own domain (23), (24), (26) included.
ModelFile load_model_file(const std::string& path);
ModelFile parse_model_file(std::string_view text, const std::string& name);

// The [needle] section alone, for files that hold a needle among other things.
model::NeedleParameters read_needle(Section needle);

// Reads back as the same values, to the last bit.
std::string to_toml(const ModelFile& model);
// Throws std::runtime_error naming the file and the reason.
void save_model_file(const ModelFile& model, const std::string& path);

}  // namespace bevel::io
