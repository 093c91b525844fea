// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Dual numbers (forward-mode differentiation): a number with its derivatives with respect to up to kMaxColumns
/// parameters. An effect states its equation once; its sensitivities follow.
///
/// The size is fixed, and no operation allocates; the compiler vectorises the slopes. The caller that seeds a column
/// defines its meaning (augmented_needle.hpp); unused columns are zero. A number without slopes costs as much as a
/// plain number, because most passes of a search need no derivatives.
#include <Eigen/Core>
#include <array>
#include <cmath>

namespace bevel::model {

/// Largest number of derivatives of a dual number.
inline constexpr int kMaxColumns = 16;
/// Derivatives with respect to each column, in units of the value per unit of the column.
using Slope = Eigen::Array<double, kMaxColumns, 1>;

/// Zero slopes. Copying them is faster than setting to zero: GCC clears 128 bytes by "rep stos", whose start-up alone
/// costs more than most effects.
inline const Slope kNoSlope = Slope::Zero();

/// Number with derivatives.
class Dual {
 public:
  double value = 0;  ///< value of the number

  /// Constructs zero without slopes. The constructor is not defaulted, because value initialisation of a class with a
  /// defaulted constructor first clears the whole object, slopes included.
  Dual() {}  // NOLINT(modernize-use-equals-default)
  /// Constructs a constant without slopes.
  /// @param v value
  Dual(double v) : value(v) {}  // NOLINT(google-explicit-constructor): a constant is a number without slope
  /// Constructs a number with slopes.
  /// @param v value
  /// @param s derivatives, kMaxColumns elements
  template <class Derived>
  Dual(double v, const Eigen::ArrayBase<Derived>& s) : value(v), slope_(s), moves_(true) {}
  /// Copies a number; slopes are copied only if they exist.
  /// @param b number to copy
  Dual(const Dual& b) : value(b.value), moves_(b.moves_) {
    if (moves_) slope_ = b.slope_;
  }
  /// Assigns a number; slopes are copied only if they exist.
  /// @param b number to copy
  /// @return this number
  Dual& operator=(const Dual& b) {
    value = b.value;
    moves_ = b.moves_;
    if (moves_) slope_ = b.slope_;
    return *this;
  }
  /// Creates the parameter of one column, with derivative 1 in that column.
  /// @param v value
  /// @param column column, below kMaxColumns; a negative column creates a constant
  /// @return the number
  static Dual unknown(double v, int column) {
    Dual x(v);
    if (column >= 0) x.slopes()[column] = 1;
    return x;
  }

  /// @return true if the number has slopes, that is, depends on a parameter
  bool moves() const { return moves_; }
  /// @return the derivatives; kNoSlope for a constant
  const Slope& slope() const { return moves_ ? slope_ : kNoSlope; }
  /// Accesses the derivatives for modification. A constant obtains zero slopes first.
  /// @return reference to the derivatives
  Slope& slopes() {
    if (!moves_) slope_ = kNoSlope;
    moves_ = true;
    return slope_;
  }

  /// Adds a number.
  /// @param b summand
  /// @return this number
  Dual& operator+=(const Dual& b) {
    value += b.value;
    if (b.moves_) slopes() += b.slope_;
    return *this;
  }
  /// Subtracts a number.
  /// @param b subtrahend
  /// @return this number
  Dual& operator-=(const Dual& b) {
    value -= b.value;
    if (b.moves_) slopes() -= b.slope_;
    return *this;
  }

