// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <span>

#include <bevel/diagnosis/inference/error_spread.hpp>
#include <bevel/diagnosis/inference/local_minima.hpp>
#include <bevel/diagnosis/inference/search.hpp>

namespace bevel::inference {

using Eigen::Index;

Search::Job Search::job_at(const Fit& fit) {
  return {.set = fit.layout.set(),
          .layout = fit.layout,
          .shared = fit.shared,
          .local = fit.local,
          .nuisance_sd = fit.scales.nuisance_sd};
}

void Search::ask_for_curve_of(const Fit& fit, Job& job) const {
  // What is left without the curve may pass for noise: that is not where to begin.
  ask_for_curve_of(fit, without_inputs(*fit.likelihood), job);
}

void Search::ask_for_curve_of(const Fit& fit, std::shared_ptr<const Likelihood> by, Job& job) const {
  job.beside_curve = !fit.scales.curves.empty();
  job.beside_several = fit.scales.curves.size() > 1;
  if (!fit.tangent) return;
  Fit from = carried_to(job.layout, fit);
  from.shared = job.shared;
  from.local = job.local;
  from.scales.nuisance_sd = job.nuisance_sd;
  from.likelihood = std::move(by);
  job.large_curve = std::make_shared<const Fit>(std::move(from));
}

Search::Job Search::job_from(const Fit& fit, std::size_t effect, const StartPoint& start) const {
  const Fit beside = start.base_at_prior ? with_base_at_prior(fit) : fit;
  Job job = job_at(carried_to(Layout(system_, with(fit.layout.set(), effect)), beside));
  if (start.beside.size() > 0) job.shared = job.layout.shared_from(fit.layout, start.beside);
  const auto member = static_cast<std::size_t>(std::find(job.set.begin(), job.set.end(), effect) - job.set.begin());
  const auto& parameters = system_.effects()[effect].parameters;
  for (std::size_t r = 0; r < fit.local.size(); ++r) {
    Index shared = 0, local = 0;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      if (parameters[p].scope == Scope::shared) {
        job.shared[job.layout.find_shared(member, p)] = start.shared[shared++];
      } else if (r < start.local.size()) {
        job.local[r][job.layout.find_local(member, p)] = start.local[r][local++];
      }
    }
  }
  return job;
}

bool Search::has_instants(std::size_t effect) const {
  return std::ranges::count(system_.effects()[effect].parameters, Scope::instant, &Parameter::scope) > 0;
}

// The same from recordings that do not differ, and the base where its prior has it: with a spread, what happened at an
// instant in some of them stays what these have of their own.
Search::Job Search::job_from_alike(const Fit& fit, std::size_t effect, StartPoint start) const {
  start.base_at_prior = true;
  Job job = job_from(fit, effect, start);
  job.nuisance_sd.setZero();
  return job;
}

// Beside a fit, with its curve if it has one, and beside the same with less spread.
std::vector<Search::Beside> Search::look_beside(const Fit& fit, double log_here, bool with_others_moved) const {
  const auto by = with_inputs_of(fit, likelihood_);
  // Shared by all that is looked at beside less spread, now or later.
  const auto moved = std::make_shared<const Moved>(moved_to(by, fit, *discrepancy_));
  const std::shared_ptr<const Fit> from(moved, &moved->fit);
  const auto curve = std::make_shared<const CurveColumns>(discrepancy_->columns(*by, *from));
  const Marginal marginal(*by, *from, *curve, likelihood_.get());
  // What is promised is relative to this set by the reference's noise.
  const auto log_promised = [log_here, moved](double log_change) { return log_here + moved->log_gain(log_change); };
  std::vector<Beside> out{{.about = *from,
                           .proposals = proposals_->beside(marginal, rules_.starts),
                           .log_promised = log_promised,
                           .log_reference = log_here}};
  if (with_others_moved)
    proposals_->look_with_others_moved(*likelihood_, *from, marginal, rules_.starts, out.front().proposals);
  const auto beside_less = [this, by, curve, log_promised, log_here](const WithLessSpread& less) {
    return Beside{
        .about = less.fit,
        .proposals = proposals_->beside(Marginal(*by, less.fit, *curve, likelihood_.get()), rules_.starts),
        .log_promised = [=, change = less.log_change](double log_factor) { return log_promised(change + log_factor); },
        .log_reference = log_here};
  };
  for (const WithLessSpread& less : with_less_spread(*by, *from, *curve)) {
    out.push_back(beside_less(less));
    out.back().at_its_mode = [=] { return beside_less(inference::at_its_mode(less, *from, *curve)); };
  }
  return out;
}

