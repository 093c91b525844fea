// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/identification/fit_statistics.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace bevel::diagnosis {
namespace {
constexpr double kNormal95 = 1.959963984540054;

double value_of(const model::NeedleParameters& needle, Parameter parameter) {
  switch (parameter) {
    case kNeedleCurvature:
      return needle.curvature_per_mm;
    case kNeedleLambda1:
      return needle.lambda1_per_rad;
    case kNeedleLambda2:
      return needle.lambda2;
    default:
      return needle.wheelbase_mm;
  }
}

// Inverse of a symmetric matrix that may be singular: what is not fixed at all gets a variance of 1e12.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const Eigen::VectorXd variance = eigen.eigenvalues().cwiseMax(1e-12).cwiseInverse();
  return eigen.eigenvectors() * variance.asDiagonal() * eigen.eigenvectors().transpose();
}
}  // namespace

double huber_efficiency(const std::vector<double>& scaled_residuals, double threshold) {
  double inside = 0;
  double psi2 = 0;
  for (const double r : scaled_residuals) {
    inside += std::abs(r) <= threshold ? 1 : 0;
    psi2 += std::min(r * r, threshold * threshold);
  }
  const double n = static_cast<double>(scaled_residuals.size());
  return psi2 > 0 ? (inside / n) * (inside / n) / (psi2 / n) : 1;
}

double lag1_correlation(const std::vector<double>& residuals, const std::vector<std::size_t>& series) {
  double products = 0;
  double squares = 0;
  for (std::size_t k = 0; k + 1 < series.size(); ++k)
    for (std::size_t i = series[k]; i < series[k + 1]; ++i) {
      squares += residuals[i] * residuals[i];
      if (i > series[k]) products += residuals[i] * residuals[i - 1];
    }
  const double n = static_cast<double>(residuals.size());
  const double rho = squares > 0 ? products / squares : 0;
  return std::abs(rho) > 2 / std::sqrt(n) ? std::clamp(rho, -0.99, 0.99) : 0;
}

double robust_scale(std::vector<double>& residuals) {
  for (double& r : residuals) r = std::abs(r);
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return 1.4826 * *middle;
}

double deviance(const std::vector<double>& residuals, double threshold) {
  const double n = static_cast<double>(residuals.size());
  double s2 = 0;
  for (const double r : residuals) s2 += r * r / n;
  if (!(s2 > 0)) return -1e300;
  double loss = 0;
  // Stationary where s^2 = mean(min(r^2, c s |r|)): each pass moves s toward it from above.
  for (int pass = 0; pass < 30; ++pass) {
    const double limit = threshold * std::sqrt(s2);
    double next = 0;
    loss = 0;
    for (const double r : residuals) {
      const double size = std::abs(r);
      const bool inside = size <= limit;
      next += (inside ? size * size : limit * size) / n;
      loss += inside ? 0.5 * size * size / s2 : threshold * (size / std::sqrt(s2) - 0.5 * threshold);
    }
    if (std::abs(next - s2) < 1e-10 * s2) break;
    s2 = next;
  }
  return 0.5 * n * std::log(s2) + loss;
}

void fill_uncertainty(const Eigen::MatrixXd& data_information, const std::vector<Parameter>& parameters,
                      const std::vector<bool>& free, const Priors& priors, FitResult& result) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  Eigen::VectorXd unit(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& prior = priors[parameters[static_cast<std::size_t>(i)]];
    unit(i) = prior ? prior->sigma : kPlausibleRange[parameters[static_cast<std::size_t>(i)]];
  }
  // Everything below in plausible units: the eigenvalues then compare like with like.
  const Eigen::MatrixXd data = unit.asDiagonal() * data_information * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(data);
  result.directions.clear();
  for (Eigen::Index i = n - 1; i >= 0; --i)
    result.directions.push_back({eigen.eigenvectors().col(i), 1 / std::sqrt(std::max(eigen.eigenvalues()(i), 1e-12))});

  Eigen::MatrixXd posterior = data;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (priors[parameters[static_cast<std::size_t>(i)]]) posterior(i, i) += 1;
    if (free[static_cast<std::size_t>(i)]) continue;
    posterior.row(i).setZero();  // at a bound: the others' errors are given that it stays there
    posterior.col(i).setZero();
    posterior(i, i) = 1e12;
  }
  const Eigen::MatrixXd scaled = inverse(posterior);
  for (Eigen::Index i = 0; i < n; ++i)
    if (priors[parameters[static_cast<std::size_t>(i)]] && free[static_cast<std::size_t>(i)]) posterior(i, i) -= 1;
  const Eigen::VectorXd by_data = inverse(posterior).diagonal().cwiseSqrt().cwiseProduct(unit);
  result.covariance = unit.asDiagonal() * scaled * unit.asDiagonal();
  result.correlation.resize(n, n);
  result.parameters.clear();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      result.correlation(i, j) = scaled(i, j) / std::sqrt(scaled(i, i) * scaled(j, j));
    const Parameter p = parameters[static_cast<std::size_t>(i)];
    const double value = value_of(result.needle, p);
    const double error = std::sqrt(result.covariance(i, i));
    result.parameters.push_back({p, value, error, by_data(i), value - kNormal95 * error, value + kNormal95 * error,
                                 priors[p] ? scaled(i, i) : 0, !free[static_cast<std::size_t>(i)]});
  }
}

int FitResult::unfixed_directions() const {
  return static_cast<int>(
      std::count_if(directions.begin(), directions.end(), [](const auto& d) { return d.sigma > 1; }));
}

const FittedParameter* FitResult::find(Parameter parameter) const {
  for (const auto& p : parameters)
    if (p.parameter == parameter) return &p;
  return nullptr;
}

}  // namespace bevel::diagnosis
