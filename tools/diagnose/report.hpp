// report.html: what was found, how sure that is, and the pictures that show it. One file, nothing fetched.
#pragma once

#include <string>

#include "diagnosis/mismatch/findings.hpp"
#include "io/html_report.hpp"
#include "tools/diagnose/provenance.hpp"

namespace bevel::diagnose {

std::string report_html(const diagnosis::Findings& findings, const Provenance& made_of);

// Its sections, in order. One with nothing to say adds nothing.
void add_verdict(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_what_to_do(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_parameters(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_variation(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_location(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_unknown_part(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_residuals(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_paths(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_evidence(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_held_out(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_reach(io::HtmlReport& page, const diagnosis::Findings& findings);  // what the recordings could have shown
void add_next_experiment(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_noise_and_checks(io::HtmlReport& page, const diagnosis::Findings& findings);
void add_making(io::HtmlReport& page, const diagnosis::Findings& findings, const Provenance& made_of);

}  // namespace bevel::diagnose
