// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Quantiles of distributions.

namespace bevel::diagnosis {

/// Half width of the central 95 % interval of a normal distribution, in standard deviations: its 97.5 % quantile.
inline constexpr double k95 = 1.96;

}  // namespace bevel::diagnosis
