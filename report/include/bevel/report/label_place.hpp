// SPDX-License-Identifier: MIT
// Where a reference's name goes in a figure: on its line, where it lies over nothing that is drawn.
#pragma once

#include <utility>
#include <vector>

#include <bevel/report/drawing.hpp>

namespace bevel::report {

using Edge = std::pair<Point, Point>;

// Whether any part of the edge, drawn as a straight line, is inside the box.
bool crosses(const Box& box, const Edge& edge);

// Where a name `wide` px wide may stand on a line across the plot at `at` (px from its top or left), in order of
// preference: of a level line above and below it from the right end on, of an upright one on both sides from its top
// down. Some in the plot, or the first of all where it has no room.
std::vector<Box> places_on(const Box& plot, bool level, double at, double wide);

// Of the boxes the first that no edge crosses; else the one that the fewest cross. boxes: in order of preference, not
// empty.
Box least_crossed(const std::vector<Box>& boxes, const std::vector<Edge>& edges);

}  // namespace bevel::report
