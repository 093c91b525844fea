// SPDX-License-Identifier: MIT
#include <bevel/report/label_place.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>

namespace bevel::report {

// Liang and Barsky's clipping: what of the edge's parameter, 0 to 1, each side leaves.
bool crosses(const Box& box, const Edge& edge) {
  const auto& [from, to] = edge;
  double enters = 0, leaves = 1;
  const std::array<std::array<double, 2>, 4> sides{{{from.x - to.x, from.x - box.left},
                                                    {to.x - from.x, box.right() - from.x},
                                                    {from.y - to.y, from.y - box.top},
                                                    {to.y - from.y, box.bottom() - from.y}}};
  for (const auto& [towards, room] : sides) {
    if (towards == 0 && room < 0) return false;
    if (towards < 0) enters = std::max(enters, room / towards);
    if (towards > 0) leaves = std::min(leaves, room / towards);
  }
  return enters <= leaves;
}

std::vector<Box> places_on(const Box& plot, bool level, double at, double wide) {
  constexpr double kHigh = 13, kAway = 5;
  std::vector<Box> all;
  const double end = level ? plot.width - wide - 4 : plot.height - kHigh;
  for (double along = 0; along == 0 || along <= end; along += level ? 20 : kHigh)
    for (const bool first : {true, false})
      all.push_back(level ? Box{plot.right() - 4 - wide - along, first ? at - 2 - kHigh : at + 2, wide, kHigh}
                          : Box{first ? at + kAway : at - kAway - wide, plot.top + 2 + along, wide, kHigh});
  std::vector<Box> inside;
  std::ranges::copy_if(all, std::back_inserter(inside), [&](const Box& box) {
    return box.left >= plot.left && box.right() <= plot.right() && box.top >= plot.top && box.bottom() <= plot.bottom();
  });
  return inside.empty() ? std::vector<Box>{all.front()} : inside;
}

Box least_crossed(const std::vector<Box>& boxes, const std::vector<Edge>& edges) {
  constexpr double kClear = 4;  // beside the name, where a curve of some width would touch it
  const Box* best = nullptr;
  std::ptrdiff_t fewest = 0;
  for (const Box& box : boxes) {
    const Box around{box.left - kClear, box.top, box.width + 2 * kClear, box.height};
    const auto crossing = std::ranges::count_if(edges, [&](const Edge& edge) { return crosses(around, edge); });
    if (best == nullptr || crossing < fewest) {
      best = &box;
      fewest = crossing;
    }
    if (fewest == 0) break;
  }
  return *best;
}

}  // namespace bevel::report
