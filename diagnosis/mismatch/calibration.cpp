#include "diagnosis/mismatch/calibration.hpp"

#include <cmath>

#include "diagnosis/mismatch/local_unknowns.hpp"

namespace bevel::diagnosis {
namespace {
constexpr double kSettledShare = 0.03;  // of sigma
constexpr double kSettledColour = 0.03;
constexpr int kRounds = 4;
}  // namespace

bool settled(const Calibration& one, const Calibration& again) {
  const Noise &a = one.noise, &b = again.noise;
  for (std::size_t c = 0; c < a.sigma_mm.size(); ++c)
    if (std::abs(b.sigma_mm[c] / a.sigma_mm[c] - 1) > kSettledShare) return false;
  return std::abs(a.ar1 - b.ar1) < kSettledColour && std::abs(a.ar2 - b.ar2) < kSettledColour &&
         one.outliers == again.outliers;
}

Calibration calibrate_beside(const RecordedCase& original, const Evidence& evidence, Fit fitted) {
  Evidence all = evidence, kept = evidence;
  all.recorded = &original;
  Calibration now = calibrate_noise(original, errors_of(all, fitted));
  for (int round = 0; round < kRounds; ++round) {
    const RecordedCase rest = without(original, now.outliers);
    kept.recorded = &rest;
    const Fit again = fit_beside_instants(kept, fitted.hypothesis, fitted.values);
    if (!again.valid) break;
    fitted = again;
    const auto before = now.outliers;
    now = calibrate_noise(original, errors_of(all, fitted));
    if (now.outliers == before) break;
  }
  return now;
}

}  // namespace bevel::diagnosis
