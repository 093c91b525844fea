// SPDX-License-Identifier: MIT
#pragma once
// Rows of a stepwise insertion into stops: of each depth that was commanded, what the sensor says while the needle lies
// still.
#include <Eigen/Core>
#include <vector>

namespace bevel::io {

// One row: the depth that was commanded, and what was read, in any unit; all rows alike in size.
struct StopRow {
  double depth_mm = 0;
  Eigen::VectorXd reading;
  std::size_t row = 0;  // for the caller
};

struct Stop {
  double depth_mm = 0;
  Eigen::VectorXd reading;           // median of each column
  std::size_t count = 0;             // rows that it is made of
  std::size_t first_row = 0;         // the caller's, of the stop's first
  double information_share() const;  // information of its median, in that of one row
};

// Rows of one depth, one after the other, are a stop. `still`: how many of a reading's first columns are positions in
// mm, which say whether the needle lies still. Where a stop is, its rows crowd, one step from the stops beside it; rows
// further from there than a fifth of the way to the nearest other stop are left out and counted: those on the way to
// the next, and those that lie there before its depth is noted.
std::vector<Stop> find_stops(const std::vector<StopRow>& rows, Eigen::Index still, int& left_out);

}  // namespace bevel::io
