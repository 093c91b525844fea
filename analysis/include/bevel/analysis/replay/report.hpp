// SPDX-License-Identifier: MIT
#pragma once
// What bevel-replay prints, and the files that it writes. The same replay gives the same bytes, except for the speed,
// which only print_speed() mentions.
#include <iosfwd>
#include <string>
#include <vector>

#include <bevel/analysis/replay/replay.hpp>

namespace bevel::analysis {

void print(std::ostream& out, const Replay& replay, double ahead_mm);
// What several replays say together: NIS, and measurements predicted.
void print_together(std::ostream& out, const std::vector<Replay>& replays, double ahead_mm);
void print_speed(std::ostream& out, const std::vector<Replay>& replays);

// DIR/<name>.states.csv, DIR/<name>.innovations.csv, DIR/<name>.headings.csv where there are any, and one page
// DIR/<name>.html. Throws IoError naming the file.
void write_files(const Replay& replay, const std::string& folder, double ahead_mm);

}  // namespace bevel::analysis
