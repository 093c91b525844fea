#include "diagnosis/identification/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bevel::diagnosis {
namespace {

constexpr double kSameBic = 1e-3;  // the fits' relative tolerance of 1e-8 times some 1e4 residuals, with a margin

Candidate fit_one(std::string name, bool extended, const std::vector<Insertion>& insertions,
                  const FitOptions& options) {
  Candidate c;
  c.model = std::move(name);
  c.extended = extended;
  try {
    c.fit = fit_determined(insertions, options);
    c.at_insertion = error_figures(insertions, c.fit.needle, Compare::same_insertion, c.fit.entries);
    c.at_depth = error_figures(insertions, c.fit.needle, Compare::same_depth, c.fit.entries);
  } catch (const std::logic_error& e) {  // invalid_argument of the fit, domain_error of the figures
    c.possible = false;
    c.why = e.what();
    return c;
  }
  return c;
}

// Correlated residuals carry less than one measurement each: the count of independent ones is taken from the candidate
// that fits best, and is the same for all. `tilts` is the number of tilt parameters of the last candidate.
void fill_bic(std::vector<Candidate>& all, double tilts) {
  const Candidate* best = nullptr;
  for (const auto& c : all)
    if (c.possible && (best == nullptr || c.fit.deviance < best->fit.deviance)) best = &c;
  if (best == nullptr) return;
  const double rho = std::max(best->fit.lag1_correlation, 0.0);
  const double share = (1 - rho) / (1 + rho);
  const double log_count = std::log(best->fit.residual_count * share);
  for (auto& c : all)
    if (c.possible)
      c.bic = 2 * share * c.fit.deviance +
              (static_cast<double>(c.fit.parameters.size()) + (&c == &all.back() ? tilts : 0)) * log_count;
}

std::string extended_name(const model::NeedleParameters& needle) {
  return std::string("extended, ") + (needle.slip == model::SlipDirection::isotropic ? "isotropic" : "bevel-plane") +
         ", " + (needle.front_wheel == model::FrontWheel::published ? "published" : "nonslip");
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
  std::vector<FitOptions> fitted{bicycle_options(options)};
  all.push_back(fit_one("bicycle", false, insertions, fitted[0]));
  const auto other = [](auto now, auto one, auto two) { return now == one ? two : one; };
  const auto& own = options.start;
  for (const auto slip :
       {own.slip, other(own.slip, model::SlipDirection::isotropic, model::SlipDirection::bevel_plane)})
    for (const auto wheel :
         {own.front_wheel, other(own.front_wheel, model::FrontWheel::published, model::FrontWheel::nonslip)}) {
      FitOptions& o = fitted.emplace_back(options);
      o.start.slip = slip;
      o.start.front_wheel = wheel;
      all.push_back(fit_one(extended_name(o.start), true, insertions, o));
    }
  fill_bic(all, 0);
  if (options.entry_sigma(kTiltX) > 0 || options.entry_sigma(kTiltY) > 0) return all;
  if (std::ranges::none_of(all, &Candidate::possible)) return all;
  const std::size_t best = preferred(all);
  FitOptions tilted = fitted[best];
  tilted.entry_sigma(kTiltX) = tilted.entry_sigma(kTiltY) = kTiltOfRealRigs_rad;
  all.push_back(fit_one(all[best].model + ", tilted entries", all[best].extended, insertions, tilted));
  fill_bic(all, 2 * static_cast<double>(insertions.size()));
  return all;
}

std::size_t preferred(const std::vector<Candidate>& all) {
  std::size_t best = all.size();
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i].possible && (best == all.size() || all[i].bic < all[best].bic - kSameBic)) best = i;
  if (best == all.size()) throw std::invalid_argument(all.empty() ? "no candidate" : all.front().why);
  return best;
}

}  // namespace bevel::diagnosis
