// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Detects that a recording holds more than one insertion.

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include <bevel/model/samples.hpp>

namespace bevel::io {

/// Depth (mm) from which a needle counts as inserted. Over 10 mm a needle of curvature 0.005 /mm bends by 0.25 mm, the
/// noise of one measurement. At a smaller depth a needle touches the tissue and is moved back.
inline constexpr double kInserted_mm = 10;
/// Depth (mm) below which a withdrawn needle counts as out: hands and axes return to the entry point this accurately.
inline constexpr double kWithdrawn_mm = 1;

/// Finds where a second insertion begins: the needle was inserted, was withdrawn to where the recording began, and is
/// inserted again. A needle that is withdrawn only partly, or for good, is one insertion.
/// @param actuators  in order of time
/// @return index of the last sample before the second insertion at which the needle is farthest out; nothing for one
/// insertion
std::optional<std::size_t> second_insertion(std::span<const model::ActuatorState> actuators);

/// Throws for a recording of more than one insertion, for programs that fit one entry pose for each recording.
/// @param name  name of the recording for the error message
/// @param actuators  in any order
/// @throws ParseError with \p name, the time of the second insertion and the remedy
void require_one_insertion(const std::string& name, std::span<const model::ActuatorState> actuators);

}  // namespace bevel::io
