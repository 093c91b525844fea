#include "diagnosis/mismatch/likelihood.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace bevel::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Normal {
  MatrixXd A;
  VectorXd b;  // minus half the gradient
  double chi2 = 0, penalised = 0;
  bool valid = true;
};

// Belief about (k, lambda1, lambda2) as residuals of the unknowns (k, u, lambda2).
void add_belief(const Evidence& evidence, const Hypothesis& hypothesis, const VectorXd& values, bool with_jacobian,
                Normal& normal) {
  const auto needle = hypothesis.needle(values);
  const auto& belief = evidence.belief;
  const double width_k = evidence.curvature_width_share * std::max(std::abs(belief.curvature_per_mm), 1e-4);
  const Eigen::Vector3d r((belief.curvature_per_mm - needle.curvature_per_mm) / width_k,
                          (belief.lambda1_per_rad - needle.lambda1_per_rad) / evidence.lambda1_width_per_rad,
                          (belief.lambda2 - needle.lambda2) / evidence.lambda2_width);
  normal.penalised += r.squaredNorm();
  if (!with_jacobian) return;
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
  J(0, 0) = 1 / width_k;
  J(1, 1) = 1 / evidence.lambda1_width_per_rad;
  J(1, 2) = needle.lambda2 / std::numbers::pi / evidence.lambda1_width_per_rad;
  J(2, 2) = 1 / evidence.lambda2_width;
  normal.A.topLeftCorner<3, 3>() += J.transpose() * J;
  normal.b.head<3>() += J.transpose() * r;
}

Normal assemble(const Evidence& evidence, const Hypothesis& hypothesis, const FitRules& rules, const VectorXd& values,
                bool with_jacobian, Workspace& workspace) {
  Normal normal;
  const Index size = hypothesis.size();
  if (with_jacobian) normal.A.setZero(size, size), normal.b.setZero(size);
  for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
    if (!evidence.uses(r)) continue;
    if (!evaluate(evidence, hypothesis, r, values, with_jacobian, workspace)) {
      normal.valid = false;
      normal.chi2 = normal.penalised = std::numeric_limits<double>::infinity();
      return normal;
    }
    const auto& residuals = workspace.residuals;
    normal.chi2 += residuals.white.squaredNorm();
    if (!with_jacobian) continue;
    const auto& columns = hypothesis.columns(r);
    const MatrixXd A = residuals.jacobian.transpose() * residuals.jacobian;
    const VectorXd b = residuals.jacobian.transpose() * residuals.white;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      normal.b[columns[i]] -= b[static_cast<Index>(i)];
      for (std::size_t j = 0; j < columns.size(); ++j)
        normal.A(columns[i], columns[j]) += A(static_cast<Index>(i), static_cast<Index>(j));
    }
  }
  normal.penalised = normal.chi2;
  add_belief(evidence, hypothesis, values, with_jacobian, normal);
  if (rules.precision.size() > 0) {
    const VectorXd pull = rules.precision * values;
    normal.penalised += values.dot(pull);
    if (with_jacobian) normal.A += rules.precision, normal.b -= pull;
  }
  return normal;
}

// Unknowns that may move: not held, moved by the data, and not pressed against a bound.
std::vector<Index> free_unknowns(const Hypothesis& hypothesis, const FitRules& rules, const Normal& normal,
                                 const VectorXd& values) {
  std::vector<Index> free;
  for (Index i = 0; i < hypothesis.size(); ++i) {
    const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(i)];
    if (std::find(rules.held.begin(), rules.held.end(), static_cast<int>(i)) != rules.held.end()) continue;
    if (!(normal.A(i, i) > 0)) continue;
    if (!u.periodic && values[i] <= u.lower && normal.b[i] < 0) continue;
    if (!u.periodic && values[i] >= u.upper && normal.b[i] > 0) continue;
    free.push_back(i);
  }
  return free;
}

}  // namespace

VectorXd errors_of(const Series& series, const Channel& channel, const model::OpenLoop& path) {
  VectorXd errors(static_cast<Index>(series.reading.size()));
  for (std::size_t i = 0; i < series.reading.size(); ++i)
    errors[static_cast<Index>(i)] = series.measured_mm[i] - channel.axis.dot(path.position_mm[series.reading[i]]);
  return errors;
}

bool evaluate(const Evidence& evidence, const Hypothesis& hypothesis, std::size_t r, const VectorXd& values,
              bool with_jacobian, Workspace& workspace) {
  const Recording& recording = evidence.recorded->recordings[r];
  const model::AugmentedNeedle needle = hypothesis.make_needle(r, values, with_jacobian);
  if (!model::predict(needle, recording.motion, workspace.open_loop)) return false;
  const auto& path = workspace.open_loop;
  Index rows = 0;
  for (const auto& series : recording.series) rows += static_cast<Index>(series.time_s.size());
  auto& out = workspace.residuals;
  out.white.resize(rows);
  if (with_jacobian) out.jacobian.resize(rows, needle.columns());
  Index row = 0;
  for (std::size_t c = 0; c < recording.series.size(); ++c) {
    const Series& series = recording.series[c];
    const auto count = static_cast<Index>(series.time_s.size());
    if (count == 0) continue;
    const Channel& channel = evidence.recorded->channels[c];
    out.white.segment(row, count) = errors_of(series, channel, path);
    for (Index i = 0; with_jacobian && i < count; ++i)
      out.jacobian.row(row + i).noalias() =
          -channel.axis.transpose() *
          path.jacobian.middleRows<3>(static_cast<Index>(3 * series.reading[static_cast<std::size_t>(i)]));
    const Whitening whitening = make_whitening(series, evidence.noise, evidence.noise.sigma_mm[c]);
    whiten(whitening, out.white.segment(row, count));
    if (with_jacobian) whiten(whitening, out.jacobian.middleRows(row, count));
    row += count;
  }
  // From (k, lambda1, lambda2) to (k, u, lambda2): lambda1 = u + lambda2^2/(2 pi).
  if (with_jacobian)
    out.jacobian.col(kUnknownLambda2) += values[kUnknownLambda2] / std::numbers::pi * out.jacobian.col(kUnknownU);
  return out.white.allFinite();
}

