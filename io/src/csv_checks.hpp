// SPDX-License-Identifier: MIT
// What cannot be true of a needle's recording, whatever its columns are called: rows that no rig makes, and a tip that
// does not go where the base pushes it.
#pragma once

#include <string>
#include <vector>

#include "csv_rows.hpp"

namespace bevel::io {

template <class Sample>
struct Placed {
  Sample sample;
  int line = 0;
};

// All in order of time.
struct PlacedReadings {
  std::vector<Placed<model::ActuatorState>> base;
  std::vector<Placed<model::TipMeasurement>> tips;
  std::vector<Placed<model::TipHeading>> headings;
};

// Removes rows that are implausible given their neighbours (bevel/io/plausibility.hpp), and lists each in `left_out`:
// "FILE:LINE: what; the row is left out". If tip and base share their rows, a row is left out as a whole. Throws
// Error for motion that lasts, and where more than a fifth would have to go.
void leave_out_the_implausible(PlacedReadings& readings, const std::string& tip_path, const std::string& base_path,
                               bool share_rows, std::vector<std::string>& left_out);

// The tip is at the end of what was pushed in: it is never farther from where it began than the base moved, and while
// the base moves its first 50 mm, the tip's z grows with it. Throws ParseError where that is not so of more
// than a fifth of the tips, with the two figures, what is allowed and the line; returns a sentence on fewer, "" for
// none. Wrong units, signs and columns look like this.
std::string require_tip_follows_base(const PlacedReadings& readings, const std::string& tip_path);

}  // namespace bevel::io
