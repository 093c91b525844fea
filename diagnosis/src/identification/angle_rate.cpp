// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/identification/angle_rate.hpp>

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <cmath>

#include <bevel/error.hpp>

namespace bevel::diagnosis {
namespace {

// One moment of the polynomials: everything that (17) speaks of.
struct AngleSample {
  double gamma_rad;  // in print: below 0, the needle bends toward -y
  double gamma_rate_rad_s;
  double u1_mm_s;
};

Eigen::Vector4d fit_cubic(const Eigen::VectorXd& t, const Eigen::VectorXd& values) {
  Eigen::MatrixX4d A(t.size(), 4);
  A << Eigen::VectorXd::Ones(t.size()), t, t.cwiseAbs2(), t.cwiseAbs2().cwiseProduct(t);
  return A.householderQr().solve(values);
}
double rate(const Eigen::Vector4d& c, double t) { return c(1) + t * (2 * c(2) + 3 * t * c(3)); }
double second_rate(const Eigen::Vector4d& c, double t) { return 2 * c(2) + 6 * t * c(3); }

std::vector<AngleSample> angle_samples(const Insertion& insertion) {
  const double turned_rad = roll_range_rad(insertion);
  if (turned_rad > 0.02)
    throw ArgumentError(insertion.name + ": the shaft turns by " + std::to_string(turned_rad) +
                        " rad; the angle-rate method is planar and allows 0.02 rad");
  const auto& seen = insertion.observations;
  const auto n = static_cast<Eigen::Index>(seen.size());
  if (n < 8)
    throw ArgumentError(insertion.name + ": " + std::to_string(n) +
                        " measurements; the angle-rate method wants at least 8");
  Eigen::VectorXd t(n), y(n), z(n), s(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& o = seen[static_cast<std::size_t>(i)];
    t(i) = 1e-6 * static_cast<double>(o.utime - seen.front().utime);
    y(i) = o.position_mm.y();
    z(i) = o.position_mm.z();
    s(i) = o.insertion_mm;
  }
  const double duration_s = t(n - 1);
  if (!(duration_s > 0) || !(s(n - 1) > s(0)))
    throw ArgumentError(insertion.name + ": the needle does not advance; the angle-rate method wants an insertion");
  // Polynomials of t/T: the same curves as of t, better conditioned.
  t /= duration_s;
  const auto py = fit_cubic(t, y);
  const auto pz = fit_cubic(t, z);
  const auto ps = fit_cubic(t, s);
  std::vector<AngleSample> samples;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double dy = rate(py, t(i));
    const double dz = rate(pz, t(i));
    const double dd2 = dy * dy + dz * dz;
    samples.push_back({std::asin(dy / std::sqrt(dd2)),  // (28)
                       (dz * second_rate(py, t(i)) - dy * second_rate(pz, t(i))) / dd2 / duration_s,
                       rate(ps, t(i)) / duration_s});
  }
  return samples;
}

// (17) with (13) and (25), odd in gamma; the spatial form's k > 0 bends toward -y, hence -k.
struct AngleRate {
  AngleSample sample;
  double wheelbase_mm;
  double wheel_sign;

  template <class T>
  bool operator()(const T* k, const T* lambda, T* residual) const {
    using std::tan;
    const double size = std::abs(sample.gamma_rad);
    const T alpha = lambda[1] * sample.gamma_rad - lambda[0] * sample.gamma_rad * size;
    const T theta_rate = (-k[0] + wheel_sign * tan(alpha) / wheelbase_mm) * sample.u1_mm_s;
    residual[0] = theta_rate / (1.0 - lambda[1] + 2.0 * lambda[0] * size) - sample.gamma_rate_rad_s;
    return true;
  }
};

}  // namespace

AngleRateResult fit_angle_rate(const std::vector<Insertion>& insertions, const model::NeedleParameters& start,
                               bool fit_curvature) {
  AngleRateResult result;
  result.needle = start;
  double k = start.curvature_per_mm;
  std::array<double, 2> lambda{start.lambda1_per_rad, start.lambda2};
  const double sign = start.front_wheel == model::FrontWheel::published ? 1 : -1;
  ceres::Problem problem;
  for (const Insertion& insertion : insertions)
    for (const AngleSample& sample : angle_samples(insertion))
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<AngleRate, 1, 1, 2>(new AngleRate{sample, start.wheelbase_mm, sign}), nullptr,
          &k, lambda.data());
  if (problem.NumResiduals() == 0) throw ArgumentError("a fit wants at least one insertion");
  if (!fit_curvature) problem.SetParameterBlockConstant(&k);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 200;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  result.needle.curvature_per_mm = k;
  result.needle.lambda1_per_rad = lambda[0];
  result.needle.lambda2 = lambda[1];
  result.rate_rms_rad_s = std::sqrt(2 * summary.final_cost / problem.NumResiduals());
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.in_domain = !model::find_domain_violation(result.needle);
  result.message = summary.message;
  return result;
}

}  // namespace bevel::diagnosis
