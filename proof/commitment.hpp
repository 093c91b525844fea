#pragma once
// Commitments: a truth is bound by SHA-256(salt + text) before the tool under test runs, and opened afterwards.
#include <string>
#include <string_view>

namespace bevel::proof {

std::string sha256_hex(std::string_view bytes);       // 64 hexadecimal digits
std::string sha256_of_file(const std::string& path);  // throws std::runtime_error naming the file
std::string draw_salt();                              // 32 bytes from the system's generator, as hexadecimal
inline std::string commitment_to(std::string_view salt, std::string_view truth) {
  return sha256_hex(std::string(salt) + std::string(truth));
}

}  // namespace bevel::proof
