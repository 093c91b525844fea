// SPDX-License-Identifier: MIT
#pragma once
// How far work in pieces is, for someone who waits: done of how many, the time so far, and what is expected to remain.
// One line on stderr, rewritten in place on a terminal; elsewhere a line now and then.
#include <cstddef>
#include <cstdio>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

namespace bevel::cli {

struct Pieces {
  std::string what;  // "trials examined"
  std::size_t of = 0;
  std::size_t at_a_time = 1;  // threads or processes that work on them
  std::size_t done = 0;       // since the beginning: what was found done is in neither
};

// What remains if the other pieces go on as those that are done. Nothing before there is evidence: four pieces, so that
// their mean has half its own scatter as its error where they scatter as much as they last (exponential times), and one
// of each worker, since with the first one done the others' are done in part and count for nothing.
std::optional<double> remaining_s(const Pieces& pieces, double elapsed_s);

// "42 s", "3 min 05 s", "2 h 05 min"
std::string duration_in_words(double seconds);
// "trials examined: 12 of 100, 3 min 05 s so far, about 23 min left"
std::string progress_text(const Pieces& pieces, double elapsed_s);

// Safe to be told by several threads.
class ProgressLine {
 public:
  enum class To { nothing, terminal, lines };
  static To as_stderr_is(bool quiet = false);

  explicit ProgressLine(To to, std::FILE* out = stderr, std::function<double()> clock_s = {});
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void begin(const std::string& what, std::size_t of, std::size_t at_a_time = 1);
  void one_done();
  // Before somebody else prints: the terminal's line is free then, until the next piece is done.
  void make_room();
  void end();

 private:
  void show(double now_s, bool in_any_case);

  To to_;
  std::FILE* out_;
  std::function<double()> clock_s_;
  std::mutex mutex_;
  Pieces pieces_;
  double began_s_ = 0, shown_s_ = 0;
  bool shown_ = false, on_screen_ = false;
};

}  // namespace bevel::cli
