// SPDX-License-Identifier: MIT
#pragma once
// Random numbers that are the same on every machine: the standard fixes the engine, but not its distributions, and a
// proof that is to be rerun elsewhere needs both.
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

namespace bevel::proof {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  // An independent stream for a part of the work, so that a change in one part leaves the others as they were.
  static Random stream(std::uint64_t seed, std::uint64_t part) {
    std::seed_seq words{seed & 0xffffffffU, seed >> 32U, part & 0xffffffffU, part >> 32U};
    Random random(0);
    random.engine_.seed(words);
    return random;
  }

  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }  // [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
  bool chance(double probability) { return uniform() < probability; }
  double sign() { return chance(0.5) ? 1.0 : -1.0; }
  // 0 <= result < count
  std::size_t index(std::size_t count) {
    return static_cast<std::size_t>(uniform() * static_cast<double>(count)) % count;
  }
  int integer(int low, int high) { return low + static_cast<int>(index(static_cast<std::size_t>(high - low + 1))); }
  template <class T>
  const T& pick(const std::vector<T>& of) {
    return of[index(of.size())];
  }

  double normal() {  // Box and Muller; the second of the pair is not kept
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  // Student's t with this many degrees of freedom (> 2), scaled to variance one.
  double heavy_tailed(int degrees) {
    double chi2 = 0.0;
    for (int i = 0; i < degrees; ++i) {
      const double z = normal();
      chi2 += z * z;
    }
    return normal() / std::sqrt(chi2 / degrees) * std::sqrt((degrees - 2.0) / degrees);
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace bevel::proof
