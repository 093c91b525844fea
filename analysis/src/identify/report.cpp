// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <ostream>

#include <bevel/analysis/identify/identify.hpp>
#include <bevel/report/numbers.hpp>
#include <bevel/report/page.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)
using nlohmann::json;

namespace {

std::string number(double value, int digits = 4) { return report::format_significant(value, digits); }

// "0.41 k - 0.91 lambda2 (in their plausible units)"
std::string describe(const Direction& direction, const std::vector<FittedParameter>& parameters) {
  std::string text;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double w = direction.weights(static_cast<Eigen::Index>(i));
    if (std::abs(w) < 0.1) continue;
    text += (text.empty() ? (w < 0 ? "-" : "") : (w < 0 ? " - " : " + ")) + number(std::abs(w), 2) + " " +
            kParameterNames[parameters[i].parameter];
  }
  return text;
}

std::string value_beforehand(const HeldParameter& held, int digits = 4) {
  return number(held.value, digits) + (held.by_prior ? " (mean of the prior)" : " (model file)");
}

std::vector<std::string> statements(const Identification& r) {
  std::vector<std::string> all;
  const Candidate& preferred = r.candidates[r.preferred];
  all.push_back(r.method == "trajectory"
                    ? "selected and written: " + preferred.model
                    : "written: the result of --method " + r.method + "; selected by BIC: " + preferred.model);
  for (const auto& c : r.candidates)
    if (c.possible && c.extended && &c != &preferred && !c.fit.held.empty() && r.fit.held.empty()) {
      for (const auto& h : c.fit.held)
        all.push_back(std::string(kParameterNames[h.parameter]) + " is NOT DETERMINED by these recordings: " +
                      h.reason + "; the extended models hold it at " + value_beforehand(h));
      break;
    }
  for (const auto& h : r.fit.held)
    all.push_back(std::string(kParameterNames[h.parameter]) + " is NOT DETERMINED by these recordings: " + h.reason +
                  "; it stays at " + value_beforehand(h));
  for (const auto& d : r.fit.directions)
    if (d.sigma > 1)
      all.push_back("NOT FIXED by these recordings: " + describe(d, r.fit.parameters) + " (the data's own error is " +
                    number(d.sigma, 2) + " times the plausible range)");
    else if (d.sigma > 0.3)
      all.push_back("weakly fixed: " + describe(d, r.fit.parameters) + " (to " + number(d.sigma, 2) +
                    " of the plausible range)");
  for (const auto& p : r.fit.parameters) {
    if (p.at_bound)
      all.push_back(std::string(kParameterNames[p.parameter]) +
                    " ran to the bound of the model's domain: something else than slip wants to be explained");
    if (p.prior_share > 0.1)
      all.push_back("the prior decides " + number(100 * p.prior_share, 2) + " % of " + kParameterNames[p.parameter]);
  }
  for (std::size_t i = 0; i < r.fit.parameters.size(); ++i)
    for (std::size_t j = i + 1; j < r.fit.parameters.size(); ++j) {
      const double c = r.fit.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (std::abs(c) > 0.95)
        all.push_back(std::string(kParameterNames[r.fit.parameters[i].parameter]) + " and " +
                      kParameterNames[r.fit.parameters[j].parameter] + " trade off (correlation " + number(c, 3) + ")");
    }
  if (r.fit.lag1_correlation > 0)
    all.push_back("successive residuals correlate by " + number(r.fit.lag1_correlation, 2) +
                  ": the intervals are widened for it");
  if (!r.fit.converged) all.push_back("the fit did not converge");
  return all;
}

