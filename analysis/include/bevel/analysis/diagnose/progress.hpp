// SPDX-License-Identifier: MIT
// What the tool is at, for someone who waits: a line at a time, with the seconds since it began.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace bevel::analysis {

class DiagnosisProgress {
 public:
  // Null says nothing.
  explicit DiagnosisProgress(std::FILE* out) : out_(out) {}

  void say(const std::string& text) const {
    if (out_ == nullptr || text.empty()) return;
    std::fprintf(out_, "%6.1f s  %s\n", seconds(), text.c_str());
    std::fflush(out_);
  }
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count(); }

 private:
  std::FILE* out_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

}  // namespace bevel::analysis
