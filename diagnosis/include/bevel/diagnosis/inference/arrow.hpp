// SPDX-License-Identifier: MIT
#pragma once
// Least squares in which each recording has unknowns of its own beside those that all share: the normal equations have
// the shape of an arrow, and each recording's own part is eliminated by its Schur complement.
//
//   minimise  sum_r |w_r - L_r l_r - Z_r z|^2 + (l_r - l0_r)' T_r (l_r - l0_r) + 2 s_r' z + (z - z0)' P (z - z0)
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <optional>
#include <vector>

namespace bevel::inference {

// Inner products of one recording's columns, and the prior of what is its own.
struct ArrowBlock {
  Eigen::MatrixXd ll, lz, zz;
  Eigen::VectorXd lw, zw;
  double ww = 0;
  Eigen::VectorXd precision, centre;        // T_r (diagonal), l0_r
  Eigen::VectorXd slope;                    // s_r, of the first of z; empty: zero
  Eigen::MatrixXd own_information() const;  // L_r' L_r + T_r
};

struct ArrowSolution {
  double least = 0;        // the minimum
  Eigen::VectorXd shared;  // z
  std::vector<Eigen::VectorXd> local;
  Eigen::MatrixXd information;  // of z, all else eliminated: the Schur complement plus P
  Eigen::MatrixXd covariance;   // its inverse, or those columns of it that were asked for, the others zero
  // What the tails of those held add to it about z, where all of it is wanted: each as far as it may be from its bound,
  // all else following. Empty: none is held.
  Eigen::MatrixXd of_tails;
  Eigen::MatrixXd covariance_with_tails() const { return of_tails.size() > 0 ? covariance + of_tails : covariance; }
  // log det of the whole Hessian less that of the priors' precisions: what the posterior's volume lost.
  double log_volume_ratio = 0;
  bool valid = false;
};

double log_det(const Eigen::LLT<Eigen::MatrixXd>& factor);

// Z_r and L_r from columns; the precision and the centre are left to the caller.
ArrowBlock make_block(const Eigen::MatrixXd& L, const Eigen::MatrixXd& Z, const Eigen::VectorXd& w);

// damping: of Levenberg and Marquardt, on the diagonals; `precision` P may be full. used: recordings that take part;
// empty: all. held: shared unknowns that stay at zero, or at held_at, pressed against a bound: what is left of their
// posterior is the tail of a normal one beyond its middle, whose volume is the one in log_volume_ratio (of those at
// zero). held_at: as many as held; empty: all at zero. covariance_of: columns of the
// covariance that are wanted; without it all: they cost as much as the rest.
struct ArrowRules {
  double damping = 0;
  std::vector<bool> used{};
  std::vector<Eigen::Index> held{};
  std::vector<double> held_at{};
  std::optional<std::vector<Eigen::Index>> covariance_of{};
};
ArrowSolution solve(const std::vector<ArrowBlock>& blocks, const Eigen::MatrixXd& precision,
                    const Eigen::VectorXd& centre, const ArrowRules& rules = {});

}  // namespace bevel::inference