std::vector<std::vector<std::string>> parameter_rows(const FitResult& fit) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& p : fit.parameters)
    // At a bound the curvature of the likelihood says nothing of the error: no figure rather than a tiny one.
    rows.push_back({kParameterNames[p.parameter], number(p.value), p.at_bound ? "-" : number(p.std_error, 2),
                    p.at_bound ? "-" : number(p.low95) + " to " + number(p.high95), number(100 * p.prior_share, 2),
                    p.at_bound ? "at its bound" : ""});
  for (const auto& h : fit.held)
    rows.push_back({kParameterNames[h.parameter], number(h.value), "-", "-", "-", "not determined, held"});
  return rows;
}
const std::vector<std::string> kParameterHeader = {"parameter", "value",           "std. error",
                                                   "95 %",      "prior's share %", "note"};

std::vector<std::vector<std::string>> candidate_rows(const Identification& r) {
  const auto& candidates = r.candidates;
  const double best = candidates[preferred(candidates)].bic;
  std::vector<std::vector<std::string>> rows;
  for (const auto& c : candidates) {
    if (!c.possible) {
      rows.push_back({c.model, "-", "-", "-", "-", "-", "-", "-"});
      continue;
    }
    const auto& n = c.fit.needle;
    rows.push_back({c.model + (&c == &candidates[r.preferred] ? " *" : ""), number(n.curvature_per_mm),
                    number(n.lambda1_per_rad, 3), number(n.lambda2, 3), number(c.at_insertion.rms_mm, 3),
                    number(c.at_insertion.largest_mm, 3), number(c.at_depth.largest_mm, 3), number(c.bic - best, 3)});
  }
  return rows;
}
const std::vector<std::string> kCandidateHeader = {"model",  "k 1/mm",     "lambda1",           "lambda2",
                                                   "RMS mm", "largest mm", "largest, at depth", "BIC above best"};
const char* const kCandidateNote = "* selected";

void print(std::ostream& out, const std::vector<std::string>& header,
           const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> width;
  for (const auto& h : header) width.push_back(h.size());
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], row[i].size());
  const auto line = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) out << cells[i] << std::string(width[i] - cells[i].size() + 2, ' ');
    out << '\n';
  };
  line(header);
  for (const auto& row : rows) line(row);
}

json as_json(const model::NeedleParameters& n) {
  return {{"curvature_per_mm", n.curvature_per_mm},
          {"wheelbase_mm", n.wheelbase_mm},
          {"lambda1_per_rad", n.lambda1_per_rad},
          {"lambda2", n.lambda2},
          {"slip", n.slip == model::SlipDirection::isotropic ? "isotropic" : "bevel-plane"},
          {"front_wheel", n.front_wheel == model::FrontWheel::published ? "published" : "nonslip"}};
}
json as_json(const ErrorFigures& f) {
  return {{"rms_mm", f.rms_mm}, {"largest_mm", f.largest_mm}, {"largest_at_mm", f.largest_at_mm}, {"count", f.count}};
}

report::Figure path_figure(const Identification& r, int axis, const char* label) {
  report::Figure figure;
  figure.x_label = "insertion (mm)";
  figure.y_label = std::string(label) + " (mm)";
  std::vector<double> s, seen, fitted_s, fitted, bicycle;
  for (std::size_t i = 0; i < r.insertions.size(); ++i) {
    const auto& insertion = r.insertions[i];
    Path path, other;
    const bool ok =
        integrate(insertion, r.chosen, i < r.fit.entries.size() ? r.fit.entries[i] : Entry(Entry::Zero()), false, path);
    const auto& b = r.candidates.front();
    const bool ok_bicycle = b.possible && integrate(insertion, b.fit.needle, b.fit.entries[i], false, other);
    for (std::size_t k = 0; k < insertion.observations.size(); ++k) {
      const auto& o = insertion.observations[k];
      s.push_back(o.insertion_mm);
      seen.push_back(o.position_mm(axis));
      fitted_s.push_back(o.insertion_mm);
      fitted.push_back(ok ? path.position_mm[k](axis) : NAN);
      bicycle.push_back(ok_bicycle ? other.position_mm[k](axis) : NAN);
    }
    fitted_s.push_back(insertion.observations.back().insertion_mm);
    fitted.push_back(NAN);
    bicycle.push_back(NAN);
  }
  figure.points("seen", s, seen, report::Colour::blue);
  figure.dashed("bicycle", fitted_s, bicycle, report::Colour::orange);
  figure.line("fitted", fitted_s, fitted, report::Colour::green);
  return figure;
}

