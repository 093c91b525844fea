// SPDX-License-Identifier: MIT
#pragma once
// What the needle is told to do: eight short recordings of the kinds that a lab makes, and the axes' motion that
// follows.
#include <string>
#include <vector>

#include "proof/random.hpp"

namespace bevel::proof {

inline constexpr double kStep_s = 1e-3;  // of all simulation here
inline constexpr int kRecordings = 8;

struct Segment {
  double duration_s;
  double insertion_rate_mm_s;
  double rotation_rate_rad_s;
};

struct Script {
  std::string kind;
  std::vector<Segment> segments;
  double largest_depth_mm() const;
  double duration_s() const;
};

// Eight recordings. Rich: insertions slow and fast, ladders with reversals, rotation while inserting, spin, stop and
// hold, retraction and re-insertion, flips, a random mixture. Poor (`rich` false): insertions of one turn direction
// and little else, in which several effects cannot show.
std::vector<Script> draw_scripts(Random& random, bool rich);

// The axes as their encoders see them, every kStep_s from 0 on, with ramps of limited acceleration.
struct AxisMotion {
  std::vector<double> insertion_mm;
  std::vector<double> insertion_rate_mm_s;
  std::vector<double> rotation_rad;
  std::vector<double> rotation_rate_rad_s;
  std::size_t size() const { return insertion_mm.size(); }
  double duration_s() const { return kStep_s * static_cast<double>(size() - 1); }
};
AxisMotion follow(const Script& script);

}  // namespace bevel::proof
