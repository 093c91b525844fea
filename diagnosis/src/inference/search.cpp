// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/search.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>

#include <bevel/diagnosis/inference/calibrate.hpp>
#include <bevel/diagnosis/inference/error_spread.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/parallel.hpp>
#include <bevel/error.hpp>

namespace bevel::inference {
namespace {

constexpr double kSameMode = 0.1;  // log evidence

// So near that what is promised beside one is not far from what is beside the other.
bool near(const Noise& a, const Noise& b) {
  constexpr double kShare = 0.1, kCorrelation = 0.05;
  for (std::size_t c = 0; c < a.sigma.size(); ++c)
    if (std::abs(std::log(a.sigma[c] / b.sigma[c])) > kShare) return false;
  return std::abs(a.ar1 - b.ar1) < kCorrelation && (a.tails.degrees > 0) == (b.tails.degrees > 0);
}

}  // namespace

using Eigen::VectorXd;

Search::Search(const System& system, const SearchRules& rules) : system_(system), rules_(rules) {
  std::set<std::string> names;
  for (const Effect& effect : system.effects()) names.insert(effect.name);
  curve_rules_ = {
      .log_prior_odds = rules.log_prior_odds_effect + std::log(std::max(1.0, static_cast<double>(names.size()))),
      .log_prior_odds_more = rules.log_prior_odds_effect,
      .most = rules.most_curves,
      .optimism = rules.optimism};
}

double Visited::log_posterior() const {
  const double both[] = {log_without_curve, log_with_curve};
  return log_sum(both);
}

bool Visited::is_likelier_with_curve() const { return at->fit_with_curve && log_with_curve > log_without_curve; }

const Fit& Visited::likelier_fit() const { return is_likelier_with_curve() ? *at->fit_with_curve : at->fit; }

double Search::log_prior(const ModelSet& set) const {
  double sum = 0;
  for (const std::size_t e : set) sum += log_prior_odds(e);
  return sum;
}

double Search::log_prior_odds(std::size_t effect) const {
  const auto& all = system_.effects();
  const auto kinds = std::ranges::count(all, all[effect].name, &Effect::name);
  return rules_.log_prior_odds_effect - std::log(static_cast<double>(kinds));
}

const Visited& Search::best() const {
  return std::max_element(
             visited_.begin(), visited_.end(),
             [](const auto& a, const auto& b) { return a.second.log_posterior() < b.second.log_posterior(); })
      ->second;
}

double Search::log_not_visited() const {
  const double least = best_log() - rules_.window;
  std::vector<double> logs;
  double attained = 1, fitted = 1;
  for (const auto& [set, predicted] : promised_) {
    const auto at = visited_.find(set);
    if (at == visited_.end()) {
      logs.push_back(predicted.log_posterior);
    } else if (predicted.log_posterior > least) {
      attained += std::min(1.0, std::exp(at->second.log_posterior() - predicted.log_posterior));
      fitted += 1;
    }
  }
  return log_sum(logs) + std::log(attained / fitted);
}

double Search::share_not_visited() const {
  std::vector<double> logs{log_not_visited()};
  for (const auto& [set, one] : visited_) logs.push_back(one.log_posterior());
  return std::exp(logs.front() - log_sum(logs));
}

Visited Search::weighed(const ModelSet& set, double log_prior, const std::shared_ptr<const Evaluated>& at) const {
  Visited one{.set = set, .at = at};
  const double odds = curve_rules_.log_prior_odds;
  double share = 1;  // of no curve, against any number
  for (std::size_t n = 0; n < curve_rules_.most; ++n)
    share += std::exp(odds + curve_rules_.log_prior_odds_more * static_cast<double>(n));
  one.log_without_curve = log_prior + at->log_evidence - std::log(share);
  one.log_with_curve = at->with_discrepancy ? one.log_without_curve + odds + at->log_bayes_factor_curve
                                            : -std::numeric_limits<double>::infinity();
  return one;
}

void Search::keep(const ModelSet& set, const std::shared_ptr<const Evaluated>& at) {
  Visited one = weighed(set, log_prior(set), at);
  const auto known = visited_.find(set);
  // Another local minimum of the same set: the likelier counts.
  if (known == visited_.end() || known->second.log_posterior() <= one.log_posterior())
    visited_.insert_or_assign(set, std::move(one));
}

// Several starts of one set often end in one mode: fitted by the noise that all begin with, they show it, and one of
// them is enough.
void Search::drop_repeated(std::vector<Job>& jobs) const {
  std::map<ModelSet, std::size_t> count;
  for (const Job& job : jobs) ++count[job.set];
  std::vector<double> cost(jobs.size());
  parallel_for(jobs.size(), [&](std::size_t i) {
    Job& job = jobs[i];
    if (count.at(job.set) < 2) return;
    const Fit there =
        fit(*likelihood_, job.layout, job.shared, job.local, {.nuisance_sd = job.nuisance_sd, .curves = {}}, {});
    cost[i] = there.cost;
    if (there.valid) job.shared = there.shared, job.local = there.local;
  });
  std::vector<Job> out;
  std::vector<double> kept;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const Job& job = jobs[i];
    bool repeated = false;
    for (std::size_t k = 0; k < out.size() && count.at(job.set) > 1; ++k)
      if (out[k].set == job.set && out[k].nuisance_sd == job.nuisance_sd &&
          std::abs(kept[k] - cost[i]) < 2 * kSameMode) {  // costs are twice a logarithm
        out[k].beside_curve = out[k].beside_curve || job.beside_curve;
        if (job.promised > out[k].promised) out[k].promised = job.promised, out[k].doubtful = job.doubtful;
        if (!out[k].large_curve) out[k].large_curve = job.large_curve;
        repeated = true;
      }
    if (!repeated) out.push_back(job), kept.push_back(cost[i]);
  }
  jobs = std::move(out);
}

