// SPDX-License-Identifier: MIT
#include "mismatch/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include <bevel/diagnosis/inference/prediction_noise.hpp>
#include <bevel/diagnosis/parallel.hpp>
#include "mismatch/prediction_sums.hpp"

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::VectorXd;
using inference::Fit;
using inference::Likelihood;

namespace {

double constant_of(double count) { return -0.5 * count * std::log(2 * std::numbers::pi); }

void add_errors(const NeedleSystem& system, const Likelihood& likelihood, std::size_t r, const VectorXd& errors,
                Sums& sums) {
  sums.count = static_cast<double>(errors.size());
  const auto by_channel = inference::by_channel(likelihood.data().recordings[r], errors);
  for (std::size_t c = 0; c < by_channel.size(); ++c) {
    if (system.recorded().channels[c].heading || by_channel[c].size() == 0) continue;
    sums.squares += by_channel[c].squaredNorm();
    sums.largest = std::max(sums.largest, by_channel[c].cwiseAbs().maxCoeff());
    sums.positions += static_cast<double>(by_channel[c].size());
  }
}

// As a new insertion: what differs between insertions at its mean. Phases and instants are the recording's own: nobody
// predicts them.
Fit new_insertion(Fit fit, std::size_t r) {
  for (std::size_t i = 0; i < fit.layout.local().size(); ++i)
    if (!fit.layout.is_scanned(i)) fit.local[r][static_cast<Index>(i)] = 0;
  return fit;
}

// Of the readings that are left, the precisions that they have in another likelihood (Series::precision).
inference::ByReading precision_of_left(const Likelihood& all, const Likelihood& some) {
  inference::ByReading out(some.recordings());
  for (std::size_t r = 0; r < out.size(); ++r)
    for (std::size_t c = 0; c < some.data().recordings[r].series.size(); ++c) {
      const auto &known = all.data().recordings[r].series[c], &left = some.data().recordings[r].series[c];
      if (known.precision.empty()) return {};
      out[r].emplace_back();
      std::size_t at = 0;  // in the same order
      for (const std::size_t message : left.message) {
        while (known.message[at] != message) ++at;
        out[r].back().push_back(known.precision[at]);
      }
    }
  return out;
}

// Of what each recording has of its own, without one recording's part.
std::shared_ptr<const inference::OwnVolume> own_volume_without(const Fit& fit, std::size_t r) {
  if (!fit.own_volume) return nullptr;
  inference::OwnVolume out = *fit.own_volume;
  out.slope[r].setZero();
  return std::make_shared<const inference::OwnVolume>(std::move(out));
}

// Refitted without the recording's readings after until_s: where much is missing, or hardly known, the linear model
// about all of them says little of it.
Fit refit_without(const inference::Search& search, const Fit& whole, const Fit& start, std::size_t r, double until_s) {
  const Likelihood& all = *whole.likelihood;
  inference::Readings without = all.outliers();
  std::set<std::size_t> gone(without[r].begin(), without[r].end());
  for (const auto& series : all.data().recordings[r].series)
    for (std::size_t i = 0; i < series.message.size(); ++i)
      if (series.time_s[i] > until_s) gone.insert(series.message[i]);
  without[r].assign(gone.begin(), gone.end());
  const Likelihood left(all.system(), without, all.noise());
  const Likelihood some(left, all.noise(), inputs_about(whole), precision_of_left(all, left));
  const auto curve = search.discrepancy().columns(some, whole);
  Fit out = inference::fit(some, whole.layout, start.shared, start.local, whole.scales, curve,
                           {.own_volume = own_volume_without(whole, r)});
  if (!out.valid) out = start;
  return out;
}
Fit refit_without(const inference::Search& search, const Fit& whole, std::size_t r) {
  Fit out = refit_without(search, whole, whole, r, -std::numeric_limits<double>::infinity());
  out.local[r] = whole.local[r];
  return out;
}

// Which innovations will be large nobody knows beforehand: predictions are by normal noise of the same deviation, once
// for each fit.
class NormalNoise {
 public:
  explicit NormalNoise(const std::set<const Fit*>& fits) {
    for (const Fit* fit : fits) known_[fit] = made(*fit);
  }
  const std::shared_ptr<const Likelihood>& of(const Fit& fit) const { return known_.at(&fit); }

