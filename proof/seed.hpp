// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Seed of a campaign. It is never given on a command line, which every process of the machine can read.
#include <cstdint>
#include <filesystem>
#include <string>

namespace bevel::proof {

/// Returns the seed of a campaign.
/// @param file  file with a whole number from 0 to 2^63 - 1, "-" for standard input, or ""
/// @param campaign  folder of the campaign: without \p file, the seed stored in it, or else a random one
/// @throws ConfigurationError if the file cannot be read or does not hold one such number
std::uint64_t seed_of(const std::string& file, const std::filesystem::path& campaign);

}  // namespace bevel::proof
