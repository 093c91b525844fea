// SPDX-License-Identifier: MIT
#include <bevel/nodes/entry_watch.hpp>

#include <cmath>

namespace bevel::nodes {
namespace {

constexpr double kAtEntry_mm = 1.0;  // by the axes: not inserted yet
constexpr double kDeep_mm = 5.0;     // by a camera, while the axes say that nothing is inserted
constexpr int kSeenDeep = 3;         // times in a row: one may be an outlier

}  // namespace

bool EntryWatch::see_axes(double insertion_mm) {
  at_entry_ = std::abs(insertion_mm) <= kAtEntry_mm;
  const bool first = !begun_;
  begun_ = true;
  if (!at_entry_ || from_entry_ || deep_in_row_ >= kSeenDeep) return false;
  from_entry_ = true;
  return !first;
}

void EntryWatch::see_tip(double depth_mm) {
  if (!at_entry_) return;
  deep_in_row_ = depth_mm > kDeep_mm ? deep_in_row_ + 1 : 0;
  if (deep_in_row_ >= kSeenDeep) from_entry_ = false;
}

}  // namespace bevel::nodes