 private:
  static std::shared_ptr<const Likelihood> made(const Fit& fit) {
    inference::Noise noise = fit.likelihood->noise();
    if (noise.tails.degrees == 0) return fit.likelihood;
    noise.tails = {}, noise.tails_are_open = false;
    return std::make_shared<const Likelihood>(*fit.likelihood, noise, inputs_about(fit), inference::ByReading{});
  }
  std::map<const Fit*, std::shared_ptr<const Likelihood>> known_;
};

// Log density by normal noise less that by the fit's own.
double normal_beyond(const inference::Search& search, Fit fit, const Fit& judge, std::size_t r, double log_density) {
  if (judge.likelihood->noise().tails.degrees == 0) return 0;
  fit.likelihood = judge.likelihood;
  fit.scales.nuisance_sd = judge.scales.nuisance_sd;
  const auto curve = curve_of(search, fit);
  const auto blocks = linearise(*fit.likelihood, fit, curve);
  const auto own = blocks.empty() ? std::nullopt : predictive_of(fit, blocks, curve, r);
  return own ? log_density - own->log_density : std::numeric_limits<double>::quiet_NaN();
}

// refitted: without the recording; judge: by whose noise and variation chi2 and density are.
Sums sums_of(const NeedleSystem& system, const inference::Search& search, const NormalNoise& normal, Fit fit,
             const Fit& judge, std::size_t r) {
  Sums out;
  fit.likelihood = normal.of(judge);
  fit.scales.nuisance_sd = judge.scales.nuisance_sd;
  const auto curve = curve_of(search, fit);
  const VectorXd errors =
      fit.likelihood->errors(fit.layout, r, fit.shared, new_insertion(fit, r).local[r], curve, fit.curve_values);
  const auto blocks = linearise(*fit.likelihood, fit, curve);
  if (errors.size() == 0 || blocks.empty()) return not_predicted();
  add_errors(system, *fit.likelihood, r, errors, out);
  const auto predictive = predictive_of(fit, blocks, curve, r);
  out.chi2 = predictive ? predictive->chi2 : kNone;
  out.log_density = predictive ? predictive->log_density + constant_of(out.count) : kNone;
  return out;
}

// How insertions differ about a mean of their own, and the noise beside that.
struct Varied {
  std::shared_ptr<const Likelihood> likelihood;
  inference::NuisanceGrid spreads;
};

double log_weights_without(const Likelihood& likelihood, std::size_t r) {
  return likelihood.log_weights() - likelihood.log_weights(r);
}

// By the noise and the variation of the model itself, as it would be used. whole: the fit of all recordings, others:
// without this one; varied: null: about zero, by the noise of the fit.
std::optional<inference::Forecasts> forecast_of(const inference::Search& search, const NormalNoise& normal,
                                                const Fit& whole, Fit others, const Varied* varied, std::size_t r) {
  constexpr double kKnown = 1.0 / 3;
  const double until_s = inference::time_of_share(whole.likelihood->data().recordings[r], kKnown);
  Fit begun = refit_without(search, whole, new_insertion(others, r), r, until_s);
  const auto& likelihood = normal.of(whole);
  others.likelihood = likelihood;
  auto curve = curve_of(search, others);
  const auto spreads = likely_part(nuisance_grid(search.system()), nuisance_weights_of(search, whole));
  inference::LinearModel before{&others, linearise(*others.likelihood, others, curve)};
  if (before.blocks.empty()) return std::nullopt;
  double about_zero = 0;
  if (varied) {
    about_zero = log_evidence_of_others(before, curve, spreads, r) + log_weights_without(*likelihood, r);
    others.likelihood = varied->likelihood;
    curve = curve_of(search, others);
    before.blocks = linearise(*others.likelihood, others, curve);
  }
  begun.likelihood = others.likelihood;
  inference::LinearModel beside{&begun, linearise(*begun.likelihood, begun, curve)};
  if (before.blocks.empty() || beside.blocks.empty()) return std::nullopt;
  if (!varied) return inference::forecast(std::move(before), std::move(beside), curve, spreads, r, until_s);
  auto out = inference::forecast(with_mean(std::move(before), r), with_mean(std::move(beside), r), curve,
                                 varied->spreads, r, until_s);
  // By so much more are the others' readings likely.
  if (out) out->log_others += log_weights_without(*varied->likelihood, r) - about_zero;
  return out;
}

std::optional<Varied> varied_about(const inference::Search& search, const NormalNoise& normal, const Fit& whole) {
  Fit fit = whole;
  fit.likelihood = normal.of(whole);
  auto curve = curve_of(search, fit);
  auto blocks = linearise(*fit.likelihood, fit, curve);
  if (blocks.empty()) return std::nullopt;
  const std::size_t none = blocks.size();
  const auto noise = inference::prediction_noise(inference::with_mean({&fit, std::move(blocks)}, none), curve);
  Varied out{.likelihood = std::make_shared<const Likelihood>(*fit.likelihood, noise, inputs_about(fit)),
             .spreads = {}};
  fit.likelihood = out.likelihood;
  curve = curve_of(search, fit);
  blocks = linearise(*fit.likelihood, fit, curve);
  if (blocks.empty()) return std::nullopt;
  const auto grid = nuisance_grid(search.system());
  out.spreads = likely_part(grid, spread_weights(inference::with_mean({&fit, std::move(blocks)}, none), curve, grid));
  return out;
}

// By the model file as it is: nothing is refitted, and it knows of no variation.
Sums as_it_stands(const NeedleSystem& system, const Likelihood& likelihood, std::size_t r) {
  Sums out;
  const inference::Layout nothing(system, {});
  const VectorXd shared = nothing.shared_start(), local = nothing.local_start();
  inference::Residuals residuals;
  if (!likelihood.evaluate(nothing, r, shared, local, false, residuals)) {
    return not_predicted();
  }
  add_errors(system, likelihood, r, likelihood.errors(nothing, r, shared, local), out);
  out.chi2 = residuals.white.squaredNorm();
  out.log_density = constant_of(out.count) + likelihood.log_weights(r) - 0.5 * out.chi2;
  return out;
}

// Of errors that are the noise and nothing else, in the mean.
Sums noise_floor(const NeedleSystem& system, const Likelihood& likelihood, std::size_t r) {
  Sums out;
  const auto& series = likelihood.data().recordings[r].series;
  for (std::size_t c = 0; c < series.size(); ++c)
    for (const double relative : series[c].relative_sd) {
      ++out.count;
      if (system.recorded().channels[c].heading) continue;
      out.squares += std::pow(likelihood.noise().sigma[c] * relative, 2);
      ++out.positions;
    }
  out.chi2 = out.count;
  out.log_density = constant_of(out.count) + likelihood.log_weights(r) - 0.5 * out.count;
  return out;
}

// One recording, predicted from the others.
struct LeftOutRecording {
  Sums file, before, after, floor;
  std::optional<inference::Forecasts> predicted_before, predicted_after;
};

using VariedOfFit = std::map<const Fit*, std::optional<Varied>>;

LeftOutRecording leave_out(const NeedleSystem& system, const inference::Search& search, const NormalNoise& normal,
                           const VariedOfFit& varied, const inference::LeftOutSelection& selected, const Fit& judge,
                           std::size_t r) {
  LeftOutRecording out;
  const Likelihood& likelihood = *normal.of(judge);
  const Fit &base = search.visited().at({}).at->fit, &found = *selected.fit;
  const Fit alone_refitted = refit_without(search, base, r), found_refitted = refit_without(search, found, r);
  out.file = as_it_stands(system, likelihood, r);
  out.before = sums_of(system, search, normal, alone_refitted, judge, r);
  out.after = sums_of(system, search, normal, found_refitted, found, r);
  const double constant = constant_of(out.after.count);
  out.after.log_density = selected.log_density + constant +
                          normal_beyond(search, found_refitted, found, r, out.after.log_density - constant);
  out.floor = noise_floor(system, likelihood, r);
  if (auto forecast = forecast_of(search, normal, base, alone_refitted, nullptr, r))
    out.predicted_before = inference::averaged({std::move(*forecast)}, {1});
  std::vector<inference::Forecasts> models;
  std::vector<double> probabilities;
  for (const auto& share : selected.shares) {
    const auto& about = varied.at(share.fit);
    if (!about) continue;
    const Fit refitted = share.fit == &found ? found_refitted : refit_without(search, *share.fit, r);
    if (auto forecast = forecast_of(search, normal, *share.fit, refitted, &*about, r)) {
      probabilities.push_back(std::log(share.probability) + forecast->log_others);
      models.push_back(std::move(*forecast));
    }
  }
  if (models.empty()) return out;
  const double most = std::ranges::max(probabilities);
  for (double& weight : probabilities) weight = std::exp(weight - most);
  out.predicted_after = inference::averaged(models, probabilities);
  return out;
}

}  // namespace

