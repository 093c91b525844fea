// SPDX-License-Identifier: MIT
#pragma once
// What a file or text is known by: SHA-256, as `sha256sum` prints it.
#include <span>
#include <string>
#include <string_view>

namespace bevel::io {

std::string hex(std::span<const unsigned char> bytes);
std::string sha256_hex(std::string_view bytes);       // 64 hexadecimal digits
std::string sha256_of_file(const std::string& path);  // throws ParseError naming the file

}  // namespace bevel::io
