// SPDX-License-Identifier: MIT
#include "tests/estimator/batch_map.hpp"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <cmath>

namespace bevel::estimator::testing {
namespace {

using Matrix69 = Eigen::Matrix<double, 6, 9>;

// The path from a start: pose and its derivative by the nine unknowns, moved along the actuators.
struct Path {
  model::Pose pose;
  Matrix69 by_start = Matrix69::Zero();
  double curvature_per_mm;
  model::SlipParameters slip;
  double insertion_mm = 0, rotation_rad = 0;

  Path(const EstimatorConfig& config, const Vector9d& x)
      : curvature_per_mm(config.prior.needle.curvature_per_mm + x[6]),
        slip(model::slip_parameters(config.prior.needle)) {
    pose = model::exp_se3(x.head<6>());
    by_start.leftCols<6>() = model::right_jacobian_se3(x.head<6>());
    slip.lambda1_per_rad += x[7];
    slip.lambda2 += x[8];
  }
  bool move_to(double new_insertion_mm, double new_rotation_rad) {
    model::StepJacobian j;
    if (!model::advance(pose, {new_insertion_mm - insertion_mm, new_rotation_rad - rotation_rad, {curvature_per_mm, 0}},
                        slip, j))
      return false;
    by_start = j.pose * by_start;
    by_start.col(6) += j.input.col(2);
    by_start.rightCols<2>() += j.slip.leftCols<2>();
    insertion_mm = new_insertion_mm;
    rotation_rad = new_rotation_rad;
    return true;
  }
};

class InsertionCost : public ceres::CostFunction {
 public:
  InsertionCost(const EstimatorConfig& config, const Insertion& data) : config_(config), data_(data) {
    mutable_parameter_block_sizes()->push_back(9);
    set_num_residuals(static_cast<int>(9 + 3 * data.measurements.size()));
    const Prior& p = config.prior;
    prior_sd_ << Eigen::Vector3d::Constant(p.position_sd_mm), p.tilt_sd_rad, p.tilt_sd_rad, p.roll_sd_rad,
        p.curvature_sd_per_mm, p.lambda1_sd_per_rad, p.lambda2_sd;
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Vector9d> x(parameters[0]);
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor> J(num_residuals(), 9);
    J.setZero();
    r.head<9>() = x.cwiseQuotient(prior_sd_);
    J.topRows<9>().diagonal() = prior_sd_.cwiseInverse();
    Path path(config_, x);
    std::size_t next = 0;
    for (std::size_t i = 0; i + 1 < data_.actuators.size(); ++i) {
      const auto& a = data_.actuators[i];
      const auto& b = data_.actuators[i + 1];
      for (; next < data_.measurements.size() && data_.measurements[next].utime <= b.utime; ++next) {
        const auto& m = data_.measurements[next];
        const double share = static_cast<double>(m.utime - a.utime) / static_cast<double>(b.utime - a.utime);
        if (!path.move_to(a.insertion_mm + share * (b.insertion_mm - a.insertion_mm),
                          a.rotation_rad + share * (b.rotation_rad - a.rotation_rad)))
          return false;
        const Eigen::Vector3d root = m.information_per_mm2.diagonal().cwiseSqrt();
        const auto row = static_cast<Eigen::Index>(9 + 3 * next);
        r.segment<3>(row) = root.cwiseProduct(path.pose.p_mm - m.position_mm);
        J.middleRows<3>(row) = root.asDiagonal() * path.pose.R * path.by_start.topRows<3>();
      }
      if (!path.move_to(b.insertion_mm, b.rotation_rad)) return false;
    }
    r.tail(static_cast<Eigen::Index>(3 * (data_.measurements.size() - next))).setZero();
    if (jacobians && jacobians[0])
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor>>(jacobians[0], num_residuals(), 9) = J;
    return true;
  }

 private:
  const EstimatorConfig& config_;
  const Insertion& data_;
  Vector9d prior_sd_;
};

}  // namespace

BatchMap solve_batch_map(const EstimatorConfig& config, const Insertion& data) {
  Vector9d x = Vector9d::Zero();
  InsertionCost cost(config, data);
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(options);
  problem.AddResidualBlock(&cost, nullptr, x.data());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.logging_type = ceres::SILENT;
  solver.function_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);

  Eigen::VectorXd r(cost.num_residuals());
  Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor> J(cost.num_residuals(), 9);
  const double* blocks[] = {x.data()};
  double* jacobians[] = {J.data()};
  cost.Evaluate(blocks, r.data(), jacobians);
  Path path(config, x);
  for (const auto& a : data.actuators) path.move_to(a.insertion_mm, a.rotation_rad);
  Matrix9d to_end = Matrix9d::Identity();
  to_end.topRows<6>() = path.by_start;
  BatchMap result;
  const Matrix9d information = J.transpose() * J;
  result.state.covariance = to_end * information.ldlt().solve(Matrix9d(to_end.transpose()));
  result.state.pose = path.pose;
  result.state.curvature_per_mm = path.curvature_per_mm;
  result.state.lambda1_per_rad = path.slip.lambda1_per_rad;
  result.state.lambda2 = path.slip.lambda2;
  result.cost = summary.final_cost;
  result.iterations = static_cast<int>(summary.iterations.size());
  return result;
}

}  // namespace bevel::estimator::testing