report::Figure error_figure(const Identification& r) {
  report::Figure figure;
  figure.x_label = "insertion (mm)";
  figure.y_label = "distance, model to seen (mm)";
  std::vector<double> s, bicycle, fitted;
  for (std::size_t i = 0; i < r.insertions.size(); ++i) {
    const auto& b = r.candidates.front();
    const auto e = path_errors_mm(r.insertions[i], r.chosen, Compare::same_insertion, r.fit.entries[i]);
    std::vector<double> e_b(e.size(), NAN);
    if (b.possible) e_b = path_errors_mm(r.insertions[i], b.fit.needle, Compare::same_insertion, b.fit.entries[i]);
    for (std::size_t k = 0; k < e.size(); ++k) {
      s.push_back(r.insertions[i].observations[k].insertion_mm);
      fitted.push_back(e[k]);
      bicycle.push_back(e_b[k]);
    }
  }
  figure.points("bicycle", s, bicycle, report::Colour::orange);
  figure.points("fitted", s, fitted, report::Colour::green);
  return figure;
}

}  // namespace

void print_table(std::ostream& out, const Identification& r) {
  std::size_t measurements = 0;
  for (const auto& i : r.insertions) measurements += i.observations.size();
  out << r.insertions.size() << " insertions, " << measurements << " measurements, method " << r.method << ", prior "
      << r.prior << "\n";
  for (const auto& fault : r.faults) out << "fault in a log: " << fault << '\n';
  out << '\n';
  print(out, kParameterHeader, parameter_rows(r.fit));
  out << "noise is " << number(r.fit.noise_scale, 3) << " times what the measurements claim; RMS "
      << number(r.before.rms_mm, 3) << " -> " << number(r.after.rms_mm, 3) << " mm, largest "
      << number(r.before.largest_mm, 3) << " -> " << number(r.after.largest_mm, 3) << " mm\n";
  for (const auto& s : statements(r)) out << "- " << s << '\n';
  out << '\n';
  print(out, kCandidateHeader, candidate_rows(r));
  out << kCandidateNote << "\n\n";
  if (r.angle_rate_refusal.empty())
    out << "angle-rate (Section IV, k and ell as given): lambda1 " << number(r.angle_rate.needle.lambda1_per_rad)
        << ", lambda2 " << number(r.angle_rate.needle.lambda2)
        << (r.angle_rate.in_domain ? "" : " (outside the model's domain)") << '\n';
  else
    out << "angle-rate: " << r.angle_rate_refusal << '\n';
}

