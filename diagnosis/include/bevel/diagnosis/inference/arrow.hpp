// SPDX-License-Identifier: MIT
/// @file
/// Least squares in which each recording has local unknowns in addition to the shared ones.
///
/// The normal equations have block-arrow form. The Schur complement eliminates the local unknowns of each recording.
///
/// \code{.unparsed}
///   minimise  sum_r |w_r - L_r l_r - Z_r z|^2 + (l_r - l0_r)' T_r (l_r - l0_r) + 2 s_r' z + (z - z0)' P (z - z0)
/// \endcode
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <optional>
#include <vector>

namespace bevel::inference {

/// Inner products of one recording's columns, and the prior of its local unknowns.
struct ArrowBlock {
  Eigen::MatrixXd ll,         ///< L_r' L_r.
      lz,                     ///< L_r' Z_r.
      zz;                     ///< Z_r' Z_r.
  Eigen::VectorXd lw,         ///< L_r' w_r.
      zw;                     ///< Z_r' w_r.
  double ww = 0;              ///< w_r' w_r.
  Eigen::VectorXd precision,  ///< Diagonal of T_r.
      centre;                 ///< l0_r.
  Eigen::VectorXd slope;      ///< s_r for the first elements of z; empty: zero.
  /// Computes the information matrix of the local unknowns.
  /// @return L_r' L_r + T_r.
  Eigen::MatrixXd own_information() const;
};

/// Solution of the least-squares problem.
struct ArrowSolution {
  double least = 0;                    ///< Minimum of the objective.
  Eigen::VectorXd shared;              ///< z at the minimum.
  std::vector<Eigen::VectorXd> local;  ///< l_r at the minimum; empty for recordings that are not used.
  Eigen::MatrixXd information;         ///< Information matrix of z: the Schur complement plus P.
  Eigen::MatrixXd covariance;          ///< Its inverse, or only the requested columns of it, the others zero.
  /// Covariance of z that the tails of the held unknowns add if the full covariance was requested. Each held unknown
  /// varies within its distance from the bound and the others follow. Empty: none is held.
  Eigen::MatrixXd of_tails;
  /// Computes the covariance of z with the tails of the held unknowns.
  /// @return Covariance matrix.
  Eigen::MatrixXd covariance_with_tails() const { return of_tails.size() > 0 ? covariance + of_tails : covariance; }
  /// Log determinant of the complete Hessian minus that of the prior precisions: twice the log ratio of prior volume to
  /// posterior volume.
  double log_volume_ratio = 0;
  bool valid = false;  ///< All factorisations succeeded and the solution is finite.
};

/// Computes the log determinant of a factored matrix.
/// @param factor Cholesky factorisation.
/// @return Natural log of the determinant.
double log_det(const Eigen::LLT<Eigen::MatrixXd>& factor);

/// Computes the inner products of one recording. The caller sets the precision and the centre.
/// @param L Columns of the local unknowns, rows x unknowns.
/// @param Z Columns of the shared unknowns, rows x unknowns.
/// @param w Residuals, one per row.
/// @return Block without prior.
ArrowBlock make_block(const Eigen::MatrixXd& L, const Eigen::MatrixXd& Z, const Eigen::VectorXd& w);

/// Settings of solve().
struct ArrowRules {
  double damping = 0;        ///< Levenberg-Marquardt damping, relative to the diagonals.
  std::vector<bool> used{};  ///< Recordings that take part; empty: all.
  /// Shared unknowns that stay at zero, or at held_at, at an active bound. Their posterior is the tail of a normal
  /// density beyond its mean; log_volume_ratio counts the volume of this tail.
  std::vector<Eigen::Index> held{};
  std::vector<double> held_at{};  ///< Values of the held unknowns, as many as \p held; empty: all zero.
  /// Columns of the covariance to compute; nothing: all. All columns cost as much as the rest of the solution.
  std::optional<std::vector<Eigen::Index>> covariance_of{};
};
/// Solves the least-squares problem.
/// @param blocks One block per recording.
/// @param precision P; may be a full matrix.
/// @param centre z0.
/// @param rules Settings.
/// @return Solution; not valid if a matrix is not positive definite.
ArrowSolution solve(const std::vector<ArrowBlock>& blocks, const Eigen::MatrixXd& precision,
                    const Eigen::VectorXd& centre, const ArrowRules& rules = {});

}  // namespace bevel::inference
