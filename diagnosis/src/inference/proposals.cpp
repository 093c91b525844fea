// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/proposals.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/diagnosis/inference/local_minima.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

namespace {

constexpr double kFarthest = 4.0;  // sizes promised reach to so many times their start
constexpr double kSmall = 0.1;     // of a start
// Log Bayes factor of a start at which the effect cannot be evaluated: zero probability.
constexpr double kNever = -std::numeric_limits<double>::infinity();

// Every combination of starts of the shared parameters; with one shape only, a small size too: what an effect does to
// the readings is not in proportion to its size beside another that comes in jumps.
std::vector<VectorXd> starts_of(const Effect& effect) {
  std::vector<std::vector<double>> all = {{}};
  for (const Parameter& p : effect.parameters) {
    const std::vector<double> values = p.scope == Scope::shared ? p.starts : std::vector<double>{0.0};
    std::vector<std::vector<double>> longer;
    for (const auto& head : all)
      for (const double value : values) {
        longer.push_back(head);
        longer.back().push_back(value);
      }
    all = std::move(longer);
  }
  std::vector<VectorXd> out;
  for (const auto& one : all) out.push_back(Eigen::Map<const VectorXd>(one.data(), static_cast<Index>(one.size())));
  if (out.size() == 1) {
    VectorXd small = out.front();
    for (std::size_t p = 0; p < effect.parameters.size(); ++p)
      if (const Parameter& one = effect.parameters[p]; one.scope == Scope::shared && is_size(one))
        small[static_cast<Index>(p)] = one.none + kSmall * (small[static_cast<Index>(p)] - one.none);
    out.push_back(small);
  }
  return out;
}

// Sizes as shares of the start, back to parameters; false for one beyond a bound at which the effect vanishes.
bool apply_shares(const Effect& effect, const std::vector<std::size_t>& amplitudes, const VectorXd& shares,
                  VectorXd& values) {
  for (std::size_t a = 0; a < amplitudes.size(); ++a) {
    const Parameter& p = effect.parameters[amplitudes[a]];
    double& value = values[static_cast<Index>(amplitudes[a])];
    const double share = std::clamp(shares[static_cast<Index>(a)], -kFarthest, kFarthest);
    const double there = p.none + share * (value - p.none);
    if (p.none <= p.lower && there <= p.lower) return false;
    value = std::clamp(there, p.lower, p.upper);
  }
  return true;
}

VectorXd shared_part(const Effect& effect, const VectorXd& values) {
  std::vector<double> out;
  for (std::size_t p = 0; p < effect.parameters.size(); ++p)
    if (effect.parameters[p].scope == Scope::shared) out.push_back(values[static_cast<Index>(p)]);
  return Eigen::Map<const VectorXd>(out.data(), static_cast<Index>(out.size()));
}

void keep_best(std::vector<StartPoint>& starts, std::size_t count) {
  std::stable_sort(starts.begin(), starts.end(),
                   [](const auto& a, const auto& b) { return a.log_bayes_factor > b.log_bayes_factor; });
  if (starts.size() > count) starts.resize(count);
}

bool is_normal_of_base(const Unknown& unknown) {
  return unknown.member < 0 && unknown.parameter->prior.form == Prior::Form::normal;
}

// The fits from which an effect is looked at: this one, and, where what is missing drove the base a standard deviation
// from its prior, the same with the base where the prior has it. What an effect does may be in proportion to the base's
// own parameters, and these may have been fitted away.
std::vector<Fit> views_of(const Fit& about) {
  std::vector<Fit> out{about};
  bool far = false;
  for (std::size_t i = 0; i < about.layout.shared().size(); ++i) {
    const Unknown& unknown = about.layout.shared()[i];
    if (!is_normal_of_base(unknown)) continue;
    const Prior& prior = unknown.parameter->prior;
    far = far || std::abs(about.shared[static_cast<Index>(i)] - prior.middle) * std::sqrt(precision_of(prior)) > 1;
  }
  if (far) {
    out.push_back(with_base_at_prior(about));
  }
  return out;
}

}  // namespace

