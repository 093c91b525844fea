// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Range of an enumeration, computed by the compiler from its enumerators, so that a bound of the checked decode cannot
/// differ from its enumeration.
#include <cstdint>
#include <string_view>

namespace bevel::io {
namespace detail {

/// Returns whether \p value is an enumerator: GCC and Clang print another value as a cast, "(Request)10".
/// @return false for a value without an enumerator
template <auto value>
consteval bool is_enumerator() {
  constexpr std::string_view text = __PRETTY_FUNCTION__;
  constexpr std::size_t at = text.find("value = ");
  static_assert(at != std::string_view::npos, "this compiler prints template arguments in another form");
  return text[at + 8] != '(';
}

}  // namespace detail

/// Returns the largest enumerator of \p Enum, whose enumerators count up from 0 without a gap.
/// @tparam Enum  enumeration
/// @tparam from  first enumerator that is examined; 0 for the caller
/// @return value of the largest enumerator
template <class Enum, std::int32_t from = 0>
consteval std::int32_t last_code() {
  static_assert(detail::is_enumerator<static_cast<Enum>(from)>(), "the enumerators must begin with 0");
  if constexpr (detail::is_enumerator<static_cast<Enum>(from + 1)>())
    return last_code<Enum, from + 1>();
  else
    return from;
}

/// Returns the union of the enumerators of \p Flags; each enumerator is one bit.
/// @tparam Flags  enumeration
/// @tparam bit  first bit that is examined; 0 for the caller
/// @return bitwise or of all enumerators
template <class Flags, int bit = 0>
consteval std::int32_t all_flags() {
  constexpr int kBits = 31;  // of a non-negative int32
  if constexpr (bit == kBits)
    return 0;
  else if constexpr (detail::is_enumerator<static_cast<Flags>(1 << bit)>())
    return (1 << bit) | all_flags<Flags, bit + 1>();
  else
    return all_flags<Flags, bit + 1>();
}

}  // namespace bevel::io
