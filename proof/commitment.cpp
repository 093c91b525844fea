// SPDX-License-Identifier: MIT
#include "proof/commitment.hpp"

#include <openssl/rand.h>

#include <array>

#include <bevel/error.hpp>

namespace bevel::proof {

std::string draw_salt() {
  std::array<unsigned char, 32> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1)
    throw IoError("no random bytes from OpenSSL for a salt");
  return io::hex(bytes);
}

}  // namespace bevel::proof
