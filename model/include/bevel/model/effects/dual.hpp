// SPDX-License-Identifier: MIT
#pragma once
// A number with its derivatives by up to kMaxColumns unknowns (forward mode, dual numbers): an effect states its
// equation once, its sensitivities follow. Fixed size, no allocation; the compiler makes vector code of the slopes.
// Columns mean what the caller seeded them for (see augmented_needle.hpp); those not in use stay zero. A number that no
// unknown moves carries no slopes and costs as a number does: most passes of a search ask for no derivatives.
#include <Eigen/Core>
#include <array>
#include <cmath>

namespace bevel::model {

inline constexpr int kMaxColumns = 16;
using Slope = Eigen::Array<double, kMaxColumns, 1>;

// Copied from rather than set to zero: GCC sets 128 bytes by "rep stos", whose start alone costs more than most
// effects.
inline const Slope kNoSlope = Slope::Zero();

class Dual {
 public:
  double value = 0;

  // Not defaulted: values of a class whose constructor is defaulted are set to zero first, slopes and all.
  Dual() {}                     // NOLINT(modernize-use-equals-default)
  Dual(double v) : value(v) {}  // NOLINT(google-explicit-constructor): a constant is a number without slope
  template <class Derived>
  Dual(double v, const Eigen::ArrayBase<Derived>& s) : value(v), slope_(s), moves_(true) {}
  Dual(const Dual& b) : value(b.value), moves_(b.moves_) {
    if (moves_) slope_ = b.slope_;
  }
  Dual& operator=(const Dual& b) {
    value = b.value;
    moves_ = b.moves_;
    if (moves_) slope_ = b.slope_;
    return *this;
  }
  // The unknown of one column; a negative column makes a constant.
  static Dual unknown(double v, int column) {
    Dual x(v);
    if (column >= 0) x.slopes()[column] = 1;
    return x;
  }

  bool moves() const { return moves_; }  // with an unknown
  const Slope& slope() const { return moves_ ? slope_ : kNoSlope; }
  Slope& slopes() {  // to be changed
    if (!moves_) slope_ = kNoSlope;
    moves_ = true;
    return slope_;
  }

  Dual& operator+=(const Dual& b) {
    value += b.value;
    if (b.moves_) slopes() += b.slope_;
    return *this;
  }
  Dual& operator-=(const Dual& b) {
    value -= b.value;
    if (b.moves_) slopes() -= b.slope_;
    return *this;
  }

 private:
  Slope slope_;  // of a number that moves
  bool moves_ = false;
};

// A function's value, and its slope by that of its argument.
inline Dual chain(double value, double by_argument, const Dual& argument) {
  if (!argument.moves()) return {value};
  return {value, argument.slope() * by_argument};
}
inline Dual chain(double value, double by_a, const Dual& a, double by_b, const Dual& b) {
  if (!b.moves()) return chain(value, by_a, a);
  if (!a.moves()) return chain(value, by_b, b);
  return {value, a.slope() * by_a + b.slope() * by_b};
}

inline Dual operator-(const Dual& a) { return chain(-a.value, -1, a); }
inline Dual operator+(const Dual& a, const Dual& b) { return chain(a.value + b.value, 1, a, 1, b); }
inline Dual operator-(const Dual& a, const Dual& b) { return chain(a.value - b.value, 1, a, -1, b); }
inline Dual operator+(const Dual& a, double b) { return chain(a.value + b, 1, a); }
inline Dual operator-(const Dual& a, double b) { return chain(a.value - b, 1, a); }
inline Dual operator+(double a, const Dual& b) { return chain(a + b.value, 1, b); }
inline Dual operator-(double a, const Dual& b) { return chain(a - b.value, -1, b); }
inline Dual operator*(const Dual& a, double b) { return chain(a.value * b, b, a); }
inline Dual operator*(double a, const Dual& b) { return b * a; }
inline Dual operator*(const Dual& a, const Dual& b) { return chain(a.value * b.value, b.value, a, a.value, b); }
inline Dual operator/(const Dual& a, double b) { return a * (1 / b); }
inline Dual operator/(const Dual& a, const Dual& b) {
  const double q = a.value / b.value;
  return chain(q, 1 / b.value, a, -q / b.value, b);
}
inline Dual operator/(double a, const Dual& b) {
  const double q = a / b.value;
  return chain(q, -q / b.value, b);
}
inline Dual exp(const Dual& a) {
  const double e = std::exp(a.value);
  return chain(e, e, a);
}
inline Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.value);
  return chain(root, 0.5 / root, a);
}
inline Dual sin(const Dual& a) { return chain(std::sin(a.value), a.moves() ? std::cos(a.value) : 0, a); }
inline Dual cos(const Dual& a) { return chain(std::cos(a.value), a.moves() ? -std::sin(a.value) : 0, a); }

// Of a base that is a number and not negative. At zero nothing depends on a positive exponent.
inline Dual pow(double base, const Dual& exponent) {
  const double power = std::pow(base, exponent.value);
  return chain(power, base > 0 && exponent.moves() ? power * std::log(base) : 0.0, exponent);
}

// Held between bounds; outside them it no longer moves with its unknowns.
inline Dual clamp(const Dual& a, double low, double high) {
  if (a.value < low) return {low};
  if (a.value > high) return {high};
  return a;
}

using Dual2 = std::array<Dual, 2>;
using Dual3 = std::array<Dual, 3>;

// (x, y) turned by an angle.
inline Dual2 turned(const Dual2& v, const Dual& angle_rad) {
  const Dual c = cos(angle_rad);
  const Dual s = sin(angle_rad);
  return {c * v[0] - s * v[1], s * v[0] + c * v[1]};
}

// The backlash operator: output follows once the input has crossed half of the gap, and then lags by it.
inline void play(const Dual& input, const Dual& half_width, Dual& output) {
  if (input.value - half_width.value > output.value) {
    output = input - half_width;
  } else if (input.value + half_width.value < output.value) {
    output = input + half_width;
  }
}

}  // namespace bevel::model
