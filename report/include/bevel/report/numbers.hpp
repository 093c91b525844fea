// SPDX-License-Identifier: MIT
// Numbers as people read them, never with an exponent where none is needed.
#pragma once

#include <string>

namespace bevel::report {

// "12.30" for (12.3, 2); never "-0.00"; "-" where there is no finite value.
std::string fixed(double value, int decimals);
// Behind the point, so that `size` has so many significant digits: 2 for (0.083, 1), 0 for (830, 2). 0 to 9.
int decimals_for(double size, int digits);

// So many significant digits, zeros at the end left out; "-" where there is no finite value.
std::string number(double value, int digits = 3);
// The same for what was measured: zeros at the end stay, "1.00".
std::string measured(double value, int digits = 3);
/// Returns \p difference in standard deviations with its sign, "+1.3"; "-" if \p sd is 0 or the quotient is not finite:
/// a quantity that is held has no standard deviation.
std::string in_deviations(double difference, double sd);
// As printf's %g has it: an exponent where the value is very large or very small.
std::string format_significant(double value, int digits = 3);

}  // namespace bevel::report
