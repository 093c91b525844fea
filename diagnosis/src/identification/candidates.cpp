// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/identification/candidates.hpp>

#include <algorithm>
#include <cmath>

#include <bevel/error.hpp>

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
  } catch (const Error& e) {  // invalid_argument of the fit, domain_error of the figures
    c.possible = false;
    c.why = e.what();
    return c;
  }
  return c;
}

// Correlated residuals carry less than one measurement each: the count of independent ones is taken from the candidate
// that fits best, and is the same for all. `tilts` is the number of tilt parameters of the candidates from `tilted` on.
void fill_bic(std::vector<Candidate>& all, std::size_t tilted, double tilts) {
  const Candidate* best = nullptr;
  for (const auto& c : all)
    if (c.possible && (best == nullptr || c.fit.deviance < best->fit.deviance)) best = &c;
  if (best == nullptr) return;
  const double rho = std::max(best->fit.lag1_correlation, 0.0);
  const double share = (1 - rho) / (1 + rho);
  const double log_count = std::log(best->fit.residual_count * share);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double parameters = static_cast<double>(all[i].fit.parameters.size()) + (i < tilted ? 0 : tilts);
    if (all[i].possible) all[i].bic = 2 * share * all[i].fit.deviance + parameters * log_count;
  }
}

// The first of the lowest BIC among candidates from..to; `to` if none of them can follow the insertions.
std::size_t best_of(const std::vector<Candidate>& all, std::size_t from, std::size_t to) {
  std::size_t best = to;
  for (std::size_t i = from; i < to; ++i)
    if (all[i].possible && (best == to || all[i].bic < all[best].bic - kSameBic)) best = i;
  return best;
}

std::string extended_name(const model::NeedleParameters& needle) {
  return std::string("extended, ") + (needle.slip == model::SlipDirection::isotropic ? "isotropic" : "bevel-plane") +
         ", " + (needle.front_wheel == model::FrontWheel::published ? "published" : "nonslip");
}

}  // namespace

FitOptions bicycle_options(FitOptions options) {
  options.start.lambda1_per_rad = 0;
  options.start.lambda2 = 0;
  options.fitted[kNeedleLambda1] = options.fitted[kNeedleLambda2] = options.fitted[kNeedleWheelbase] = false;
  return options;
}

std::vector<Candidate> fit_candidates(const std::vector<Insertion>& insertions, const FitOptions& options) {
  std::vector<Candidate> all;
  std::vector<FitOptions> fitted{bicycle_options(options)};
  all.push_back(fit_one("bicycle", false, insertions, fitted[0]));
  // The structure of the model file first: it is selected where another one is the same model. In one plane
  // the two slips are the same model, and the data do not determine the front wheel's sign either.
  const bool in_plane = !options.fit_slip_in_plane && !separate_slip(insertions);
  const auto& own = options.start;
  const auto other_slip =
      own.slip == model::SlipDirection::isotropic ? model::SlipDirection::bevel_plane : model::SlipDirection::isotropic;
  const auto other_wheel =
      own.front_wheel == model::FrontWheel::published ? model::FrontWheel::nonslip : model::FrontWheel::published;
  for (const auto slip : {own.slip, other_slip})
    for (const auto wheel : {own.front_wheel, other_wheel}) {
      if (in_plane && (slip != own.slip || wheel != own.front_wheel)) continue;
      FitOptions& o = fitted.emplace_back(options);
      o.start.slip = slip;
      o.start.front_wheel = wheel;
      all.push_back(fit_one(extended_name(o.start), true, insertions, o));
    }
  fill_bic(all, 0, 0);
  if (options.entry_sigma(kEntryTiltX) > 0 || options.entry_sigma(kEntryTiltY) > 0) return all;
  const std::size_t untilted = all.size();
  for (const std::size_t best : {std::size_t{0}, best_of(all, 1, untilted)}) {
    if (best >= untilted || !all[best].possible) continue;
    FitOptions tilted = fitted[best];
    tilted.entry_sigma(kEntryTiltX) = tilted.entry_sigma(kEntryTiltY) = kTiltOfRealRigs_rad;
    all.push_back(fit_one(all[best].model + ", tilted entries", all[best].extended, insertions, tilted));
  }
  fill_bic(all, untilted, 2 * static_cast<double>(insertions.size()));
  return all;
}

std::size_t preferred(const std::vector<Candidate>& all) {
  const std::size_t best = best_of(all, 0, all.size());
  if (best == all.size()) throw ArgumentError(all.empty() ? "no candidate" : all.front().why);
  return best;
}

}  // namespace bevel::diagnosis
