// SPDX-License-Identifier: MIT
#pragma once
// The study behind bevel-table1 and how it is told.
#include <array>
#include <iosfwd>

#include <bevel/analysis/table1/protocol.hpp>
#include <bevel/cli/progress_line.hpp>

namespace bevel::analysis {

struct ForceNeeded {
  double modulus_kPa;
  double at_1N_mm;  // largest bicycle error at 1 N, the upper end of what physics.md gives
  double force_N;   // for the paper's mean error; at the limit where it is out of reach
  double deflection_mm;
};

struct Table1Study {
  std::vector<Tissue> kinematic, beam;
  std::array<std::vector<ForceNeeded>, 2> reach;  // agar, plastisol
  // Largest circle error of Table I's lambdas at k, ell inferred: published and nonslip, at depth; agar, plastisol.
  std::array<std::array<double, 2>, 2> sign_mm{};
};

// Tells how far it is.
Table1Study run_study(cli::ProgressLine& progress);
void print(std::ostream& out, const Table1Study& study);
void save_report(const Table1Study& study, const std::string& path);

}  // namespace bevel::analysis