// In the place of each curve that a set has: by how much more an effect is worth there than the curve.
std::vector<Search::Beside> Search::look_in_curves_places(const Fit& with_curve, double log_here) const {
  std::vector<Beside> out;
  const auto by = with_inputs_of(with_curve, likelihood_);
  const std::size_t count = with_curve.scales.curves.size();
  for (std::size_t k = 0; k < count; ++k) {
    Fit about = without_curve(*discrepancy_, with_curve, k);
    const Marginal marginal(*by, about, discrepancy_->columns(*by, about), likelihood_.get());
    const double leaves = log_factor_of_one_more(*discrepancy_, marginal, about.scales.curves) +
                          (count == 1 ? curve_rules_.log_prior_odds : curve_rules_.log_prior_odds_more);
    out.push_back({.about = std::move(about),
                   .proposals = proposals_->beside(marginal, rules_.starts),
                   .log_promised = [=](double log_factor) { return log_here - leaves + log_factor; },
                   .log_reference = log_here - leaves});
  }
  return out;
}

double Search::most_promised(const ModelSet& set) const {
  const auto known = promised_.find(set);
  return known == promised_.end() ? -std::numeric_limits<double>::infinity() : known->second.log_posterior;
}

double Search::log_promised(const Beside& beside, const Proposal& one) const {
  return beside.log_promised(one.log_bayes_factor) + log_prior_odds(one.effect);
}

double Search::doubtful(double log_promised) const {
  return rules_.optimism + rules_.linear_error * std::max(0.0, log_promised);
}

// The set with each effect that comes near.
std::vector<Search::Job> Search::larger_sets(const ModelSet& set, const Beside& beside) {
  std::vector<Job> out;
  const double near = best_log() - rules_.window;
  const auto is_new = [&](const Beside& by, const Proposal& one) {
    return log_promised(by, one) >= most_promised(with(set, one.effect)) + rules_.optimism;
  };
  const auto promises_more = [&](const Proposal& one) {
    return log_promised(beside, one) + doubtful(one.log_bayes_factor) >= near && is_new(beside, one);
  };
  const bool again = static_cast<bool>(beside.at_its_mode);
  if (again && std::ranges::none_of(beside.proposals, promises_more)) return out;
  std::optional<Beside> at_mode;
  if (again) at_mode = beside.at_its_mode();
  const Beside& here = again ? *at_mode : beside;
  for (const Proposal& one : here.proposals) {
    const ModelSet larger = with(set, one.effect);
    const double promised = log_promised(here, one);
    const bool nothing_new = again && !is_new(here, one);
    Predicted& predicted = promised_[larger];
    predicted.log_posterior = std::max(predicted.log_posterior, promised);
    double& factor =
        here.about.scales.curves.empty() ? predicted.log_bayes_factor : predicted.log_bayes_factor_with_curve;
    factor = std::max(factor, here.log_promised(one.log_bayes_factor) - here.log_reference);
    if (nothing_new) continue;
    const double doubtful = this->doubtful(one.log_bayes_factor);
    if (promised + doubtful < near) continue;
    // A fit that fell far short of the promise may be in a local minimum: once more, from these starts.
    const auto visited = visited_.find(larger);
    if (visited != visited_.end() &&
        (visited->second.log_posterior() > promised - doubtful || !refitted_.insert(larger).second))
      continue;
    for (const StartPoint& start : one.starts)
      if (start.log_bayes_factor > one.starts.front().log_bayes_factor - rules_.window) {
        const std::size_t first = out.size();
        out.push_back(job_from(here.about, one.effect, start));
        if (has_instants(one.effect)) out.push_back(job_from_alike(here.about, one.effect, start));
        for (Job& job : std::span(out).subspan(first)) {
          job.promised = promised + doubtful;
          job.doubtful = doubtful;
          if (!is_hopeless(set)) ask_for_curve_of(here.about, job);
        }
      }
  }
  return out;
}

