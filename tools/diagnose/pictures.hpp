// The page's pictures, each an <svg> element; "" where there is nothing to show. Where nothing is missing, before and
// after are one model, and it is drawn once.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/mismatch/findings.hpp"

namespace bevel::diagnose {

// measured - model per reading of one channel; NaN where it has none, and at outliers. In mm where the channel is one
// of x, y, z, else in standard deviations of the noise.
struct Residuals {
  std::vector<double> before, after;
};
Residuals residuals_of(const diagnosis::Findings& findings, const diagnosis::Trace& trace, std::size_t channel);
std::string residual_unit(const diagnosis::Findings& findings, std::size_t channel);

// One channel against time, depth, speed, roll, time since stop, since reversal; all recordings together.
std::string residual_picture(const diagnosis::Findings& findings, std::size_t channel);
// The worst spans, each in its recording, with what the base did then.
std::string located_picture(const diagnosis::Findings& findings, std::size_t most);

// x-z and y-z of recordings: measured, and by the models.
std::string path_picture(const diagnosis::Findings& findings, const std::vector<std::size_t>& traces);
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
std::string discrepancy_picture(const std::vector<diagnosis::Discrepancy>& discrepancies);

}  // namespace bevel::diagnose
