// SPDX-License-Identifier: MIT
// report.html: what was found, how sure that is, and the pictures that show it. One file, nothing fetched.
#pragma once

#include <string>

#include <bevel/analysis/diagnose/provenance.hpp>
#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/report/page.hpp>

namespace bevel::analysis {

std::string report_html(const diagnosis::Findings& findings, const Provenance& made_of);

// Its sections, in order. One with nothing to say adds nothing.
void add_verdict(report::Page& page, const diagnosis::Findings& findings);
void add_what_to_do(report::Page& page, const diagnosis::Findings& findings);
void add_parameters(report::Page& page, const diagnosis::Findings& findings);
void add_variation(report::Page& page, const diagnosis::Findings& findings);
void add_at_target(report::Page& page, const diagnosis::Findings& findings);  // in millimetres there
void add_location(report::Page& page, const diagnosis::Findings& findings);
void add_unknown_part(report::Page& page, const diagnosis::Findings& findings);
void add_residuals(report::Page& page, const diagnosis::Findings& findings);
void add_recordings(report::Page& page, const diagnosis::Findings& findings);
void add_paths(report::Page& page, const diagnosis::Findings& findings);
void add_evidence(report::Page& page, const diagnosis::Findings& findings);
void add_held_out(report::Page& page, const diagnosis::Findings& findings);
void add_reach(report::Page& page, const diagnosis::Findings& findings);  // what the recordings could have shown
void add_next_experiment(report::Page& page, const diagnosis::Findings& findings);
void add_noise_and_checks(report::Page& page, const diagnosis::Findings& findings);
void add_making(report::Page& page, const diagnosis::Findings& findings, const Provenance& made_of);

}  // namespace bevel::analysis