// The set without a member, from where the fit is. One that was visited already once more, if from here it is likelier
// even without what it gains by having fewer parameters: then it was in a local minimum. That is of no use where it
// stays far from the likeliest set all the same.
std::optional<Search::Job> Search::smaller_set(const Fit& about, std::size_t member, double log_here,
                                               double log_cost) const {
  const ModelSet& smaller = about.layout.set();
  const double promised = log_here - log_cost - log_prior_odds(member);
  const auto known = visited_.find(smaller);
  if (known != visited_.end()) {
    const bool beside_curve = !about.scales.curves.empty();
    const double log_known = beside_curve ? known->second.log_with_curve : known->second.log_without_curve;
    if (log_known > promised - rules_.optimism) return std::nullopt;
  }
  Job job = job_at(about);
  if (std::isfinite(log_cost)) job.doubtful = doubtful(log_cost), job.promised = promised + job.doubtful;
  job.foremost = known == visited_.end();
  ask_for_curve_of(about, job);
  return job;
}

void Search::expand(const ModelSet& set) {
  expanded_.insert(set);
  const bool hopeless = is_hopeless(set);
  const Visited here = visited_.at(set);
  if (progress_)
    progress_(describe(system_, set) + "; " + std::to_string(likelihood_->steps()) + " steps of fits done, after " +
              std::to_string(rules_.most_steps) + " only around the likeliest");
  std::vector<Job> jobs;
  const auto append = [&](std::vector<Job> more) { std::ranges::move(more, std::back_inserter(jobs)); };
  const auto append_larger = [&](const std::vector<Beside>& looked) {
    for (const Beside& one : looked) append(larger_sets(set, one));
  };
  if (set.size() < rules_.largest) {
    if (here.is_likelier_with_curve()) {
      append_larger(look_beside(*here.at->fit_with_curve, here.log_with_curve, false));
      append_larger(look_in_curves_places(*here.at->fit_with_curve, here.log_with_curve));
    }
    // Without a curve too, from where the set is fitted by itself. What takes up the mean of steps is a member; the
    // base alone has none.
    append_larger(look_beside(here.at->fit, here.log_without_curve, !set.empty()));
  }
  if (!hopeless) {
    if (here.is_likelier_with_curve()) append(sets_without_a_member(*here.at->fit_with_curve, here.log_with_curve));
    append(sets_without_a_member(here.at->fit, here.log_without_curve));
  }
  evaluate_all(std::move(jobs));
}

void Search::look_at_foremost_effects() {
  const Fit base = visited_.at({}).at->fit;
  proposals_ = std::make_unique<const Proposals>(*likelihood_, base);
  const auto list = proposals_->beside(base_marginal(), 1);
  std::vector<Job> jobs;
  for (const Proposal& one : std::span(list).first(std::min(list.size(), rules_.at_once)))
    if (!one.starts.empty()) jobs.push_back(job_from(base, one.effect, one.starts.front()));
  // What recordings took up as their own has no rank by a linear model about that.
  for (const Proposal& one : list)
    if (!one.starts.empty() && has_instants(one.effect))
      jobs.push_back(job_from_alike(base, one.effect, one.starts.front()));
  evaluate_without_curve(jobs, -std::numeric_limits<double>::infinity());
}

