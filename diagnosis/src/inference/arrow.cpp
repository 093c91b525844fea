// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/arrow.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kFar = 20;  // for scaled_erfc(), from where both its factors leave the range of a double

// exp(x^2) erfc(x), x >= 0.
double scaled_erfc(double x) {
  return x < kFar ? std::exp(x * x) * std::erfc(x) : (1 - 0.5 / (x * x)) / (x * std::sqrt(std::numbers::pi));
}

// What is left of an unknown's posterior that is held, from its bound inwards, all but those held eliminated:
// exp(-slope x - curvature x^2 / 2) over x > 0.
struct Tail {
  double curvature = 0;  // of the normal density that has its volume
  double square = 0;     // the mean of x^2
  VectorXd along;        // by how much all unknowns move with it
};

Tail tail_of(double slope, double curvature, VectorXd along) {
  const double beyond = slope / std::sqrt(2 * curvature), scaled = scaled_erfc(beyond);
  Tail out{.curvature = 4 * curvature / (scaled * scaled), .square = 0, .along = std::move(along)};
  if (beyond > kFar) {  // a series: exact to 1e-5, where the other is a difference of near equals
    const double bend = curvature / (slope * slope);
    out.square = (2 + bend * (74 * bend - 10)) / (slope * slope);
  } else {  // by parts, curvature <x^2> + slope <x> = 1 and curvature <x> + slope = 1 / volume
    const double volume = std::sqrt(0.5 * std::numbers::pi / curvature) * scaled;
    out.square = (1 - slope * (1 / volume - slope) / curvature) / curvature;
  }
  return out;
}

std::vector<Tail> tails_of(const MatrixXd& H, const VectorXd& g, const std::vector<Index>& held) {
  std::vector<Index> others;
  for (Index i = 0; i < H.rows(); ++i)
    if (std::find(held.begin(), held.end(), i) == held.end()) others.push_back(i);
  const VectorXd unit = H.diagonal()(others).cwiseSqrt().cwiseInverse();
  const Eigen::LLT<MatrixXd> factor(unit.asDiagonal() * H(others, others) * unit.asDiagonal());
  std::vector<Tail> out;
  for (const Index i : held) {
    double curvature = H(i, i), slope = g[i];
    VectorXd along = VectorXd::Unit(H.rows(), i);
    if (!others.empty() && factor.info() == Eigen::Success) {
      const VectorXd across = H(others, i).cwiseProduct(unit);
      const VectorXd taken = factor.solve(across);
      curvature -= across.dot(taken);
      slope -= taken.dot(g(others).cwiseProduct(unit));
      along(others) = -taken.cwiseProduct(unit);
    }
    out.push_back(tail_of(std::abs(slope), curvature, std::move(along)));
  }
  return out;
}
}  // namespace

MatrixXd ArrowBlock::own_information() const {
  MatrixXd out = ll;
  out.diagonal() += precision;
  return out;
}

double log_det(const Eigen::LLT<MatrixXd>& factor) { return 2 * factor.matrixLLT().diagonal().array().log().sum(); }

ArrowBlock make_block(const MatrixXd& L, const MatrixXd& Z, const VectorXd& w) {
  ArrowBlock out;
  out.ll.noalias() = L.transpose() * L;
  out.lz.noalias() = L.transpose() * Z;
  out.zz.noalias() = Z.transpose() * Z;
  out.lw.noalias() = L.transpose() * w;
  out.zw.noalias() = Z.transpose() * w;
  out.ww = w.squaredNorm();
  return out;
}

