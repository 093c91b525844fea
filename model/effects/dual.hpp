#pragma once
// A number with its derivatives by up to kMaxColumns unknowns (forward mode, dual numbers): an effect states its
// equation once, its sensitivities follow. Fixed size, no allocation; the compiler makes vector code of the slopes.
// Columns mean what the caller seeded them for (see augmented_needle.hpp); those not in use stay zero.
#include <Eigen/Core>
#include <array>
#include <cmath>

namespace bevel::model {

inline constexpr int kMaxColumns = 16;
using Slope = Eigen::Array<double, kMaxColumns, 1>;

// Copied from rather than set to zero: GCC sets 128 bytes by "rep stos", whose start alone costs more than most
// effects.
inline const Slope kNoSlope = Slope::Zero();

struct Dual {
  double value = 0;
  Slope slope = kNoSlope;

  // Not defaulted: values of a class whose constructor is defaulted are set to zero first.
  Dual() {}                     // NOLINT(modernize-use-equals-default)
  Dual(double v) : value(v) {}  // NOLINT(google-explicit-constructor): a constant is a number without slope
  Dual(double v, const Slope& s) : value(v), slope(s) {}
  // The unknown of one column; a negative column makes a constant.
  static Dual unknown(double v, int column) {
    Dual x(v);
    if (column >= 0) x.slope[column] = 1;
    return x;
  }

  Dual& operator+=(const Dual& b) {
    value += b.value;
    slope += b.slope;
    return *this;
  }
  Dual& operator-=(const Dual& b) {
    value -= b.value;
    slope -= b.slope;
    return *this;
  }
};

inline Dual operator-(const Dual& a) { return {-a.value, -a.slope}; }
inline Dual operator+(const Dual& a, const Dual& b) { return {a.value + b.value, a.slope + b.slope}; }
inline Dual operator-(const Dual& a, const Dual& b) { return {a.value - b.value, a.slope - b.slope}; }
inline Dual operator+(const Dual& a, double b) { return {a.value + b, a.slope}; }
inline Dual operator-(const Dual& a, double b) { return {a.value - b, a.slope}; }
inline Dual operator+(double a, const Dual& b) { return {a + b.value, b.slope}; }
inline Dual operator-(double a, const Dual& b) { return {a - b.value, -b.slope}; }
inline Dual operator*(const Dual& a, double b) { return {a.value * b, a.slope * b}; }
inline Dual operator*(double a, const Dual& b) { return b * a; }
inline Dual operator*(const Dual& a, const Dual& b) {
  return {a.value * b.value, a.slope * b.value + b.slope * a.value};
}
inline Dual operator/(const Dual& a, double b) { return a * (1 / b); }
inline Dual operator/(const Dual& a, const Dual& b) {
  const double q = a.value / b.value;
  return {q, (a.slope - b.slope * q) / b.value};
}
inline Dual operator/(double a, const Dual& b) {
  const double q = a / b.value;
  return {q, b.slope * (-q / b.value)};
}
inline Dual exp(const Dual& a) {
  const double e = std::exp(a.value);
  return {e, a.slope * e};
}
inline Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.value);
  return {root, a.slope * (0.5 / root)};
}
inline Dual sin(const Dual& a) { return {std::sin(a.value), a.slope * std::cos(a.value)}; }
inline Dual cos(const Dual& a) { return {std::cos(a.value), a.slope * -std::sin(a.value)}; }

// Of a base that is a number and not negative. At zero nothing depends on a positive exponent.
inline Dual pow(double base, const Dual& exponent) {
  const double power = std::pow(base, exponent.value);
  return {power, exponent.slope * (base > 0 ? power * std::log(base) : 0.0)};
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
