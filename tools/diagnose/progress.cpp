#include "tools/diagnose/progress.hpp"

#include <unistd.h>

namespace bevel::diagnose {

Progress::Progress(std::FILE* out) : out_(out), terminal_(out != nullptr && ::isatty(::fileno(out)) == 1) {}

void Progress::stage(const std::string& text) {
  done();
  at_ = text;
  began_ = Clock::now();
  if (!terminal_ || at_.empty()) return;
  std::fprintf(out_, "         %s ...", at_.c_str());
  std::fflush(out_);
}

void Progress::done() {
  if (out_ == nullptr || at_.empty()) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - began_).count();
  std::fprintf(out_, "%s%6.1f s %s\n", terminal_ ? "\r\033[K" : "", seconds, at_.c_str());
  std::fflush(out_);
  at_.clear();
}

}  // namespace bevel::diagnose
