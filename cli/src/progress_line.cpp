// SPDX-License-Identifier: MIT
#include <bevel/cli/progress_line.hpp>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

namespace bevel::cli {
namespace {

constexpr std::size_t kLeastDone = 4;
constexpr double kTerminalEvery_s = 0.1;  // quicker than an eye reads
constexpr double kLineEvery_s = 10;       // of a file that keeps them all
constexpr const char* kErased = "\r\033[K";

double steady_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Of what nobody knows to the second.
std::string roughly(double seconds) {
  constexpr double kToTheSecond_s = 600;
  if (seconds < kToTheSecond_s || seconds >= 3600) return duration_in_words(seconds);
  return std::to_string(std::llround(seconds / 60)) + " min";
}

}  // namespace

std::optional<double> remaining_s(const Pieces& pieces, double elapsed_s) {
  if (pieces.done >= pieces.of) return 0;
  if (pieces.done < std::max(kLeastDone, pieces.at_a_time) || !(elapsed_s > 0)) return std::nullopt;
  return elapsed_s * static_cast<double>(pieces.of - pieces.done) / static_cast<double>(pieces.done);
}

std::string duration_in_words(double seconds) {
  const auto whole = static_cast<long long>(std::llround(std::max(seconds, 0.0)));
  std::array<char, 64> text{};
  if (whole < 60)
    std::snprintf(text.data(), text.size(), "%lld s", whole);
  else if (whole < 3600)
    std::snprintf(text.data(), text.size(), "%lld min %02lld s", whole / 60, whole % 60);
  else
    std::snprintf(text.data(), text.size(), "%lld h %02lld min", whole / 3600, whole % 3600 / 60);
  return text.data();
}

std::string progress_text(const Pieces& pieces, double elapsed_s) {
  std::string text = pieces.what + ": " + std::to_string(pieces.done) + " of " + std::to_string(pieces.of) + ", " +
                     duration_in_words(elapsed_s) + " so far";
  const auto left_s = remaining_s(pieces, elapsed_s);
  if (left_s && pieces.done < pieces.of) text += ", about " + roughly(*left_s) + " left";
  return text;
}

ProgressLine::To ProgressLine::as_stderr_is(bool quiet) {
  if (quiet) return To::nothing;
  return ::isatty(STDERR_FILENO) == 1 ? To::terminal : To::lines;
}

ProgressLine::ProgressLine(To to, std::FILE* out, std::function<double()> clock_s)
    : to_(to), out_(out), clock_s_(clock_s ? std::move(clock_s) : steady_s) {}

ProgressLine::~ProgressLine() { end(); }

void ProgressLine::begin(const std::string& what, std::size_t of, std::size_t at_a_time) {
  end();
  const std::scoped_lock lock(mutex_);
  pieces_ = {.what = what, .of = of, .at_a_time = at_a_time};
  began_s_ = shown_s_ = clock_s_();
  if (to_ == To::terminal && of > 0) show(began_s_, true);
}

void ProgressLine::one_done() {
  const std::scoped_lock lock(mutex_);
  ++pieces_.done;
  show(clock_s_(), false);
}

void ProgressLine::make_room() {
  const std::scoped_lock lock(mutex_);
  if (!on_screen_) return;
  std::fputs(kErased, out_);
  std::fflush(out_);
  on_screen_ = false;
}

void ProgressLine::end() {
  make_room();
  const std::scoped_lock lock(mutex_);
  // Whoever was told how far it is, is told that it is done.
  if (to_ == To::lines && shown_) show(clock_s_(), true);
  shown_ = false;
  pieces_ = {};
}

void ProgressLine::show(double now_s, bool in_any_case) {
  if (to_ == To::nothing || pieces_.of == 0) return;
  const bool is_due = now_s - shown_s_ >= (to_ == To::terminal ? kTerminalEvery_s : kLineEvery_s);
  const bool is_last = to_ == To::terminal && pieces_.done == pieces_.of;
  if (!is_due && !is_last && !in_any_case) return;
  const std::string text = progress_text(pieces_, now_s - began_s_);
  if (to_ == To::terminal)
    std::fprintf(out_, "%s%s", kErased, text.c_str());
  else
    std::fprintf(out_, "%s\n", text.c_str());
  std::fflush(out_);
  shown_s_ = now_s;
  shown_ = true;
  on_screen_ = to_ == To::terminal;
}

}  // namespace bevel::cli
