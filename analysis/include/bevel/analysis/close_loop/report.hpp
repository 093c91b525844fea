// SPDX-License-Identifier: MIT
// The three figures as a table for the terminal, as JSON, and as a page.
#pragma once

#include <string>
#include <vector>

#include <bevel/analysis/close_loop/close_loop.hpp>
#include <bevel/report/figure.hpp>

namespace bevel::analysis {

std::string table_text(const ClosedLoop& loop);
std::string to_json(const ClosedLoop& loop);
std::string page_html(const ClosedLoop& loop);

// What is to be said beside the figures, one sentence each: what got better, what did not and why.
std::vector<std::string> conclusions(const ClosedLoop& loop);
std::string found_in_words(const ClosedLoop& loop);  // "torsional_windup (lag_at_100mm_rad 0.823)", "nothing"

// One picture a figure.
report::Figure rig_picture(const ClosedLoop& loop);
report::Figure estimator_picture(const ClosedLoop& loop);
report::Figure targeting_picture(const ClosedLoop& loop);

}  // namespace bevel::analysis
