// SPDX-License-Identifier: MIT
#pragma once
// The least of a function of one variable.

namespace bevel::inference {

// Where a function with one minimum in [low, high] is least, to within `width`: golden sections.
template <class Function>
double minimum_of(double low, double high, double width, Function&& f) {
  constexpr double kGolden = 0.6180339887498949;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double fa = f(a), fb = f(b);
  while (high - low > width) {
    if (fa < fb) {
      high = b, b = a, fb = fa, a = high - kGolden * (high - low), fa = f(a);
    } else {
      low = a, a = b, fa = fb, b = low + kGolden * (high - low), fb = f(b);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace bevel::inference
