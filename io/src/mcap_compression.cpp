// SPDX-License-Identifier: MIT
#include "mcap_compression.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

namespace bevel::io::mcap {
namespace {

// Output grows with what comes out, not by the size that the file declares.
constexpr std::size_t kStep_bytes = std::size_t{128} << 10U;  // a block of zstd

// `step(from, from_size, to, to_size)` sets both sizes to what was used, and returns whether there may be more.
template <class Step>
std::string drain(std::string_view data, std::size_t most_bytes, Step&& step) {
  std::string out;
  for (bool goes_on = true; goes_on && out.size() <= most_bytes;) {
    const std::size_t before = out.size();
    out.resize(before + std::min(kStep_bytes, most_bytes + 1 - before));
    std::size_t from_size = data.size(), to_size = out.size() - before;
    goes_on = step(data.data(), from_size, out.data() + before, to_size);
    out.resize(before + to_size);
    data.remove_prefix(from_size);
    goes_on = goes_on && (from_size > 0 || to_size > 0);
  }
  return out;
}

std::string decompress_zstd(std::string_view data, std::size_t most_bytes) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(), ZSTD_freeDStream);
  return drain(data, most_bytes, [&](const char* from, std::size_t& from_size, char* to, std::size_t& to_size) {
    ZSTD_inBuffer in{from, from_size, 0};
    ZSTD_outBuffer out{to, to_size, 0};
    const std::size_t left = ZSTD_decompressStream(stream.get(), &out, &in);
    from_size = in.pos, to_size = out.pos;
    return ZSTD_isError(left) == 0;  // 0: the end of a frame, behind which another one may begin
  });
}

std::string decompress_lz4(std::string_view data, std::size_t most_bytes) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return {};
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> owner(context,
                                                                                   LZ4F_freeDecompressionContext);
  return drain(data, most_bytes, [&](const char* from, std::size_t& from_size, char* to, std::size_t& to_size) {
    const std::size_t left = LZ4F_decompress(context, to, &to_size, from, &from_size, nullptr);
    if (LZ4F_isError(left) == 0) return true;
    to_size = 0;
    return false;
  });
}

}  // namespace

std::optional<std::string> decompress(std::string_view compression, std::string_view data, std::size_t most_bytes) {
  if (compression == "zstd") return decompress_zstd(data, most_bytes);
  if (compression == "lz4") return decompress_lz4(data, most_bytes);
  return std::nullopt;
}

}  // namespace bevel::io::mcap
