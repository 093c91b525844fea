// SPDX-License-Identifier: MIT
// The page's figures and pictures; none where there is nothing to show. A picture is an <svg> element. Where nothing is
// missing, before and after are one model, and it is drawn once.
#pragma once

#include <string>
#include <vector>

#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/report/drawing.hpp>
#include <bevel/report/figure.hpp>

namespace bevel::analysis {

// Before and after keep their colours through the whole page.
inline constexpr auto kBefore = report::Colour::orange, kAfter = report::Colour::blue;
inline constexpr const char* kBeforeInk = report::ink::kOrange;
inline constexpr const char* kAfterInk = report::ink::kBlue;

// measured - model per reading of one channel; NaN where it has none, and at outliers. In mm where the channel is one
// of x, y, z, else in standard deviations of the noise.
struct Residuals {
  std::vector<double> before, after;
};
Residuals residuals_of(const diagnosis::Findings& findings, const diagnosis::Trace& trace, std::size_t channel);
std::string residual_unit(const diagnosis::Findings& findings, std::size_t channel);
// Of pictures and tables: seconds, or of a log without a clock the number of the stop.
std::string time_label(const diagnosis::Findings& findings);
std::string time_span(const diagnosis::Findings& findings, const diagnosis::Location& where);

// One channel against time, depth, speed, roll, time since stop, since reversal (without a clock against depth, roll
// and since reversal); all recordings together. Panels in which a reading is known by its number: pointing at it in one
// shows it in all.
std::vector<report::Figure> residual_panels(const diagnosis::Findings& findings, std::size_t channel);
// One recording over time: every channel's residuals, below them what the base did.
std::vector<report::Figure> recording_panels(const diagnosis::Findings& findings, std::size_t trace);
// The worst spans, each in its recording, with what the base did then: panels for two columns.
std::vector<report::Figure> located_panels(const diagnosis::Findings& findings, std::size_t most);

// x over z and y over z of recordings, panels for two columns: measured, and by the models.
std::vector<report::Figure> path_panels(const diagnosis::Findings& findings, const std::vector<std::size_t>& traces);
// The same of one recording, in space.
report::Space path_in_space(const diagnosis::Findings& findings, std::size_t trace);
// Indices of traces, those that the model before gets worst first.
std::vector<std::size_t> worst_first(const diagnosis::Findings& findings);

// Every effect tried, best first: its log Bayes factor as a bar, a mark where it is likelier than not.
std::string ranking_picture(const diagnosis::Findings& findings, std::vector<diagnosis::TriedEffect> tried);
std::string held_out_picture(const diagnosis::Findings& findings);
// Parameters with their intervals, each on its own scale, with the value at which the effect would vanish.
std::string interval_picture(const diagnosis::Findings& findings);

// What each insertion has of its own, with intervals, beside the standard deviation between insertions.
std::string insertion_picture(const diagnosis::Findings& findings);

// |cosine| between what effects show, and what the needle's own parameters take of each.
std::string confusion_picture(const diagnosis::Findings& findings);
std::vector<report::Figure> discrepancy_panels(const std::vector<diagnosis::Discrepancy>& discrepancies);

}  // namespace bevel::analysis