ArrowSolution solve(const std::vector<ArrowBlock>& blocks, const MatrixXd& precision, const VectorXd& centre,
                    const ArrowRules& rules) {
  ArrowSolution out;
  const Index n = precision.rows();
  MatrixXd H = precision;
  VectorXd g = precision * centre;
  out.least = centre.dot(g);
  const auto uses = [&](std::size_t r) { return rules.used.empty() || rules.used[r]; };
  std::vector<Eigen::LLT<MatrixXd>> factors(blocks.size());
  std::vector<VectorXd> pulls(blocks.size());
  for (std::size_t r = 0; r < blocks.size(); ++r) {
    const ArrowBlock& block = blocks[r];
    if (!uses(r)) continue;
    MatrixXd inner = block.own_information();
    inner.diagonal() *= 1 + rules.damping;
    factors[r].compute(inner);
    if (factors[r].info() != Eigen::Success) return out;
    pulls[r] = block.lw + block.precision.cwiseProduct(block.centre);
    const VectorXd own = factors[r].solve(pulls[r]);
    const MatrixXd across = factors[r].solve(block.lz);
    H += block.zz;
    H.noalias() -= block.lz.transpose() * across;
    g += block.zw;
    g.head(block.slope.size()) -= block.slope;
    g.noalias() -= block.lz.transpose() * own;
    out.least += block.ww + block.centre.dot(block.precision.cwiseProduct(block.centre)) - pulls[r].dot(own);
    out.log_volume_ratio += log_det(factors[r]) - block.precision.array().log().sum();
  }
  if (!rules.held.empty()) {
    const std::vector<Tail> tails = tails_of(H, g, rules.held);
    if (!rules.covariance_of) {
      out.of_tails = MatrixXd::Zero(n, n);
      for (const Tail& tail : tails) out.of_tails += tail.square * tail.along * tail.along.transpose();
    }
    for (std::size_t k = 0; k < rules.held.size(); ++k) {
      const Index i = rules.held[k];
      if (!rules.held_at.empty()) {
        const double at = rules.held_at[k];
        out.least += at * (at * H(i, i) - 2 * g[i]);
        g -= at * H.col(i);
      }
      H.row(i).setZero();
      H.col(i).setZero();
      H(i, i) = tails[k].curvature;
      g[i] = 0;
    }
  }
  out.information = H;
  H.diagonal() *= 1 + rules.damping;
  // In units of each unknown's own error, so that all can stand together.
  const VectorXd unit = H.diagonal().cwiseSqrt().cwiseInverse();
  if (!unit.allFinite()) return out;
  const MatrixXd scaled = unit.asDiagonal() * H * unit.asDiagonal();
  const Eigen::LLT<MatrixXd> factor(scaled);
  if (factor.info() != Eigen::Success) return out;
  if (rules.covariance_of) {
    out.covariance = MatrixXd::Zero(n, n);
    for (const Index i : *rules.covariance_of)
      out.covariance.col(i) = unit.cwiseProduct(factor.solve(VectorXd(unit[i] * VectorXd::Unit(n, i))));
  } else {
    out.covariance = unit.asDiagonal() * factor.solve(MatrixXd::Identity(n, n)) * unit.asDiagonal();
  }
  out.shared = unit.cwiseProduct(factor.solve(unit.cwiseProduct(g)));
  out.least -= g.dot(out.shared);
  for (std::size_t k = 0; k < rules.held_at.size(); ++k) out.shared[rules.held[k]] = rules.held_at[k];
  out.log_volume_ratio += log_det(factor) - 2 * unit.array().log().sum();
  for (const Index i : rules.held) out.covariance(i, i) = 0;
  if (precision.isDiagonal(0)) {
    if (!(precision.diagonal().array() > 0).all()) return out;
    out.log_volume_ratio -= precision.diagonal().array().log().sum();
  } else {
    const Eigen::LLT<MatrixXd> prior(precision);
    if (prior.info() != Eigen::Success) return out;
    out.log_volume_ratio -= log_det(prior);
  }
  out.local.resize(blocks.size());
  for (std::size_t r = 0; r < blocks.size(); ++r)
    if (uses(r)) out.local[r] = factors[r].solve(pulls[r] - blocks[r].lz * out.shared);
  out.valid = out.shared.allFinite();
  return out;
}

}  // namespace bevel::inference
