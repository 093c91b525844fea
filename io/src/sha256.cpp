// SPDX-License-Identifier: MIT
#include <bevel/io/sha256.hpp>

#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <iterator>

#include <bevel/error.hpp>

namespace bevel::io {

std::string hex(std::span<const unsigned char> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : bytes) {
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 15U];
  }
  return text;
}

std::string sha256_hex(std::string_view bytes) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1)
    throw ParseError("SHA-256 is not available from OpenSSL");
  return hex(std::span(digest).first(size));
}

std::string sha256_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw IoError(path + ": cannot be read");
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return sha256_hex(bytes);
}

}  // namespace bevel::io
