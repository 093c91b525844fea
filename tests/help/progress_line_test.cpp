// SPDX-License-Identifier: MIT
// What someone who waits is told: the estimate, its words, and how often.
#include <bevel/cli/progress_line.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <queue>
#include <random>
#include <sstream>
#include <tuple>

namespace bevel::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Remaining, NothingIsSaidBeforeThereIsEvidence) {
  EXPECT_FALSE(remaining_s({"", 100, 1, 0}, 5));
  EXPECT_FALSE(remaining_s({"", 100, 1, 3}, 5));
  EXPECT_FALSE(remaining_s({"", 100, 8, 7}, 5));
  EXPECT_FALSE(remaining_s({"", 100, 1, 4}, 0)) << "no time has passed";
  EXPECT_EQ(remaining_s({"", 100, 1, 4}, 8), 192);
  EXPECT_EQ(remaining_s({"", 100, 8, 8}, 8), 92);
  EXPECT_EQ(remaining_s({"", 100, 1, 100}, 8), 0);
  EXPECT_EQ(remaining_s({"", 0, 1, 0}, 0), 0);
}

// 2000 runs of 100 pieces on two workers, times exponential (they scatter as much as they last), seed 1: the first
// estimate errs by about half, as four such pieces must; later ones by less.
TEST(Remaining, ErrsByWhatTheScatterOfThePiecesAllows) {
  std::mt19937 random(1);
  std::exponential_distribution<double> time_s(1.0 / 30);
  constexpr std::size_t kPieces = 100;
  for (const auto& [at, largest_bias, largest_error] : {std::tuple(4U, 0.4, 0.75), {25U, 0.1, 0.3}, {75U, 0.1, 0.3}}) {
    double sum = 0, squares = 0;
    constexpr int kRuns = 2000;
    for (int run = 0; run < kRuns; ++run) {
      std::priority_queue<double, std::vector<double>, std::greater<>> ends_s;
      ends_s.push(time_s(random)), ends_s.push(time_s(random));
      std::vector<double> done_s;
      while (done_s.size() < kPieces) {
        done_s.push_back(ends_s.top());
        ends_s.pop();
        if (done_s.size() + ends_s.size() < kPieces) ends_s.push(done_s.back() + time_s(random));
      }
      const double left_s = done_s.back() - done_s[at - 1];
      const double log_error = std::log(*remaining_s({"", kPieces, 2, at}, done_s[at - 1]) / left_s);
      sum += log_error, squares += log_error * log_error;
    }
    const double bias = sum / kRuns, error = std::sqrt(squares / kRuns);
    std::printf("after %u of %zu: log of estimate over truth, mean %.2f, rms %.2f\n", at, kPieces, bias, error);
    EXPECT_LT(std::abs(bias), largest_bias);
    EXPECT_LT(error, largest_error);
  }
}

TEST(Words, OfDurations) {
  EXPECT_EQ(duration_in_words(-1), "0 s");
  EXPECT_EQ(duration_in_words(59.4), "59 s");
  EXPECT_EQ(duration_in_words(59.6), "1 min 00 s");
  EXPECT_EQ(duration_in_words(185), "3 min 05 s");
  EXPECT_EQ(duration_in_words(3599.7), "1 h 00 min");
  EXPECT_EQ(duration_in_words(90061), "25 h 01 min");
}

TEST(Words, OfProgress) {
  EXPECT_EQ(progress_text({"trials examined", 100, 1, 2}, 30), "trials examined: 2 of 100, 30 s so far");
  EXPECT_EQ(progress_text({"trials examined", 100, 2, 12}, 185),
            "trials examined: 12 of 100, 3 min 05 s so far, about 23 min left");
  EXPECT_EQ(progress_text({"trials examined", 12, 2, 12}, 185), "trials examined: 12 of 12, 3 min 05 s so far");
}

class Line : public ::testing::Test {
 protected:
  ~Line() override { std::fclose(out_); }
  std::string said() {
    std::fflush(out_);
    std::rewind(out_);
    std::string text;
    for (int c = 0; (c = std::fgetc(out_)) != EOF;) text += static_cast<char>(c);
    return text;
  }
  std::FILE* out_ = std::tmpfile();
  double now_s_ = 100;
  ProgressLine line_of(ProgressLine::To to) {
    return ProgressLine(to, out_, [this] { return now_s_; });
  }
};

TEST_F(Line, OnATerminalIsRewrittenAndGone) {
  {
    ProgressLine line = line_of(ProgressLine::To::terminal);
    line.begin("pieces", 3);
    for (int i = 0; i < 3; ++i) {
      now_s_ += 2;
      line.one_done();
      if (i == 0) line.make_room(), line.make_room();
    }
    line.end();
  }
  const std::string erased = "\r\033[K";
  EXPECT_EQ(said(), erased + "pieces: 0 of 3, 0 s so far" + erased + "pieces: 1 of 3, 2 s so far" + erased + erased +
                        "pieces: 2 of 3, 4 s so far" + erased + "pieces: 3 of 3, 6 s so far" + erased);
}

TEST_F(Line, OnATerminalIsNoFlicker) {
  ProgressLine line = line_of(ProgressLine::To::terminal);
  line.begin("pieces", 1000);
  for (int i = 0; i < 500; ++i) {
    now_s_ += 0.001;
    line.one_done();
  }
  const std::string text = said();
  EXPECT_LE(std::count(text.begin(), text.end(), '\r'), 6);
}

TEST_F(Line, InAFileAreFew) {
  {
    ProgressLine line = line_of(ProgressLine::To::lines);
    line.begin("short work", 100);
    for (int i = 0; i < 100; ++i) {
      now_s_ += 0.09;
      line.one_done();
    }
    line.begin("long work", 100, 2);
    for (int i = 0; i < 100; ++i) {
      now_s_ += 0.35;
      line.one_done();
    }
  }
  std::istringstream text(said());
  std::vector<std::string> lines;
  for (std::string one; std::getline(text, one);) lines.push_back(one);
  EXPECT_THAT(lines,
              ElementsAre("long work: 29 of 100, 10 s so far, about 25 s left",
                          "long work: 58 of 100, 20 s so far, about 15 s left",
                          "long work: 87 of 100, 30 s so far, about 5 s left", "long work: 100 of 100, 35 s so far"));
}

TEST_F(Line, IsSilentWhereItIsTold) {
  ProgressLine line = line_of(ProgressLine::To::nothing);
  line.begin("pieces", 2);
  now_s_ += 100;
  line.one_done();
  line.end();
  EXPECT_THAT(said(), IsEmpty());
}

}  // namespace
}  // namespace bevel::cli
