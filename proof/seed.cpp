// SPDX-License-Identifier: MIT
#include "proof/seed.hpp"

#include <charconv>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>

#include <bevel/error.hpp>
#include "proof/trial_files.hpp"

namespace bevel::proof {
namespace {

constexpr std::uint64_t kLargestSeed = ~std::uint64_t{0} >> 1U;  // that of a signed number of 64 bits

std::uint64_t random_seed() {
  std::random_device source;
  return ((std::uint64_t{source()} << 32U) | source()) & kLargestSeed;
}

}  // namespace

std::uint64_t seed_of(const std::string& file, const std::filesystem::path& campaign) {
  if (file.empty()) {
    const std::filesystem::path stored = campaign / "campaign.json";
    return std::filesystem::exists(stored) ? nlohmann::json::parse(read_text(stored)).at("seed").get<std::uint64_t>()
                                           : random_seed();
  }
  std::string text = file == "-" ? std::string(std::istreambuf_iterator<char>(std::cin), {}) : read_text(file);
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r' || text.back() == ' ')) text.pop_back();
  std::uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size() || seed > kLargestSeed)
    throw ConfigurationError((file == "-" ? "standard input" : file) + ": holds '" + text.substr(0, 40) +
                             "'; allowed: one whole number from 0 to " + std::to_string(kLargestSeed));
  return seed;
}

}  // namespace bevel::proof