std::string figures_json(const Identification& r) {
  json j;
  j["method"] = r.method;
  j["prior"] = r.prior;
  j["needle"] = as_json(r.chosen);
  for (const auto& p : r.fit.parameters)
    j["parameters"][kParameterNames[p.parameter]] = {{"value", p.value},
                                                     {"determined", !p.at_bound},
                                                     {"std_error", p.at_bound ? json() : json(p.std_error)},
                                                     {"ci95", p.at_bound ? json() : json({p.low95, p.high95})},
                                                     {"prior_share", p.prior_share},
                                                     {"at_bound", p.at_bound}};
  for (const auto& h : r.fit.held)
    j["parameters"][kParameterNames[h.parameter]] = {{"value", h.value},
                                                     {"determined", false},
                                                     {"std_error", nullptr},
                                                     {"ci95", nullptr},
                                                     {"held_at", h.by_prior ? "prior" : "model file"},
                                                     {"why", h.reason}};
  for (Eigen::Index i = 0; i < r.fit.correlation.rows(); ++i)
    j["correlation"].push_back(std::vector<double>(r.fit.correlation.row(i).begin(), r.fit.correlation.row(i).end()));
  for (const auto& d : r.fit.directions)
    j["directions"].push_back({{"weights", std::vector<double>(d.weights.begin(), d.weights.end())},
                               {"sigma_in_plausible_units", d.sigma},
                               {"fixed_by_data", d.sigma <= 1}});
  j["noise"] = {{"scale", r.fit.noise_scale}, {"lag1_correlation", r.fit.lag1_correlation}};
  j["errors"] = {{"before", as_json(r.before)}, {"after", as_json(r.after)}};
  j["converged"] = r.fit.converged;
  for (const auto& c : r.candidates) {
    json one = {{"model", c.model}, {"possible", c.possible}, {"selected", &c == &r.candidates[r.preferred]}};
    if (c.possible) {
      one["needle"] = as_json(c.fit.needle);
      one["at_insertion"] = as_json(c.at_insertion);
      one["at_depth"] = as_json(c.at_depth);
      one["bic"] = c.bic;
    } else {
      one["why"] = c.why;
    }
    j["candidates"].push_back(one);
  }
  if (r.angle_rate_refusal.empty())
    j["angle_rate"] = {{"needle", as_json(r.angle_rate.needle)},
                       {"rate_rms_rad_s", r.angle_rate.rate_rms_rad_s},
                       {"in_domain", r.angle_rate.in_domain}};
  for (std::size_t i = 0; i < r.insertions.size(); ++i)
    j["insertions"].push_back({{"name", r.insertions[i].name},
                               {"measurements", r.insertions[i].observations.size()},
                               {"skipped", r.insertions[i].skipped},
                               {"entry", std::vector<double>(r.fit.entries[i].begin(), r.fit.entries[i].end())}});
  return j.dump(2) + "\n";
}

void save_report(const Identification& r, const std::string& path) {
  report::Page page("Identification of the needle");
  const bool open = r.fit.unfixed_directions() > 0;
  const bool held = !r.fit.held.empty();
  bool bound = false;
  for (const auto& p : r.fit.parameters) bound |= p.at_bound;
  page.verdict(open || bound || held ? report::Tone::warning : report::Tone::good,
               bound  ? "A parameter ran to the bound of the model's domain"
               : open ? "The recordings leave a direction open"
               : held ? "The recordings do not determine every parameter"
                      : "The recordings determine every fitted parameter",
               "RMS error " + number(r.after.rms_mm, 3) + " mm, largest " + number(r.after.largest_mm, 3) +
                   " mm over " + std::to_string(r.insertions.size()) + " insertions; method " + r.method + ", prior " +
                   r.prior + ".");
  page.heading("Parameters").table(kParameterHeader, parameter_rows(r.fit));
  const auto said = statements(r);
  if (!said.empty()) page.list(said);
  std::vector<std::string> header{""};
  std::vector<std::vector<std::string>> correlation;
  for (const auto& p : r.fit.parameters) header.emplace_back(kParameterNames[p.parameter]);
  for (std::size_t i = 0; i < r.fit.parameters.size(); ++i) {
    correlation.push_back({kParameterNames[r.fit.parameters[i].parameter]});
    for (std::size_t k = 0; k < r.fit.parameters.size(); ++k)
      correlation.back().push_back(
          number(r.fit.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)), 3));
  }
  page.subheading("Correlation of the estimates").table(header, correlation);
  page.heading("Models side by side")
      .table(kCandidateHeader, candidate_rows(r),
             std::string(kCandidateNote) + "; BIC differences above 10 are strong evidence.");
  page.heading("Paths");
  page.figure(path_figure(r, 1, "y"), "Lateral position in the bevel's plane: seen, and by the models.");
  bool sees_x = false;
  for (const auto& i : r.insertions)
    for (const auto& o : i.observations) sees_x |= o.rank == 3;
  if (sees_x) page.figure(path_figure(r, 0, "x"), "Lateral position out of the bevel's plane at entry.");
  page.figure(error_figure(r), "Distance between model and measurement at the same inserted length, on the seen axes.");
  page.save(path);
}

}  // namespace bevel::analysis
