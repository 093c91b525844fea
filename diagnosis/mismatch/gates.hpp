#pragma once
// The two gates that a named effect has to pass: it foretells recordings that it was not fitted on, and what it leaves
// is noise. The first catches a name that fits by accident, the second an effect that is on no list.
#include "diagnosis/mismatch/corrections.hpp"
#include "diagnosis/mismatch/findings.hpp"

namespace bevel::diagnosis {

// Each recording foretold by the hypothesis fitted on the others; only phases and instants, which every recording has
// for itself, are fitted on the recording held out.
struct HeldOutFit {
  std::vector<Eigen::VectorXd> values;  // per recording: of the fit without it
  std::vector<double> chi2;             // of the recording held out
  std::vector<std::size_t> count;
  double total() const;
};
HeldOutFit leave_one_out(const Evidence& evidence, const Fit& fit, int threads);

// From these on something remains beside named effects: slow structure, in standard deviations of what noise leaves; a
// correlation from reading to reading, in its chance under noise (forms that are not quite the rig's leave 1e-5).
inline constexpr double kStructureSigmas = 4.0;
inline constexpr double kStructureChance = 1e-6;

// What is left of a fit.
struct Remains {
  double chi2_per_dof = 0;
  std::array<double, 2> band{};  // 99 %
  double structure_sigmas = 0;   // slow structure (splines, one knot a second): (energy - mean) / sd under noise
  double structure_energy = 0;   // energy above its mean, in chi2
  double ljung_box_p = 1;        // smallest of all series, times their number (Bonferroni), at most 1
  bool has_structure() const { return structure_sigmas > kStructureSigmas || ljung_box_p < kStructureChance; }
  bool is_noise() const {
    return structure_sigmas < kStructureSigmas && ljung_box_p > 0.001 && chi2_per_dof > band[0] &&
           chi2_per_dof < band[1];
  }
};
Remains examine_remains(const Evidence& evidence, const Fit& fit);

}  // namespace bevel::diagnosis