std::size_t Fit::count() const {
  std::size_t sum = 0;
  for (auto n : count_by_recording) sum += n;
  return sum;
}

Eigen::MatrixXd Fit::covariance() const {
  std::vector<Index> moved;
  for (Index i = 0; i < information.rows(); ++i)
    if (information(i, i) > 0) moved.push_back(i);
  const auto n = static_cast<Index>(moved.size());
  MatrixXd part(n, n);
  VectorXd scale(n);
  for (Index i = 0; i < n; ++i)
    scale[i] = 1 / std::sqrt(information(moved[static_cast<std::size_t>(i)], moved[static_cast<std::size_t>(i)]));
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j)
      part(i, j) =
          information(moved[static_cast<std::size_t>(i)], moved[static_cast<std::size_t>(j)]) * scale[i] * scale[j];
  part.diagonal().array() += 1e-12;
  const MatrixXd inverse = part.ldlt().solve(MatrixXd::Identity(n, n));
  MatrixXd covariance = MatrixXd::Zero(information.rows(), information.cols());
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j)
      covariance(moved[static_cast<std::size_t>(i)], moved[static_cast<std::size_t>(j)]) =
          inverse(i, j) * scale[i] * scale[j];
  return covariance;
}

Fit fit(const Evidence& evidence, const Hypothesis& hypothesis, const VectorXd& start, const FitRules& rules) {
  Fit out(hypothesis);
  Workspace workspace;
  VectorXd values = start;
  hypothesis.clamp(values);
  Normal now = assemble(evidence, hypothesis, rules, values, true, workspace);
  double damping = 1e-4;
  for (int iteration = 0; now.valid && iteration < rules.max_iterations; ++iteration) {
    out.iterations = iteration + 1;
    const auto free = free_unknowns(hypothesis, rules, now, values);
    if (free.empty()) break;
    const auto n = static_cast<Index>(free.size());
    MatrixXd A(n, n);
    VectorXd b(n);
    for (Index i = 0; i < n; ++i) {
      b[i] = now.b[free[static_cast<std::size_t>(i)]];
      for (Index j = 0; j < n; ++j)
        A(i, j) = now.A(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]);
    }
    bool moved = false, small = false;
    while (damping < 1e8) {
      MatrixXd damped = A;
      damped.diagonal() *= 1 + damping;
      const VectorXd step = damped.ldlt().solve(b);
      VectorXd trial = values;
      for (Index i = 0; i < n; ++i) trial[free[static_cast<std::size_t>(i)]] += step[i];
      hypothesis.clamp(trial);
      const Normal there = assemble(evidence, hypothesis, rules, trial, false, workspace);
      if (there.valid && there.penalised < now.penalised) {
        small = now.penalised - there.penalised < rules.tolerance;
        values = trial;
        damping = std::max(damping * 0.2, 1e-7);
        moved = true;
        break;
      }
      // What the linear model promises is too little to look for.
      if (step.allFinite() && b.dot(step) < rules.tolerance) break;
      damping *= 6;
    }
    if (!moved) break;
    now = assemble(evidence, hypothesis, rules, values, true, workspace);
    if (small) break;
  }
  out.values = values;
  out.valid = now.valid;
  out.chi2 = now.chi2;
  out.penalised = now.penalised;
  out.information = now.A;
  const std::size_t recordings = evidence.recorded->recordings.size();
  out.chi2_by_recording.assign(recordings, 0);
  out.count_by_recording.assign(recordings, 0);
  for (std::size_t r = 0; out.valid && r < recordings; ++r)
    if (evaluate(evidence, hypothesis, r, values, false, workspace)) {
      out.chi2_by_recording[r] = workspace.residuals.white.squaredNorm();
      if (evidence.uses(r)) out.count_by_recording[r] = static_cast<std::size_t>(workspace.residuals.white.size());
    }
  return out;
}

Errors errors_of(const Evidence& evidence, const Fit& fit) {
  Errors errors(evidence.recorded->recordings.size());
  Workspace workspace;
  for (std::size_t r = 0; r < errors.size(); ++r) {
    const Recording& recording = evidence.recorded->recordings[r];
    model::predict(fit.hypothesis.make_needle(r, fit.values, false), recording.motion, workspace.open_loop);
    for (std::size_t c = 0; c < recording.series.size(); ++c)
      errors[r].push_back(errors_of(recording.series[c], evidence.recorded->channels[c], workspace.open_loop));
  }
  return errors;
}

}  // namespace bevel::diagnosis