std::pair<VectorXd, VectorXd> unknowns_with(const Layout& layout, const Layout& from, const VectorXd& from_shared,
                                            const VectorXd& from_local, std::size_t effect, const VectorXd& values) {
  VectorXd shared = layout.shared_from(from, from_shared);
  VectorXd local = layout.local_from(from, from_local);
  const auto member =
      static_cast<std::size_t>(std::find(layout.set().begin(), layout.set().end(), effect) - layout.set().begin());
  for (Index p = 0; p < values.size(); ++p) {
    if (const int i = layout.find_shared(member, static_cast<std::size_t>(p)); i >= 0) shared[i] = values[p];
    if (const int i = layout.find_local(member, static_cast<std::size_t>(p)); i >= 0) local[i] = values[p];
  }
  return {shared, local};
}

Fit with_base_at_prior(Fit fit) {
  const auto& shared = fit.layout.shared();
  for (std::size_t i = 0; i < shared.size(); ++i)
    if (is_normal_of_base(shared[i])) fit.shared[static_cast<Index>(i)] = shared[i].parameter->prior.middle;
  const auto own = static_cast<Index>(fit.layout.system().nuisances().size());
  for (VectorXd& local : fit.local) local.head(own).setZero();
  return fit;
}

Proposals::Proposals(const Likelihood& likelihood, const Fit& about) : system_(&likelihood.system()) {
  candidates_.resize(system_->effects().size());
  const auto views = views_of(about);
  parallel_for(candidates_.size(), [&](std::size_t e) { candidates_[e] = make_candidate(likelihood, views, e); });
}

Proposals::Candidate Proposals::make_candidate(const Likelihood& likelihood, std::span<const Fit> views,
                                               std::size_t e) const {
  const Effect& effect = system_->effects()[e];
  Candidate out;
  for (std::size_t p = 0; p < effect.parameters.size(); ++p) {
    const Parameter& parameter = effect.parameters[p];
    if (parameter.scope != Scope::shared)
      out.local = static_cast<int>(p), out.instant = parameter.scope == Scope::instant;
    else if (is_size(parameter))
      out.amplitudes.push_back(p);
  }
  if (!system_->allows({e})) return out;
  ModelSet rest = without(views.front().layout.set(), e);
  if (!system_->allows(with(rest, e))) rest.clear();
  const Layout around(*system_, rest), layout(*system_, with(rest, e));
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    std::vector<double> choices;
    if (out.local >= 0) {
      const Parameter& parameter = effect.parameters[static_cast<std::size_t>(out.local)];
      choices = parameter.starts;
      if (out.instant) {
        choices.clear();
        const double duration_s = likelihood.data().recordings[r].duration_s;
        const int count = std::max(4, static_cast<int>(std::lround(duration_s / kInstantSpacing_s)));
        for (int i = 0; i < count; ++i) choices.push_back(duration_s * (i + 0.5) / count);
      }
    }
    out.choices.push_back(std::move(choices));
  }
  const auto starts = starts_of(effect);
  const auto seen = static_cast<Index>(starts.size() * views.size());
  Prediction prediction;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    const auto per_start = out.local >= 0 ? static_cast<Index>(out.choices[r].size()) : out.width();
    MatrixXd raw;
    Index column = 0;
    for (const Fit& view : views) {
      if (!system_->predict(rest, r, around.shared_from(view.layout, view.shared),
                            around.local_from(view.layout, view.local[r]), false, prediction))
        return Candidate{};
      const VectorXd path = prediction.reading;
      if (raw.size() == 0) raw = MatrixXd::Zero(path.size(), per_start * seen);
      for (const VectorXd& start : starts)
        for (Index c = 0; c < per_start; ++c, ++column) {
          VectorXd values = start;
          if (out.local >= 0)
            values[out.local] = out.choices[r][static_cast<std::size_t>(c)];
          else
            for (std::size_t a = 0; a < out.amplitudes.size(); ++a)
              if (static_cast<Index>(a) != c)
                values[static_cast<Index>(out.amplitudes[a])] = effect.parameters[out.amplitudes[a]].none;
          const auto [shared, local] = unknowns_with(layout, view.layout, view.shared, view.local[r], e, values);
          if (system_->predict(layout.set(), r, shared, local, false, prediction))
            raw.col(column) = prediction.reading - path;
        }
    }
    out.columns.push_back(likelihood.whitened(r, raw).cast<float>());
  }
  for (Index s = 0; s < seen; ++s)
    out.signatures.push_back({.values = starts[static_cast<std::size_t>(s) % starts.size()],
                              .first = out.local >= 0 ? s : s * out.width(),
                              .base_at_prior = static_cast<std::size_t>(s) >= starts.size()});
  return out;
}