bool Search::is_nothing_hopeless_with_a_curve() const {
  const auto curves = discrepancy_->scan(base_marginal());
  const double promised = curves.empty() ? 0 : std::max(0.0, curves.front().log_bayes_factor);
  return visited_.at({}).log_posterior() + kMostOfPromise * promised < hopeless_below();
}

// Each member's place left empty, and taken by another effect.
std::vector<Search::Job> Search::sets_without_a_member(const Fit& fit, double log_here) {
  const ModelSet& set = fit.layout.set();
  const auto own = with_inputs_of(fit, likelihood_);
  const CurveColumns curve = discrepancy_->columns(*own, fit);
  const auto costs = log_costs_of_dropping(fit, discrepancy_->columns(*fit.likelihood, fit));
  std::vector<Job> out;
  for (std::size_t place = 0; place < set.size(); ++place) {
    const Fit about = carried_to(Layout(system_, without(set, set[place])), fit);
    const auto list = proposals_->beside(Marginal(*own, about, curve, likelihood_.get()), rules_.starts);
    const auto leaves = std::ranges::find(list, set[place], &Proposal::effect);
    // What has no size that may be none costs what it would be worth there.
    const bool has_size = std::isfinite(costs[place]) || leaves == list.end();
    if (auto job = smaller_set(about, set[place], log_here, has_size ? costs[place] : leaves->log_bayes_factor))
      out.push_back(*std::move(job));
    if (leaves != list.end()) append_swaps({*own, curve, fit, about, place, list, *leaves}, log_here, out);
  }
  return out;
}

// A member's place taken by another effect, with all else where it is: what two have in common is far from where the
// smaller set alone would be fitted, and what sets them apart is little. Promised is the difference between the two, by
// one linear model.
void Search::append_swaps(const Swapped& from, double log_here, std::vector<Job>& out) {
  const ModelSet& set = from.fit.layout.set();
  const std::size_t member = set[from.place];
  const bool beside_curve = !from.fit.scales.curves.empty();
  const double near = best_log() - rules_.window;
  const auto many = [](const Unknown& u) { return u.parameter != nullptr && has_many_minima(*u.parameter); };
  const bool has_many = std::ranges::any_of(from.about.layout.shared(), many);
  std::size_t rank = 0;
  for (const Proposal& one : from.proposals) {
    if (one.effect == member) continue;
    if (rank++ >= rules_.foremost) break;
    const ModelSet swapped = with(from.about.layout.set(), one.effect);
    const auto visited = visited_.find(swapped);
    if (visited != visited_.end() && visited->second.log_posterior() > near) continue;
    if (one.starts.empty() || !std::isfinite(one.log_bayes_factor) || swapped_.contains({swapped, beside_curve}))
      continue;
    double difference = one.log_bayes_factor - from.leaves.log_bayes_factor;
    double doubt = doubtful(from.leaves.log_bayes_factor);
    // Where the rest has many local minima the linear model about none of the two says nothing of either.
    std::optional<Fit> there;
    if (has_many && system_.allows(with(set, one.effect))) {
      there = replaced(from.own, from.curve, from.fit, from.place, one.effect, one.starts.front().shared);
      if (there->valid)
        difference = 0.5 * (cost_at(from.own, from.fit, from.curve) - there->cost), doubt = rules_.optimism;
    }
    const double promised = log_here + difference + log_prior_odds(one.effect) - log_prior_odds(member) + doubt;
    if (promised < near) continue;
    swapped_.insert({swapped, beside_curve});
    Job job = job_from(from.about, one.effect, one.starts.front());
    job.promised = promised;
    job.doubtful = doubt;
    if (there && there->valid) job.shared = there->shared, job.local = there->local;
    ask_for_curve_of(from.about, job);
    out.push_back(std::move(job));
  }
}

}  // namespace bevel::inference
