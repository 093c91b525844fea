// What the tool is at, for someone who waits: a line per stage with its seconds. In a terminal the stage at work stands
// in the last line.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace bevel::diagnose {

class Progress {
 public:
  // Null says nothing.
  explicit Progress(std::FILE* out);
  ~Progress() { done(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void stage(const std::string& text);  // ends the one before
  void done();

 private:
  using Clock = std::chrono::steady_clock;
  std::FILE* out_;
  bool terminal_;
  std::string at_;
  Clock::time_point began_;
};

}  // namespace bevel::diagnose