 private:
  Slope slope_;  // valid only if moves_
  bool moves_ = false;
};

/// Applies the chain rule to a function of one argument.
/// @param value value of the function
/// @param by_argument derivative of the function with respect to its argument
/// @param argument argument
/// @return the value with slopes; a constant if the argument is one
inline Dual chain(double value, double by_argument, const Dual& argument) {
  if (!argument.moves()) return {value};
  return {value, argument.slope() * by_argument};
}
/// Applies the chain rule to a function of two arguments.
/// @param value value of the function
/// @param by_a derivative of the function with respect to \p a
/// @param a first argument
/// @param by_b derivative of the function with respect to \p b
/// @param b second argument
/// @return the value with slopes; a constant if both arguments are
inline Dual chain(double value, double by_a, const Dual& a, double by_b, const Dual& b) {
  if (!b.moves()) return chain(value, by_a, a);
  if (!a.moves()) return chain(value, by_b, b);
  return {value, a.slope() * by_a + b.slope() * by_b};
}

/// Negates a number.
/// @param a number
/// @return -a with slopes
inline Dual operator-(const Dual& a) { return chain(-a.value, -1, a); }
/// Adds two numbers.
/// @param a summand
/// @param b summand
/// @return a + b with slopes
inline Dual operator+(const Dual& a, const Dual& b) { return chain(a.value + b.value, 1, a, 1, b); }
/// Subtracts two numbers.
/// @param a minuend
/// @param b subtrahend
/// @return a - b with slopes
inline Dual operator-(const Dual& a, const Dual& b) { return chain(a.value - b.value, 1, a, -1, b); }
/// Adds two numbers.
/// @param a summand
/// @param b summand, constant
/// @return a + b with slopes
inline Dual operator+(const Dual& a, double b) { return chain(a.value + b, 1, a); }
/// Subtracts two numbers.
/// @param a minuend
/// @param b subtrahend, constant
/// @return a - b with slopes
inline Dual operator-(const Dual& a, double b) { return chain(a.value - b, 1, a); }
/// Adds two numbers.
/// @param a summand, constant
/// @param b summand
/// @return a + b with slopes
inline Dual operator+(double a, const Dual& b) { return chain(a + b.value, 1, b); }
/// Subtracts two numbers.
/// @param a minuend, constant
/// @param b subtrahend
/// @return a - b with slopes
inline Dual operator-(double a, const Dual& b) { return chain(a - b.value, -1, b); }
/// Multiplies two numbers.
/// @param a factor
/// @param b factor, constant
/// @return a * b with slopes
inline Dual operator*(const Dual& a, double b) { return chain(a.value * b, b, a); }
/// Multiplies two numbers.
/// @param a factor, constant
/// @param b factor
/// @return a * b with slopes
inline Dual operator*(double a, const Dual& b) { return b * a; }
/// Multiplies two numbers.
/// @param a factor
/// @param b factor
/// @return a * b with slopes
inline Dual operator*(const Dual& a, const Dual& b) { return chain(a.value * b.value, b.value, a, a.value, b); }
/// Divides two numbers.
/// @param a dividend
/// @param b divisor, not zero, constant
/// @return a / b with slopes
inline Dual operator/(const Dual& a, double b) { return a * (1 / b); }
/// Divides two numbers.
/// @param a dividend
/// @param b divisor, not zero
/// @return a / b with slopes
inline Dual operator/(const Dual& a, const Dual& b) {
  const double q = a.value / b.value;
  return chain(q, 1 / b.value, a, -q / b.value, b);
}
/// Divides two numbers.
/// @param a dividend, constant
/// @param b divisor, not zero
/// @return a / b with slopes
inline Dual operator/(double a, const Dual& b) {
  const double q = a / b.value;
  return chain(q, -q / b.value, b);
}
/// Computes the exponential function.
/// @param a argument
/// @return exp(a) with slopes
inline Dual exp(const Dual& a) {
  const double e = std::exp(a.value);
  return chain(e, e, a);
}
/// Computes the square root.
/// @param a argument; above zero if it has slopes
/// @return sqrt(a) with slopes
inline Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.value);
  return chain(root, 0.5 / root, a);
}
/// Computes the sine.
/// @param a angle, rad
/// @return sin(a) with slopes
inline Dual sin(const Dual& a) { return chain(std::sin(a.value), a.moves() ? std::cos(a.value) : 0, a); }
/// Computes the cosine.
/// @param a angle, rad
/// @return cos(a) with slopes
inline Dual cos(const Dual& a) { return chain(std::cos(a.value), a.moves() ? -std::sin(a.value) : 0, a); }

/// Computes a power of a constant base. At base 0 the derivative with respect to the exponent is 0, which is exact for
/// a positive exponent.
/// @param base base, >= 0
/// @param exponent exponent
/// @return base^exponent with slopes
inline Dual pow(double base, const Dual& exponent) {
  const double power = std::pow(base, exponent.value);
  return chain(power, base > 0 && exponent.moves() ? power * std::log(base) : 0.0, exponent);
}

/// Limits a number to an interval. Outside the interval the result is a constant.
/// @param a number
/// @param low lower bound
/// @param high upper bound, >= \p low
/// @return the limited number
inline Dual clamp(const Dual& a, double low, double high) {
  if (a.value < low) return {low};
  if (a.value > high) return {high};
  return a;
}

/// Two dual numbers, usually x and y.
using Dual2 = std::array<Dual, 2>;
/// Three dual numbers, usually x, y and z.
using Dual3 = std::array<Dual, 3>;

/// Rotates a plane vector.
/// @param v (x, y), any unit
/// @param angle_rad angle from x toward y, rad
/// @return the rotated vector, in the same unit
inline Dual2 turned(const Dual2& v, const Dual& angle_rad) {
  const Dual c = cos(angle_rad);
  const Dual s = sin(angle_rad);
  return {c * v[0] - s * v[1], s * v[0] + c * v[1]};
}

/// Applies the backlash (play) operator. The output follows the input with a one-way lag of half the width. Inside the
/// dead band it is constant.
/// @param input input of the operator
/// @param half_width half of the total width, >= 0, in the unit of \p input
/// @param[in,out] output output of the operator
inline void play(const Dual& input, const Dual& half_width, Dual& output) {
  if (input.value - half_width.value > output.value) {
    output = input - half_width;
  } else if (input.value + half_width.value < output.value) {
    output = input + half_width;
  }
}

}  // namespace bevel::model
