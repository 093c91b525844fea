// SPDX-License-Identifier: MIT
#pragma once
// Section IV's protocol on a simulated plant: 130 mm of depth, no rotation, three trials, a 30 Hz webcam above.
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/angle_rate.hpp>
#include <bevel/diagnosis/identification/figures.hpp>
#include <bevel/diagnosis/identification/trajectory_fit.hpp>
#include <bevel/model/beam/beam_plant.hpp>

namespace bevel::analysis {

inline constexpr double kDepth_mm = 130;
inline constexpr double kCameraSigma_mm = 0.2;  // tip noise of a webcam at this field of view
inline constexpr double kFrameRate_Hz = 30;

// One row of Table I as printed.
struct PaperRow {
  std::string tissue;
  double speed_mm_s;
  double lambda1, lambda2, largest_extended_mm, largest_bicycle_mm;
};
const std::vector<PaperRow>& paper_rows();

// A tissue to insert into: the path of the tip over the fed length, one point per kPathSpacing_mm, to kDepth_mm.
struct TissuePath {
  std::string tissue;
  std::vector<Eigen::Vector3d> tip_mm;
  std::string description;
};
inline constexpr double kPathSpacing_mm = 0.25;
TissuePath kinematic_path(const std::string& tissue, const model::NeedleParameters& needle);
TissuePath beam_path(const std::string& tissue, double modulus_kPa, double force_N);

// Noisy recording of it at this speed.
diagnosis::Insertion record(const TissuePath& path, double speed_mm_s, std::uint64_t seed,
                            double sigma_mm = kCameraSigma_mm);

// The bicycle as Table I compares it: the circle tangent to z at the entry with the least squared lateral error at the
// same depth.
model::NeedleParameters best_circle(const diagnosis::Insertion& insertion);
double largest_circle_error_mm(const TissuePath& path);

struct TissueRow {
  double speed_mm_s;
  diagnosis::Insertion mean;
  model::NeedleParameters extended, circle;
  double largest_extended_mm, largest_bicycle_mm, largest_angle_rate_mm, largest_angle_rate_k_mm;
};
struct Tissue {
  TissuePath path;
  diagnosis::FitResult fit;                 // trajectory, both speeds and all trials at once, k free
  diagnosis::AngleRateResult angle_rate;    // as printed, k held at the inferred one
  diagnosis::AngleRateResult angle_rate_k;  // and with k free
  diagnosis::FitResult tilted_bicycle;      // bicycle whose entry may be tilted in the bending plane, nothing else
  diagnosis::ErrorFigures tilted_error;     // its error at the same depth, over all trials
  std::vector<TissueRow> rows;
};
Tissue identify_tissue(const TissuePath& path, std::uint64_t seed);

// Bevel force at which this modulus gives a bicycle error nearest to the wanted one, within [0.05, limit] N.
double force_for_error_N(double modulus_kPa, double wanted_mm, double limit_N);

}  // namespace bevel::analysis
