// SPDX-License-Identifier: MIT
// bevel-diagnose: from logs and the model in use to verdict.json, report.html and model.toml, and for an unknown effect
// to the source of the one that is proposed.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include <bevel/analysis/diagnose/provenance.hpp>
#include <bevel/analysis/diagnose/result_files.hpp>
#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::analysis {

struct DiagnoseOptions {
  std::string model_path, out_folder;
  std::vector<std::string> logs;               // or
  std::vector<std::string> baseline, changed;  // two groups, files and folders: what changed?
  int threads = 2;
  int targets = 8;     // steered to in simulated time (steered.hpp); 0: none
  bool quiet = false;  // no progress on stderr
};

// What is wrong with which recordings are given; "" if nothing.
std::string usage_fault(const DiagnoseOptions& options);

struct Found {
  diagnosis::Findings findings;
  io::ModelFile model;  // in use
  Provenance made_of;
  bool input_damaged = false;  // so that it did not stand in the way; the findings' remarks say how
};

// Throws IoError or ArgumentError with one sentence for input that cannot be diagnosed. Writes
// nothing, and says on `err` what of the input is damaged.
Found find(const DiagnoseOptions& options, std::ostream& err);

void print_verdict(std::ostream& out, const diagnosis::Findings& findings);

// For write_together(): the page, the augmented model, the proposed effect where there is one, and last the verdict.
std::vector<ResultFile> result_files(const diagnosis::Findings& findings, const io::ModelFile& augmented,
                                     const Provenance& made_of);
// Of those files, for a message.
std::string result_names(const diagnosis::Findings& findings);

// All of it; returns the exit status.
int run(const DiagnoseOptions& options, std::ostream& out, std::ostream& err);

}  // namespace bevel::analysis