std::vector<std::shared_ptr<Evaluated>> Search::evaluate_without_curve(std::span<const Job> jobs,
                                                                       double give_up_below) {
  std::vector<std::shared_ptr<Evaluated>> out(jobs.size());
  parallel_for(jobs.size(), [&](std::size_t i) {
    const Job& job = jobs[i];
    out[i] = std::make_shared<Evaluated>(
        evaluate(*likelihood_, job.layout, job.shared, job.local, job.nuisance_sd, give_up_below - log_prior(job.set)));
  });
  for (std::size_t i = 0; i < jobs.size(); ++i)
    if (out[i]->valid) keep(jobs[i].set, out[i]);
  return out;
}

void Search::evaluate_all(std::vector<Job> jobs) {
  drop_repeated(jobs);
  // The most promising first: what is found with them decides which of the others still come near, and whether what
  // was promised of them holds.
  std::ranges::stable_sort(jobs, std::greater{}, &Job::promised);
  Modes asked;
  while (!jobs.empty()) {
    const double best = best_log();
    const bool over = is_round_over();
    // Once the steps are spent, what the linear model says to be the likeliest, without a doubt.
    const auto is_near = [&](const Job& job) {
      return is_out_of_steps() ? job.promised - job.doubtful >= best : job.promised >= best - rules_.window;
    };
    std::erase_if(jobs, [&](const Job& job) {
      if (!std::isfinite(job.promised) || (!over && (job.foremost || is_near(job)))) return false;
      const auto known = left_.find(job.set);
      if (!over && (known == left_.end() || known->second.promised < job.promised))
        left_.insert_or_assign(job.set, job);
      return true;
    });
    const std::size_t count = std::min(jobs.size(), rules_.at_once);
    evaluate_with_curve(std::span(jobs).first(count), asked);
    jobs.erase(jobs.begin(), jobs.begin() + static_cast<std::ptrdiff_t>(count));
  }
}

void Search::evaluate_with_curve(std::span<const Job> jobs, Modes& asked) {
  const auto results = evaluate_without_curve(jobs, hopeless_below());
  // What was promised beside a curve is asked for one only while that is near to what has been found since, and those
  // that end in one mode once, the likeliest of them.
  const double likeliest = best_log();
  const auto asks = [&](std::size_t i) {
    return results[i]->valid && ((jobs[i].beside_curve && jobs[i].promised > likeliest - rules_.window) ||
                                 log_prior(jobs[i].set) + results[i]->log_evidence > likeliest - rules_.curve_window);
  };
  std::vector<std::size_t> order(jobs.size()), now;
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) {
    return results[i]->valid ? results[i]->log_evidence : -std::numeric_limits<double>::infinity();
  });
  for (const std::size_t i : order) {
    const auto same = [&](const auto& mode) {
      return mode.first == jobs[i].set && std::abs(mode.second - results[i]->log_evidence) < kSameMode;
    };
    if (!asks(i) || std::ranges::any_of(asked, same)) continue;
    asked.emplace_back(jobs[i].set, results[i]->log_evidence);
    now.push_back(i);
  }
  std::vector<std::shared_ptr<Evaluated>> with(now.size());
  parallel_for(now.size(), [&](std::size_t k) {
    const Job& job = jobs[now[k]];
    with[k] = std::make_shared<Evaluated>(*results[now[k]]);
    add_discrepancy(*likelihood_, *discrepancy_, curve_rules_, *with[k],
                    {.large_curve = job.large_curve.get(),
                     .hopeless_below = hopeless_with_curve(job.set),
                     .promised_with_several = job.beside_several && std::isfinite(job.promised)});
  });
  for (std::size_t k = 0; k < now.size(); ++k) keep(jobs[now[k]].set, with[k]);
}

