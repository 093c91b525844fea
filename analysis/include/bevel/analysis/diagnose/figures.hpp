// SPDX-License-Identifier: MIT
// Numbers as the tool prints them, on the page and on the terminal.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/report/numbers.hpp>

namespace bevel::analysis {

using report::measured;
using report::number;
// Rounded to two digits of its error: "0.823 ± 0.031".
std::string with_error(double value, double std_error);
// Both ends rounded alike: "0.76 to 0.89".
std::string interval(const std::array<double, 2>& ends);
std::string percent(double share);
std::string probability(double p);                                      // never 100 %, never 0 %
std::string log_factor(const std::optional<double>& log_bayes_factor);  // a tenth is as fine as it means anything
std::string listed(const std::vector<std::string>& names, const std::string& last = " and ");
// "curvature 5 % (none: 2 %)"
std::string variation_in_words(const diagnosis::VariationEstimate& variation);

// The unit at the end of a name: "mm" of "depth_mm", "rad/s" of "turn_rate_rad_s"; "" if it has none.
std::string unit_of(std::string_view name);
// The name in words, its unit behind: "lag at 100mm (rad)", "depth (mm)".
std::string in_words(std::string_view name);

// "lost_steps (rotation)", an effect tried in one of its kinds: whether that is the kind of the effect that was found.
bool is_kind_of(std::string_view tried, const diagnosis::FoundEffect& found);
// The same for a parameter of an effect.
bool is_kind_of(std::string_view tried, std::string_view effect, std::string_view parameter);

bool was_found(const diagnosis::Findings& findings, std::string_view effect);
// Effects of which no parameter, at the size that the field reports, would have been seen; none that was found.
std::vector<std::string> not_to_be_seen(const diagnosis::Findings& findings);

// By how much what was found moves the tip, at the deepest reading of each recording: root mean squares over the
// recordings of distances in space, of predictions, so without the noise of a reading.
struct MovedAtDepth {
  std::array<double, 2> depth_mm{};  // shallowest and deepest of those readings
  double from_file_mm = 0;           // against the model file as it stands
  double from_refitted_mm = 0;       // against its needle refitted
};
std::optional<MovedAtDepth> moved_at_depth(const diagnosis::Findings& findings);  // none without a recording

// "moves the tip by 1.8 mm", at the deepest readings.
std::string moved_in_words(double moved_at_depth_mm);
/// Describes a reason that ended insertions: "needle state unhealthy, measurements rejected in a row: 6, limit 5, at a
/// depth of 12 to 31 mm".
std::string stopped_in_words(const diagnosis::SteeredFigures::Stopped& stopped);
/// Describes the insertions with one model: "median 0.31 mm, worst 0.8 mm, 7 of 8 arrived (1 stopped by ...)".
std::string steered_in_words(const diagnosis::SteeredFigures& figures, std::size_t targets);
/// Steering with the model that was found, compared with the model file as it stands.
enum class Steering {
  better,  ///< more targets reached; or the paired misses are smaller by more than two standard errors
  equal,   ///< no difference beyond chance
  worse,
  fails  ///< neither model reaches a target
};
Steering steering_with(const diagnosis::SteeredToTargets& steered);
/// Returns whether the model that was found is not to be adopted for steering.
constexpr bool is_refused(Steering steering) { return steering == Steering::worse || steering == Steering::fails; }
/// Returns the advice in verdict.json: "adopt", "either" or "do-not-adopt".
std::string_view name_of(Steering steering);
/// States the paired difference and whether the model that was found is to be adopted for steering.
std::string steering_advice(const diagnosis::SteeredToTargets& steered);
std::string span_mm(const diagnosis::SteeredToTargets& steered);  // "74 to 82 mm", of the targets' depths

// Of the checks of the final model, a sentence.
std::string what_is_left(const diagnosis::Checks& checks);
std::string headline_of(diagnosis::Verdict verdict, bool two_groups = false);  // "Effects found", ...

}  // namespace bevel::analysis
