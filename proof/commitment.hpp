// SPDX-License-Identifier: MIT
#pragma once
// Commitments: a truth is bound by SHA-256(salt + text) before the tool under test runs, and opened afterwards.
#include <string>
#include <string_view>

#include <bevel/io/sha256.hpp>

namespace bevel::proof {

std::string draw_salt();  // 32 bytes from the system's generator, as hexadecimal
inline std::string commitment_to(std::string_view salt, std::string_view truth) {
  return io::sha256_hex(std::string(salt) + std::string(truth));
}

}  // namespace bevel::proof