std::vector<Proposal> Proposals::beside(const Marginal& marginal, std::size_t starts) const {
  if (!marginal.valid()) return {};
  std::vector<std::size_t> joining;
  for (std::size_t e = 0; e < candidates_.size(); ++e) {
    if (contains(marginal.set(), e) || candidates_[e].signatures.empty()) continue;
    if (system_->allows(with(marginal.set(), e))) joining.push_back(e);
  }
  std::vector<Proposal> out(joining.size());
  parallel_for(joining.size(), [&](std::size_t i) {
    const Candidate& candidate = candidates_[joining[i]];
    out[i] = candidate.local >= 0 ? judge_local(candidate, joining[i], marginal, starts)
                                  : judge(candidate, joining[i], marginal, starts);
  });
  std::stable_sort(out.begin(), out.end(),
                   [](const auto& a, const auto& b) { return a.log_bayes_factor > b.log_bayes_factor; });
  return out;
}

Proposal Proposals::judge(const Candidate& candidate, std::size_t e, const Marginal& beside, std::size_t starts) const {
  const Effect& effect = system_->effects()[e];
  const Index columns = candidate.columns.front().cols(), width = candidate.width();
  MatrixXd XX = MatrixXd::Zero(width, columns), XZ = MatrixXd::Zero(columns, beside.step().size());
  VectorXd Xw = VectorXd::Zero(columns);
  for (std::size_t r = 0; r < beside.recordings(); ++r) {
    const MatrixXf& X = candidate.columns[r];
    const Marginal::Part part = beside.part(r, X);
    XZ += part.across;
    Xw += part.pull;
    for (Index c = 0; c < columns; c += width) XX.middleCols(c, width) += part.square(X, c, width);
  }
  Proposal out{.effect = e, .starts = {}};
  std::vector<double> logs;
  const bool sizes_have_grid =
      std::ranges::any_of(candidate.amplitudes, [&](std::size_t a) { return effect.parameters[a].starts.size() > 1; });
  for (const Signature& signature : candidate.signatures) {
    const auto across = XZ.middleRows(signature.first, width);
    MatrixXd square = XX.middleCols(signature.first, width) - across * across.transpose();
    const VectorXd pull = Xw.segment(signature.first, width);
    StartPoint start{.shared = shared_part(effect, signature.values),
                     .local = {},
                     .log_bayes_factor = kNever,
                     .base_at_prior = signature.base_at_prior};
    if (candidate.amplitudes.empty()) {
      start.log_bayes_factor = pull[0] - 0.5 * square(0, 0);
    } else {
      // The prior of each size, in shares of the start.
      MatrixXd precision = MatrixXd::Zero(width, width);
      double log_prior = 0;
      for (Index a = 0; a < width; ++a) {
        const Parameter& p = effect.parameters[candidate.amplitudes[static_cast<std::size_t>(a)]];
        const double unit =
            signature.values[static_cast<Index>(candidate.amplitudes[static_cast<std::size_t>(a)])] - p.none;
        precision(a, a) = unit * unit * precision_of(p.prior);
        log_prior += std::log(precision(a, a));
      }
      const MatrixXd both = square + precision;
      const Eigen::LDLT<MatrixXd> factor(both);
      const VectorXd shares = factor.solve(pull);
      VectorXd values = signature.values;
      if (apply_shares(effect, candidate.amplitudes, shares, values)) {
        start.shared = shared_part(effect, values);
        start.log_bayes_factor =
            0.5 * (pull.dot(shares) + log_prior - factor.vectorD().array().max(1e-300).log().sum());
      }
    }
    logs.push_back(start.log_bayes_factor);
    out.starts.push_back(start);
    // Where sizes have a grid, the form depends on the size, and the one of the grid is the form that was looked at.
    start.shared = shared_part(effect, signature.values);
    if (sizes_have_grid) out.starts.push_back(std::move(start));
  }
  out.log_bayes_factor = log_sum(logs) - std::log(static_cast<double>(logs.size()));
  keep_best(out.starts, starts);
  return out;
}

