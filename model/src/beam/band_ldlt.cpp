// SPDX-License-Identifier: MIT
#include <bevel/model/beam/band_ldlt.hpp>

#include <algorithm>
#include <string>

#include <bevel/error.hpp>

namespace bevel::model {

void BandLdlt::reset(std::size_t size, std::size_t kept) {
  if (size > rows_.size()) {
    throw DomainError("band matrix: size " + std::to_string(size) + ", allowed at most " +
                      std::to_string(rows_.size()));
  }
  size_ = size;
  kept_ = std::min(kept, size);
  std::fill(rows_.begin() + static_cast<std::ptrdiff_t>(kept_), rows_.begin() + static_cast<std::ptrdiff_t>(size),
            std::array<double, kHalfBandwidth + 1>{});
}

void BandLdlt::factor() {
  for (std::size_t i = kept_; i < size_; ++i) {
    auto& row = rows_[i];
    const std::size_t reach = std::min(i, kHalfBandwidth);
    // First L(i, j) D(j), from the far column to the near one; the division by D(j) waits until the pivot needs both.
    for (std::size_t k = reach; k >= 1; --k) {
      const std::size_t j = i - k;
      for (std::size_t far = k + 1; far <= reach; ++far) row[k] -= row[far] * rows_[j][far - k];
    }
    double pivot = row[0];
    for (std::size_t k = 1; k <= reach; ++k) {
      const double scaled = row[k] * inverse_pivots_[i - k];
      pivot -= row[k] * scaled;
      row[k] = scaled;
    }
    if (!(pivot > 0.0)) {
      throw DomainError("band matrix: pivot " + std::to_string(i) + " is " + std::to_string(pivot) +
                        ", must be positive");
    }
    inverse_pivots_[i] = 1.0 / pivot;
  }
}

void BandLdlt::solve(std::vector<std::complex<double>>& b) const {
  forward(b);
  backward(b);
}

void BandLdlt::forward(std::vector<std::complex<double>>& b) const {
  for (std::size_t i = kept_; i < size_; ++i) {
    for (std::size_t k = 1; k <= std::min(i, kHalfBandwidth); ++k) b[i] -= rows_[i][k] * b[i - k];
  }
}

void BandLdlt::backward(std::vector<std::complex<double>>& y) const {
  for (std::size_t i = 0; i < size_; ++i) y[i] *= inverse_pivots_[i];
  for (std::size_t i = size_; i-- > 0;) {
    for (std::size_t k = 1; k <= std::min(i, kHalfBandwidth); ++k) y[i - k] -= rows_[i][k] * y[i];
  }
}

}  // namespace bevel::model
