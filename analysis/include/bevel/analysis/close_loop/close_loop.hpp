// SPDX-License-Identifier: MIT
// What a diagnosis is good for: the model that it leaves, put back into the rig, the estimator and the controller, and
// what each does with it against what it did before.
#pragma once

#include <iosfwd>
#include <string>

#include <bevel/analysis/close_loop/estimator_figure.hpp>
#include <bevel/analysis/close_loop/models.hpp>
#include <bevel/analysis/close_loop/rig_figure.hpp>
#include <bevel/analysis/close_loop/targeting_figure.hpp>
#include <bevel/analysis/diagnose/provenance.hpp>

namespace bevel::analysis {

struct CloseLoopOptions {
  std::string folder, out_folder;
  std::string estimator_path;
  int threads = 2;
  bool quiet = false;  // no progress on stderr
  TargetingOptions targeting;
};

// The estimator's figure in two settings, see with_needle_known().
struct EstimatorFigures {
  std::array<EstimatorFigure, kStages> known, free;
};

struct ClosedLoop {
  std::string case_name;
  diagnosis::Findings findings;
  Provenance made_of;
  bool input_damaged = false;  // as in Found
  Models models;
  std::array<RigFigure, kStages> rig;
  EstimatorFigures estimator;
  TargetingFigures targeting;
};

// Throws IoError, ArgumentError or io::ConfigError with one sentence for a case that cannot be used.
// Writes nothing, and says on `err` what of the input is damaged.
ClosedLoop close_the_loop(const CloseLoopOptions& options, std::ostream& err);

// The mismatch tool's three files, close-the-loop.json and close-the-loop.html, all or none. Throws IoError
// naming the file and the reason.
void write_results(const ClosedLoop& loop, const std::string& out_folder);

// All of it, the table on `out`. Returns the exit status.
int run(const CloseLoopOptions& options, std::ostream& out, std::ostream& err);

}  // namespace bevel::analysis