Marginal Search::base_marginal() const { return {*likelihood_, visited_.at({}).at->fit, {}}; }

double Search::best_log() const { return visited_.empty() ? 0 : best().log_posterior(); }

void Search::run(const Readings& outliers, const Noise& noise, const Progress& progress) {
  progress_ = progress;
  Crew crew(rules_.threads);
  const Fit tempered = tempered_base(system_, outliers, noise);
  Start start{.shared = tempered.shared, .local = tempered.local, .nuisance_sd = middle_nuisance_sd(system_)};
  look_in_rounds(std::make_shared<const Likelihood>(system_, outliers, noise), start, {});
  nothing_is_hopeless_ = visited_.at({}).log_posterior() < hopeless_below() - rules_.curve_window;
  const bool heavy = look_for_heavy_tails();
  tails_known_ = true;
  if (heavy) {
    std::vector<Job> jobs;
    const double best = best_log();
    for (const auto& [set, one] : visited_) {
      if (set.empty() || one.log_posterior() < best - rules_.curve_window) continue;
      jobs.push_back(job_at(one.likelier_fit()));
      ask_for_curve_of(one.likelier_fit(), heavy_, jobs.back());
    }
    visited_.clear();
    look_in_rounds(heavy_, start, std::move(jobs));
  }
  last_round_ = true;
  look_at_what_is_left();
  fit_what_was_left();
}

std::shared_ptr<const Likelihood> Search::with_heavy_tails(const Fit& fit) const {
  const CurveColumns curve = discrepancy_->columns(*fit.likelihood, fit);
  const NoiseBeside noise = tails_beside(fit, curve);
  if (noise.noise.tails.degrees == 0) return nullptr;
  return std::make_shared<const Likelihood>(*fit.likelihood, noise.noise, std::vector<VectorXd>{}, noise.precision);
}

bool Search::look_for_heavy_tails() {
  if (!heavy_ && asked_for_tails_ != best().at) {
    asked_for_tails_ = best().at;
    heavy_ = with_heavy_tails(likeliest_fit());
  }
  return heavy_ != nullptr;
}

// By the noise of a reference and its innovations' precision, at first; known: sets to be weighed before any is sought.
void Search::look_in_rounds(std::shared_ptr<const Likelihood> reference, Start& start, std::vector<Job> known) {
  const Layout nothing(system_, {});
  bool anew = known.empty();
  for (std::size_t round = 0; round < rules_.rounds; ++round) {
    last_round_ = round + 1 == rules_.rounds;
    likelihood_ = reference;
    Evaluated base = evaluate(*likelihood_, nothing, start.shared, start.local, start.nuisance_sd);
    if (!base.valid) throw DomainError("the model cannot follow the recordings");
    discrepancy_ = std::make_unique<const Discrepancy>(*likelihood_, base.fit);
    proposals_ = nullptr;
    keep({}, std::make_shared<const Evaluated>(base));
    if (!known.empty()) evaluate_all(std::move(known));
    known.clear();
    // What is far too much for a curve need not be taken up by one first.
    if (anew) {
      look_at_foremost_effects();
      nothing_is_hopeless_ = is_nothing_hopeless_with_a_curve();
    }
    if (!nothing_is_hopeless_ && (!visited_.at({}).at->with_discrepancy || !is_hopeless({}))) {
      add_discrepancy(*likelihood_, *discrepancy_, curve_rules_, base, {.hopeless_below = hopeless_with_curve({})});
      keep({}, std::make_shared<const Evaluated>(base));
      if (!is_hopeless({})) add_large_curves(*likelihood_, *discrepancy_, curve_rules_, base);
    }
    start = {.shared = base.fit.shared, .local = base.fit.local, .nuisance_sd = base.fit.scales.nuisance_sd};
    const Fit about = anew && best().set.empty() ? base.fit : likeliest_fit();
    const Noise& beside = likeliest_fit().likelihood->noise();
    if (anew && !(best().set.empty() && near(beside, likelihood_->noise()))) {
      // An effect or a curve takes up most of what is missing: the noise beside it is nearer to the truth.
      likelihood_ = reference = without_inputs(*likeliest_fit().likelihood);
      discrepancy_ = std::make_unique<const Discrepancy>(*likelihood_, base.fit);
      proposals_ = nullptr;
    }
    anew = false;
    if (!proposals_) proposals_ = std::make_unique<const Proposals>(*likelihood_, about);
    keep({}, std::make_shared<const Evaluated>(base));
    expanded_.clear();
    promised_.clear();
    left_.clear();
    refitted_.clear();
    swapped_.clear();
    look_around();
    if (!tails_known_ && heavy_) break;
    const Fit& likeliest = likeliest_fit();
    if (near(likeliest.likelihood->noise(), reference->noise()) && likeliest.layout.set() == about.layout.set()) break;
    reference = without_inputs(*likeliest.likelihood);
  }
}

