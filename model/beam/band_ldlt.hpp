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

  // Zeroes the matrix and sets its size. Throws std::length_error above the capacity; never allocates.
  void reset(std::size_t size);

  [[nodiscard]] std::size_t size() const { return size_; }

  // Adds to A(row, column); row >= column >= row - kHalfBandwidth (the lower triangle) is the caller's duty.
  void add(std::size_t row, std::size_t column, double value) { rows_[row][row - column] += value; }

  // Replaces A by its factors. Throws std::domain_error if a pivot is not positive (the matrix is not definite).
  void factor();

  // Solves A x = b in place, after factor(). Real and imaginary part are two right-hand sides. b: size() entries.
  void solve(std::vector<std::complex<double>>& b) const;

 private:
  std::vector<std::array<double, kHalfBandwidth + 1>> rows_;  // rows_[i][k] = A(i, i - k), then L(i, i - k)
  std::vector<double> inverse_pivots_;
  std::size_t size_ = 0;
};

}  // namespace bevel::model
