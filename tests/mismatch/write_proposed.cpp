// SPDX-License-Identifier: MIT
// Writes the sources of all proposed_cases() into a folder, or of one of them, and the registry with their lines, where
// the sources say that they stand.
//   write_proposed REGISTRY FOLDER [NAME]
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "tests/mismatch/proposed_cases.hpp"

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::filesystem::path folder = argv[2];
  std::filesystem::create_directories(folder);
  std::ifstream in(argv[1]);
  std::string registry{std::istreambuf_iterator<char>(in), {}};
  for (const auto& proposal : bevel::diagnosis::testing::proposed_cases()) {
    const auto source = bevel::diagnosis::effect_source(proposal);
    if (argc > 3 && source.name != argv[3]) continue;
    std::ofstream(folder / (source.name + ".cpp")) << source.text;
    const std::size_t last = registry.find("  EFFECT(camera_latency)\n");
    if (last == std::string::npos) {
      std::cerr << "the registry's last line is not camera_latency, as the sources say\n";
      return 1;
    }
    registry.insert(last, "  EFFECT(" + source.name + ") \\\n");
  }
  std::ofstream(folder / "registry.cpp") << registry;
  return 0;
}