const ModelSet* next_to_expand(const std::map<ModelSet, Visited>& visited, const std::set<ModelSet>& expanded,
                               double window) {
  const ModelSet* top = nullptr;
  double best = -std::numeric_limits<double>::infinity(), best_without = best;
  for (const auto& [set, one] : visited) {
    if (one.log_posterior() > best) best = one.log_posterior(), top = &set;
    best_without = std::max(best_without, one.log_without_curve);
  }
  if (!top || !expanded.contains(*top)) return top;
  const ModelSet* next = nullptr;
  double least_below = std::numeric_limits<double>::infinity();
  for (const auto& [set, one] : visited) {
    if (expanded.contains(set)) continue;
    const bool subset = set.size() + 1 == top->size() && std::ranges::includes(*top, set);
    const double below = subset ? 0 : std::min(best - one.log_posterior(), best_without - one.log_without_curve);
    if (below <= window && below < least_below) next = &set, least_below = below;
  }
  return next;
}

double Search::hopeless_below() const { return best_log() - rules_.window - rules_.doubt; }

double Search::hopeless_with_curve(const ModelSet& set) const {
  return hopeless_below() - log_prior(set) - curve_rules_.log_prior_odds;
}

bool Search::is_hopeless(const ModelSet& set) const { return visited_.at(set).log_posterior() < hopeless_below(); }

bool Search::is_round_over() const {
  return !last_round_ && !near(likeliest_fit().likelihood->noise(), likelihood_->noise());
}

void Search::look_around() {
  expand({});
  if (is_round_over()) return;
  // Pairs of which neither by itself comes near.
  std::vector<Job> jobs;
  std::map<std::size_t, std::vector<Proposal>> known;  // beside one effect
  for (const auto& [promise, set] : proposals_->pairs(base_marginal(), rules_.pairs)) {
    if (is_visited(set)) continue;
    const std::size_t first = is_visited({set[0]}) ? set[0] : set[1], second = set[0] + set[1] - first;
    const auto single = visited_.find({first});
    if (single == visited_.end()) continue;
    if (!known.contains(first)) {
      const auto own = with_inputs_of(single->second.at->fit, likelihood_);
      known[first] = proposals_->beside(Marginal(*own, single->second.at->fit, {}, likelihood_.get()), 1);
    }
    for (const Proposal& one : known[first])
      if (one.effect == second && !one.starts.empty())
        jobs.push_back(job_from(single->second.at->fit, second, one.starts.front()));
  }
  evaluate_all(std::move(jobs));
  look_at_what_is_left();
}

void Search::look_at_what_is_left() {
  while (!is_round_over()) {
    // No answer is given that was not looked around, however much that takes.
    const ModelSet* next = is_out_of_steps() ? &best().set : next_to_expand(visited_, expanded_, rules_.window);
    if (!next || expanded_.contains(*next)) break;
    const ModelSet set = *next;
    const auto at = visited_.at(set).at;
    if (!at->with_discrepancy) {
      auto with = std::make_shared<Evaluated>(*at);
      add_discrepancy(*likelihood_, *discrepancy_, curve_rules_, *with, {.hopeless_below = hopeless_with_curve(set)});
      keep(set, with);
    }
    expand(set);
    // All that comes near is looked at once more by such a noise: now that the likeliest has been looked around.
    if (!tails_known_ && expanded_.contains(best().set) && look_for_heavy_tails()) break;
  }
}

void Search::fit_what_was_left() {
  const long until = likelihood_->steps() + rules_.further_steps;
  Modes asked;
  while (share_not_visited() > rules_.most_not_fitted && likelihood_->steps() < until) {
    std::vector<Job> jobs;
    for (const auto& [set, job] : left_)
      if (!is_visited(set)) jobs.push_back(job);
    std::ranges::stable_sort(jobs, std::greater{}, [](const Job& job) { return job.promised - job.doubtful; });
    if (jobs.empty()) break;
    if (progress_) progress_(describe(system_, jobs.front().set) + ", which was left for want of steps");
    for (const Job& job : jobs) left_.erase(job.set);
    const std::size_t count = std::min(jobs.size(), rules_.at_once);
    evaluate_with_curve(std::span(jobs).first(count), asked);
    for (Job& job : std::span(jobs).subspan(count)) left_.emplace(job.set, std::move(job));
  }
}

}  // namespace bevel::inference
