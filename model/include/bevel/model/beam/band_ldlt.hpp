// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Factorisation A = L D L^T of symmetric positive definite matrices with three subdiagonals. Cubic Hermite beam
/// elements yield such matrices (two unknowns per node, neighbours coupled). The cost is linear in the number of
/// unknowns.
#include <array>
#include <complex>
#include <cstddef>
#include <vector>

namespace bevel::model {

/// Symmetric positive definite band matrix and its factors, in place.
class BandLdlt {
 public:
  /// Number of subdiagonals.
  static constexpr std::size_t kHalfBandwidth = 3;

  /// Allocates the memory.
  /// @param capacity largest number of rows
  explicit BandLdlt(std::size_t capacity) : rows_(capacity), inverse_pivots_(capacity) {}

  /// Sets the size and clears the matrix from row \p kept on. The rows before keep their content or their factors,
  /// which depend on no later row. The function does not allocate.
  /// @param size number of rows, at most the capacity
  /// @param kept number of rows that are kept
  /// @throws bevel::DomainError if \p size exceeds the capacity
  void reset(std::size_t size, std::size_t kept = 0);

  /// @return the number of rows
  [[nodiscard]] std::size_t size() const { return size_; }

  /// Adds a value to A(row, column) in the lower triangle. The indices are not checked.
  /// @param row row, below size()
  /// @param column column; required: row >= column >= row - kHalfBandwidth
  /// @param value value to add
  void add(std::size_t row, std::size_t column, double value) { rows_[row][row - column] += value; }

  /// Replaces A by its factors, from the first row that was not kept.
  /// @throws bevel::DomainError if a pivot is not positive, because the matrix is then not positive definite
  void factor();

  /// Solves A x = b in place, after factor(). Real and imaginary part are two right-hand sides.
  /// @param[in,out] b right-hand sides, size() elements; afterwards the solutions
  void solve(std::vector<std::complex<double>>& b) const;
  /// Solves L y = b in place, the first half of solve().
  /// @param[in,out] b right-hand sides, size() elements; the kept rows contain y already. Afterwards y.
  void forward(std::vector<std::complex<double>>& b) const;
  /// Solves D L^T x = y in place, the second half of solve().
  /// @param[in,out] y result of forward(), size() elements; afterwards the solutions
  void backward(std::vector<std::complex<double>>& y) const;

 private:
  std::vector<std::array<double, kHalfBandwidth + 1>> rows_;  // rows_[i][k] = A(i, i - k), then L(i, i - k)
  std::vector<double> inverse_pivots_;
  std::size_t size_ = 0, kept_ = 0;
};

}  // namespace bevel::model
