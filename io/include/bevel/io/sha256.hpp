// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// SHA-256 digests in the form that `sha256sum` prints.
#include <span>
#include <string>
#include <string_view>

namespace bevel::io {

/// Formats bytes as hexadecimal digits.
/// @param bytes  any number of bytes
/// @return two lower-case digits for each byte
std::string hex(std::span<const unsigned char> bytes);
/// Computes the SHA-256 digest of bytes.
/// @param bytes  any number of bytes
/// @return 64 hexadecimal digits
/// @throws ParseError if OpenSSL does not provide SHA-256
std::string sha256_hex(std::string_view bytes);
/// Computes the SHA-256 digest of a file.
/// @param path  file to read
/// @return 64 hexadecimal digits
/// @throws IoError with the file if it cannot be read
/// @throws ParseError if OpenSSL does not provide SHA-256
std::string sha256_of_file(const std::string& path);

}  // namespace bevel::io
