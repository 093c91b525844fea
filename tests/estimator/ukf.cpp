// SPDX-License-Identifier: MIT
#include "tests/estimator/ukf.hpp"

#include <Eigen/Cholesky>

namespace bevel::estimator::testing {
namespace {

constexpr int kSize = 9;
constexpr double kSpread = 1.7320508;  // sqrt(3): the fourth moment of a normal density along each axis
constexpr double kCentre = 1 - kSize / (kSpread * kSpread);
constexpr double kOther = 1 / (2 * kSpread * kSpread);

FilterState moved(const FilterState& state, const Vector9d& error) {
  FilterState result = state;
  result.pose = state.pose * model::exp_se3(error.head<6>());
  result.curvature_per_mm += error[6];
  result.lambda1_per_rad += error[7];
  result.lambda2 += error[8];
  return result;
}

Vector9d difference(const FilterState& from, const FilterState& to) {
  Vector9d error;
  error << model::log_se3(from.pose.inverse() * to.pose), to.curvature_per_mm - from.curvature_per_mm,
      to.lambda1_per_rad - from.lambda1_per_rad, to.lambda2 - from.lambda2;
  return error;
}

double weight(std::size_t i) { return i == 0 ? kCentre : kOther; }

}  // namespace

Ukf::Ukf(const EstimatorConfig& config) : config_(config), state_(NeedleFilter(config).initial()) {}

std::array<FilterState, 19> Ukf::sigma_points() const {
  std::array<FilterState, 19> points;
  const Matrix9d L = state_.covariance.llt().matrixL();
  points[0] = state_;
  for (int i = 0; i < kSize; ++i) {
    points[static_cast<std::size_t>(1 + 2 * i)] = moved(state_, kSpread * L.col(i));
    points[static_cast<std::size_t>(2 + 2 * i)] = moved(state_, -kSpread * L.col(i));
  }
  return points;
}

void Ukf::predict(double insertion_mm, double rotation_rad) {
  auto points = sigma_points();
  for (FilterState& point : points) {
    model::SlipParameters slip = model::slip_parameters(config_.prior.needle);
    slip.lambda1_per_rad = point.lambda1_per_rad;
    slip.lambda2 = point.lambda2;
    model::advance(point.pose, {insertion_mm, rotation_rad, {point.curvature_per_mm, 0}}, slip);
  }
  FilterState mean = points[0];
  for (int pass = 0; pass < 2; ++pass) {
    Vector9d step = Vector9d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) step += weight(i) * difference(mean, points[i]);
    mean = moved(mean, step);
  }
  Matrix9d P = Matrix9d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector9d d = difference(mean, points[i]);
    P += weight(i) * d * d.transpose();
  }
  const ProcessNoise& q = config_.process;
  Vector9d sd;
  sd << Eigen::Vector3d::Constant(q.position_mm), q.tilt_rad, q.tilt_rad, q.roll_rad, q.curvature_per_mm,
      q.lambda1_per_rad, q.lambda2;
  P.diagonal() += sd.cwiseAbs2() * std::abs(insertion_mm);
  state_ = mean;
  state_.covariance = 0.5 * (P + P.transpose());
}

double Ukf::update(const model::TipMeasurement& measurement) {
  const auto points = sigma_points();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) mean += weight(i) * points[i].pose.p_mm;
  Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 9, 3> C = Eigen::Matrix<double, 9, 3>::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d d = points[i].pose.p_mm - mean;
    S += weight(i) * d * d.transpose();
    C += weight(i) * difference(state_, points[i]) * d.transpose();
  }
  // An axis that is not seen gets a variance so large that nothing is learned from it.
  const Eigen::Vector3d information = measurement.information_per_mm2.diagonal();
  Eigen::Vector3d residual = measurement.position_mm - mean;
  for (int i = 0; i < 3; ++i) {
    S(i, i) += information[i] > 0 ? 1 / information[i] : 1e12;
    if (!(information[i] > 0)) residual[i] = 0;
  }
  const Eigen::LLT<Eigen::Matrix3d> llt(S);
  const Eigen::Matrix<double, 9, 3> K = llt.solve(C.transpose()).transpose();
  const Matrix9d P = state_.covariance - K * S * K.transpose();
  state_ = moved(state_, K * residual);
  state_.covariance = 0.5 * (P + P.transpose());
  return residual.dot(llt.solve(residual));
}

}  // namespace bevel::estimator::testing
