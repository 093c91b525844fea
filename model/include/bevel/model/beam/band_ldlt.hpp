// SPDX-License-Identifier: MIT
#pragma once
// A = L D L^T for symmetric positive definite matrices with three diagonals beside the main one, which is what cubic
// Hermite beam elements give (two unknowns per node, neighbours coupled). Linear in the number of unknowns.
#include <array>
#include <complex>
#include <cstddef>
#include <vector>

namespace bevel::model {

class BandLdlt {
 public:
  static constexpr std::size_t kHalfBandwidth = 3;

  explicit BandLdlt(std::size_t capacity) : rows_(capacity), inverse_pivots_(capacity) {}

  // Zeroes the matrix from row `kept` on and sets its size. The rows before keep what they have, factors where they
  // have been factored: none of them depends on a later one. Throws DomainError above the capacity; never
  // allocates.
  void reset(std::size_t size, std::size_t kept = 0);

  [[nodiscard]] std::size_t size() const { return size_; }

  // Adds to A(row, column); row >= column >= row - kHalfBandwidth (the lower triangle) is the caller's duty.
  void add(std::size_t row, std::size_t column, double value) { rows_[row][row - column] += value; }

  // Replaces A by its factors, from the first row that was not kept. Throws DomainError if a pivot is not
  // positive (the matrix is not definite).
  void factor();

  // Solves A x = b in place, after factor(). Real and imaginary part are two right-hand sides. b: size() entries.
  void solve(std::vector<std::complex<double>>& b) const;
  // The same in halves: L y = b, of whose rows those that were kept hold y already; then D L^T x = y.
  void forward(std::vector<std::complex<double>>& b) const;
  void backward(std::vector<std::complex<double>>& y) const;

 private:
  std::vector<std::array<double, kHalfBandwidth + 1>> rows_;  // rows_[i][k] = A(i, i - k), then L(i, i - k)
  std::vector<double> inverse_pivots_;
  std::size_t size_ = 0, kept_ = 0;
};

}  // namespace bevel::model
