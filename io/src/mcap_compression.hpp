// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Decompression of the chunks of MCAP files.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace bevel::io::mcap {

/// Largest size of a chunk after decompression: that of a text file (bevel/io/file_bytes.hpp). Writers make chunks of
/// 0.75 to 4 MiB; a damaged or malicious chunk of a few bytes can expand to gigabytes.
inline constexpr std::size_t kLargestChunk_bytes = std::size_t{64} << 20U;

/// Decompresses \p data as far as it goes, for a chunk that is cut off too.
/// @param compression "zstd" or "lz4" (frame format)
/// @param most_bytes output is not longer than this, and one byte more if there is more of it
/// @return nothing for another compression; shorter output than the chunk declares if the data are damaged or cut off
std::optional<std::string> decompress(std::string_view compression, std::string_view data, std::size_t most_bytes);

}  // namespace bevel::io::mcap
