#include "diagnosis/identification/candidates.hpp"

#include <cmath>
#include <stdexcept>

namespace bevel::diagnosis {
namespace {

Candidate fit_one(std::string name, bool extended, const std::vector<Insertion>& insertions,
                  const FitOptions& options) {
  Candidate c;
  c.model = std::move(name);
  c.extended = extended;
  try {
    c.fit = fit_from_many_starts(insertions, options);
    c.at_insertion = error_figures(insertions, c.fit.needle, Compare::same_insertion, c.fit.entries);
    c.at_depth = error_figures(insertions, c.fit.needle, Compare::same_depth, c.fit.entries);
  } catch (const std::logic_error& e) {  // invalid_argument of the fit, domain_error of the figures
    c.possible = false;
    c.why = e.what();
    return c;
  }
  return c;
}

// Successive residuals that correlate carry less than one measurement each: the count of independent ones is taken from
// the candidate that fits best, and is the same for all.
void fill_bic(std::vector<Candidate>& all) {
  const Candidate* best = nullptr;
  for (const auto& c : all)
    if (c.possible && (best == nullptr || c.fit.squares < best->fit.squares)) best = &c;
  if (best == nullptr) return;
  const double rho = std::max(best->fit.lag1_correlation, 0.0);
  const double independent = best->fit.residual_count * (1 - rho) / (1 + rho);
  for (auto& c : all)
    if (c.possible)
      c.bic = independent * std::log(c.fit.squares / c.fit.residual_count) +
              static_cast<double>(c.fit.parameters.size()) * std::log(independent);
}

}  // namespace

FitOptions bicycle_options(FitOptions options) {
  options.start.lambda1_per_rad = 0;
  options.start.lambda2 = 0;
  options.fitted[kLambda1] = options.fitted[kLambda2] = options.fitted[kWheelbase] = false;
  return options;
}

std::vector<Candidate> fit_candidates(const std::vector<Insertion>& insertions, const FitOptions& options) {
  std::vector<Candidate> all;
  all.push_back(fit_one("bicycle", false, insertions, bicycle_options(options)));
  for (const auto slip : {model::SlipDirection::isotropic, model::SlipDirection::bevel_plane})
    for (const auto wheel : {model::FrontWheel::published, model::FrontWheel::nonslip}) {
      FitOptions o = options;
      o.start.slip = slip;
      o.start.front_wheel = wheel;
      all.push_back(fit_one(std::string("extended, ") +
                                (slip == model::SlipDirection::isotropic ? "isotropic" : "bevel-plane") + ", " +
                                (wheel == model::FrontWheel::published ? "published" : "nonslip"),
                            true, insertions, o));
    }
  fill_bic(all);
  return all;
}

}  // namespace bevel::diagnosis
