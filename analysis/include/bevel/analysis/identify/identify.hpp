// SPDX-License-Identifier: MIT
#pragma once
// bevel-identify without its command line: logs and a starting model in, model.toml, figures.json, report.html out.
#include <iosfwd>
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/angle_rate.hpp>
#include <bevel/diagnosis/identification/candidates.hpp>

namespace bevel::analysis {

struct IdentifyOptions {
  std::vector<std::string> logs;
  std::string model_path;
  std::string out_folder;
  std::string method = "trajectory";  // or "angle-rate"
  std::string prior = "none";         // or "table1-agar", "table1-plastisol"
  bool bicycle = false;               // the bicycle is selected whatever its BIC
  bool fit_slip_in_plane = false;     // lambda is fitted although no shaft rotates
  bool fit_wheelbase = false;
  bool square_loss = false;
  double entry_tilt_rad = 0;  // standard deviations of each insertion's entry; 0 = nominal
  double entry_roll_rad = 0;
  double entry_offset_mm = 0;
  double late_entry_mm = 0;
};

// What the report tells.
struct Identification {
  model::NeedleParameters start;
  std::string method, prior;
  std::vector<diagnosis::Insertion> insertions;
  std::vector<std::string> faults;  // of the logs
  std::vector<diagnosis::Candidate> candidates;
  std::size_t preferred = 0;  // of the candidates: the one selection that table, text and model file share
  diagnosis::FitResult fit;   // of the preferred candidate; for angle-rate: of the same data, to compare with
  diagnosis::AngleRateResult angle_rate;
  std::string angle_rate_refusal;  // why there is none
  model::NeedleParameters chosen;  // what goes into model.toml
  diagnosis::ErrorFigures before, after;
};

// What is wrong with a log goes to `err` as well as into the report.
Identification identify(const IdentifyOptions& options, std::ostream& err);
void print_table(std::ostream& out, const Identification& result);
std::string figures_json(const Identification& result);
void save_report(const Identification& result, const std::string& path);

// All of it; returns the exit status.
int run(const IdentifyOptions& options, std::ostream& out, std::ostream& err);

}  // namespace bevel::analysis