HeldOut hold_out(const NeedleSystem& system, const inference::Search& search, const Fit& judge) {
  const auto selected = leave_out_selection(search);
  std::set<const Fit*> fits = {&judge, &search.visited().at({}).at->fit};
  VariedOfFit varied;
  for (const auto& one : selected) {
    fits.insert(one.fit);
    for (const auto& share : one.shares) fits.insert(share.fit), varied[share.fit];
  }
  const NormalNoise normal(fits);
  for (auto& [fit, about] : varied) about = varied_about(search, normal, *fit);
  std::vector<std::size_t> asked;
  for (std::size_t r = 0; r < selected.size(); ++r)
    if (!system.recorded().two_groups() || system.recorded().recordings[r].changed) asked.push_back(r);
  std::vector<LeftOutRecording> all(asked.size());
  parallel_for(asked.size(), [&](std::size_t i) {
    all[i] = leave_out(system, search, normal, varied, selected[asked[i]], judge, asked[i]);
  });
  HeldOut out;
  std::vector<Sums> file, before, after, floor;
  InsertionSums predicted_before(system), predicted_after(system);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const LeftOutRecording& one = all[i];
    file.push_back(one.file), before.push_back(one.before), after.push_back(one.after), floor.push_back(one.floor);
    const auto noted = [&](const std::optional<inference::Forecasts>& predicted, InsertionSums& sums) {
      InsertionSums own(system);
      if (predicted) {
        const auto& rows = normal.of(judge)->data().recordings[asked[i]];
        own.add(rows, *predicted);
        sums.add(rows, *predicted);
      }
      return own.figures();
    };
    out.recordings.push_back({.log = system.recorded().recordings[asked[i]].name,
                              .before = figures_of({one.before}),
                              .after = figures_of({one.after}),
                              .predicted_before = noted(one.predicted_before, predicted_before),
                              .predicted_after = noted(one.predicted_after, predicted_after)});
    out.gain += one.after.log_density - one.before.log_density;
  }
  out.as_it_stands = figures_of(file);
  out.before = figures_of(before);
  out.after = figures_of(after);
  out.noise_floor = figures_of(floor);
  out.predicted_before = predicted_before.figures();
  out.predicted_after = predicted_after.figures();
  return out;
}

}  // namespace bevel::diagnosis
