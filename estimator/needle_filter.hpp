#pragma once
// Extended Kalman filter of the needle: pose on SE(3), curvature and lambda, driven by actuator increments.
//
// State: pose of {B} in {A} (error in the body frame, mm | rad), k, lambda1, lambda2. Nine error states, in this order.
// Model: model/kinematics.hpp, (10) with the slip of (25); measurement: tip position in {A}, information of any rank.
// Pure: no clock, no allocation, fixed-size Eigen. Covariance by the Joseph form, symmetric and floored.
#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "estimator/config.hpp"
#include "model/kinematics.hpp"
#include "model/samples.hpp"

namespace bevel::estimator {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

struct FilterState {
  model::Pose pose;
  double curvature_per_mm = 0;
  double lambda1_per_rad = 0;
  double lambda2 = 0;
  Matrix9d covariance = Matrix9d::Zero();
  std::int64_t measurement_utime = 0;  // newest accepted; 0 before the first
  std::int32_t rejects_in_row = 0;
  std::int32_t reset_count = 0;
  bool outside_model = false;
};

struct Update {
  bool accepted = false;
  bool reset = false;                                    // this measurement brought a declared reset
  int rank = 0;                                          // axes that it saw
  double mahalanobis2 = 0;                               // d^2 = innovation^T S^-1 innovation
  double test_ratio = 0;                                 // d^2 over the gate of its rank
  Eigen::Vector3d innovation = Eigen::Vector3d::Zero();  // first `rank` entries, along the seen axes, mm
  Eigen::Vector3d innovation_whitened =
      Eigen::Vector3d::Zero();  // L^-1 innovation, S = L L^T: unit variance if all is right
};

class NeedleFilter {
 public:
  explicit NeedleFilter(const EstimatorConfig& config);

  // The prior at the entry point: heading along z_A, bevel as the model file says.
  FilterState initial() const;

  // Moves the state by increments of the two axes. Where the model has no answer the pose stays, and outside_model is
  // set.
  void predict(FilterState& state, double insertion_mm, double rotation_rad) const;

  // Applies one measurement; its status must be 0 and its values finite (the checked decode sees to that).
  Update update(FilterState& state, const model::TipMeasurement& measurement) const;

  const EstimatorConfig& config() const { return config_; }

 private:
  void keep_in_domain(FilterState& state) const;
  void declare_reset(FilterState& state) const;

  EstimatorConfig config_;
  std::array<double, 3> gate_{};  // chi-square quantile by rank
  model::SlipParameters slip_;    // ell and the variants; lambda comes from the state
};

}  // namespace bevel::estimator