Proposal Proposals::judge_local(const Candidate& candidate, std::size_t e, const Marginal& beside,
                                std::size_t starts) const {
  const Effect& effect = system_->effects()[e];
  const std::size_t recordings = beside.recordings();
  std::vector<VectorXd> pull(recordings), square(recordings);
  for (std::size_t r = 0; r < recordings; ++r) {
    const MatrixXf& X = candidate.columns[r];
    const Marginal::Part part = beside.part(r, X);
    pull[r] = part.pull;
    square[r] = part.squares(X) - part.across.rowwise().squaredNorm();
    square[r] = square[r].cwiseMax(0);
  }
  Proposal out{.effect = e, .starts = {}};
  std::vector<double> logs;
  for (std::size_t s = 0; s < candidate.signatures.size(); ++s) {
    // Sizes, as shares of the start, that a recording by itself would ask for.
    std::vector<double> shares;
    for (std::size_t r = 0; r < recordings; ++r) {
      const auto count = static_cast<Index>(candidate.choices[r].size());
      double best = 0, share = 0;
      for (Index c = 0; c < count; ++c) {
        const Index column = static_cast<Index>(s) * count + c;
        const double b = pull[r][column], q = square[r][column];
        if (q > 1e-9 && b > 0 && b * b / q > best) best = b * b / q, share = b / q;
      }
      if (share > 0) shares.push_back(std::min(share, kFarthest)), shares.push_back(0.5 * std::min(share, kFarthest));
    }
    StartPoint found{.shared = shared_part(effect, candidate.signatures[s].values),
                     .local = {},
                     .log_bayes_factor = kNever,
                     .base_at_prior = candidate.signatures[s].base_at_prior};
    for (const double share : shares) {
      double sum = 0, curvature = 0;
      std::vector<VectorXd> local;
      for (std::size_t r = 0; r < recordings; ++r) {
        const auto count = static_cast<Index>(candidate.choices[r].size());
        std::vector<double> gains;
        for (Index c = 0; c < count; ++c) {
          const Index column = static_cast<Index>(s) * count + c;
          gains.push_back(share * pull[r][column] - 0.5 * share * share * square[r][column]);
        }
        const auto best = static_cast<std::size_t>(std::max_element(gains.begin(), gains.end()) - gains.begin());
        const double mean = log_sum(gains) - std::log(static_cast<double>(count));
        bool happens = true;
        if (candidate.instant) {
          const double odds = kHappens / (kHappens + kHappensNot);
          const double terms[] = {std::log(1 - odds), std::log(odds) + mean};
          sum += log_sum(terms);
          happens = terms[1] > terms[0];
        } else {
          sum += mean;
        }
        if (happens) curvature += square[r][static_cast<Index>(s) * count + static_cast<Index>(best)];
        local.push_back(VectorXd::Constant(1, happens ? candidate.choices[r][best] : 0.0));
      }
      VectorXd values = candidate.signatures[s].values;
      const VectorXd all = VectorXd::Constant(static_cast<Index>(candidate.amplitudes.size()), share);
      if (!apply_shares(effect, candidate.amplitudes, all, values)) continue;
      const Parameter& size = effect.parameters[candidate.amplitudes.front()];
      const double unit = candidate.signatures[s].values[static_cast<Index>(candidate.amplitudes.front())] - size.none;
      const double log_factor = sum - 0.5 * std::log1p(curvature / (unit * unit * precision_of(size.prior)));
      if (log_factor > found.log_bayes_factor) {
        found.log_bayes_factor = log_factor;
        found.shared = shared_part(effect, values);
        found.local = std::move(local);
      }
    }
    logs.push_back(found.log_bayes_factor);
    if (!found.local.empty()) out.starts.push_back(std::move(found));
  }
  out.log_bayes_factor = log_sum(logs) - std::log(static_cast<double>(logs.size()));
  keep_best(out.starts, starts);
  return out;
}

}  // namespace bevel::inference
