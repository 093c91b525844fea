// SPDX-License-Identifier: MIT
#pragma once
// All trials together: the figures of the proof.
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "proof/intervals.hpp"
#include "proof/score.hpp"

namespace bevel::proof {

struct SensitivityBin {
  double low_sigmas;
  double high_sigmas;  // infinity in the last
  Share named;         // effects of this visible size that were named (unknown ones: called unknown)
  Share alarmed;       // trials of this visible size in which anything was named
};

// Verdicts by the probability that the tool gave to exactly what it said.
struct ReliabilityBin {
  double low = 0;
  double mean = 0;  // of those probabilities
  Share right;
};

inline constexpr const char* kBeyond = "in addition";

struct Tally {
  int trials = 0;
  int abstentions = 0;
  std::map<std::string, Share> strict;           // by visibility, and "all"; abstentions count as wrong
  std::map<std::string, Share> lenient;          // the same
  std::map<std::string, Share> strict_by_class;  // visible trials only, by class; the beam as a class of its own
  Share false_alarms;                            // of nulls
  Share unknown_called_unknown;                  // of visible unlisted effects
  Share unknown_distinct;                        // of those that no listed effect imitates
  Share unknown_alarms;                          // "unknown" called where nothing unlisted was concealed
  // Of visible unlisted effects: what was held out has a higher predictive density (a proper score: Gneiting and
  // Raftery 2007, JASA 102) than by the needle alone, or a smaller error.
  Share unknown_likelier, unknown_nearer;
  double mean_probability_of_truth = 0;
  Share truth_improbable;  // the truth had a probability below 0.01
  std::vector<ReliabilityBin> reliability;
  double expected_calibration_error = 0;  // mean distance of the bins' shares from their probabilities, by trials
  std::vector<SensitivityBin> sensitivity;
  // [truth][named]; truth "none": nothing could be seen; named "none": missed; truth kBeyond: named beside what was
  // there.
  std::map<std::string, std::map<std::string, int>> confusion;
  std::vector<double> z;
  double z_mean = 0;
  double z_spread = 0;
  Share covered;
  std::vector<double> z_nearest;  // against what the plain forms come to on the plant without noise
  double z_nearest_mean = 0;
  double z_nearest_spread = 0;
  Share covers_nearest;
  std::vector<double> z_needle;  // of k, lambda1, lambda2 (TrialScore::needle)
  double z_needle_mean = 0;
  double z_needle_spread = 0;
  Share needle_covered;
  std::vector<double> location_errors_s, location_errors_mm;
  Share located;  // within 0.2 s or 3 mm
  std::vector<double> chi2_before, chi2_after;
  Share chi2_at_floor;          // after within 10 % of one, in visible listed trials named rightly and in nulls
  std::vector<double> seconds;  // sorted
};

Tally tally(const std::vector<TrialScore>& scores);

double median(std::vector<double> values);  // 0 of none

nlohmann::json as_json(const TrialScore& score);
TrialScore trial_score_of(const nlohmann::json& j);
nlohmann::json as_json(const Tally& tally);

}  // namespace bevel::proof
