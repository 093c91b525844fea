// SPDX-License-Identifier: MIT
#pragma once
// The two pictures of the page that are no plots of y over x.
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "proof/intervals.hpp"

namespace bevel::proof {

// Shares as dots with their 95 % intervals, one line each; a goal as a tick where there is one (negative: none).
struct ShareLine {
  std::string label;
  Share share;
  double goal = -1;
};
std::string share_figure(const std::vector<ShareLine>& lines);

// Rows: truth, columns: verdict; "none" first and "unknown" last, rows of trials only where there are any.
std::string confusion_figure(const std::map<std::string, std::map<std::string, int>>& confusion);

}  // namespace bevel::proof
