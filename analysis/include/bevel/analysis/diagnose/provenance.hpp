// SPDX-License-Identifier: MIT
// Of what a verdict was made: the same version and the same inputs give the same verdict, to the last bit.
#pragma once

#include <string>
#include <vector>

namespace bevel::analysis {

// A file by its name, without its folder, and its SHA-256.
struct KnownFile {
  std::string name, sha256;
};

struct Provenance {
  std::string version;  // of this program
  KnownFile model;
  std::vector<KnownFile> recordings;  // named as the findings name them
};

}  // namespace bevel::analysis
