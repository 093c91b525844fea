// SPDX-License-Identifier: MIT
#include <algorithm>
#include <functional>

#include <bevel/diagnosis/inference/proposals.hpp>
#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A fit's shared unknowns a step away, within their bounds. Not by Layout::clamp(), which turns a direction by whole
// periods: the linear model is multiplied by the step.
VectorXd moved(const Fit& fit, const VectorXd& step) {
  VectorXd shared = fit.shared + step.head(fit.shared.size());
  for (Index i = 0; i < shared.size(); ++i) {
    const Parameter& p = *fit.layout.shared()[static_cast<std::size_t>(i)].parameter;
    shared[i] = std::clamp(shared[i], p.lower, p.upper);
  }
  return shared;
}

// A fit's readings of one recording, and by its shared unknowns.
struct Path {
  VectorXd reading;
  MatrixXd by_shared;
};

}  // namespace

MatrixXd Proposals::steps_beside(const Candidate& candidate, const Marginal& beside) {
  MatrixXd across = MatrixXd::Zero(candidate.columns.front().cols(), beside.step().size());
  for (std::size_t r = 0; r < beside.recordings(); ++r) across += beside.part(r, candidate.columns[r]).across;
  return beside.step().replicate(1, across.rows()) - beside.root() * across.transpose();
}

void Proposals::look_with_others_moved(const Likelihood& by, const Fit& fit, const Marginal& beside, std::size_t starts,
                                       std::vector<Proposal>& proposals) const {
  if (!beside.valid()) return;
  std::vector<Path> paths;
  for (Proposal& proposal : proposals) {
    const Candidate& known = candidates_[proposal.effect];
    // Where nothing of its kind is seen there is nothing to be put right.
    if (known.local >= 0 || !known.amplitudes.empty() || !(proposal.log_bayes_factor > 0)) continue;
    Prediction prediction;
    for (std::size_t r = paths.size(); r < by.recordings(); ++r) {
      if (!system_->predict(fit.layout.set(), r, fit.shared, fit.local[r], true, prediction)) return;
      paths.push_back({.reading = prediction.reading, .by_shared = prediction.by_shared});
    }
    Candidate anew;
    std::vector<VectorXd> others;
    const MatrixXd steps = steps_beside(known, beside);
    for (const Signature& one : known.signatures) {
      if (one.base_at_prior) continue;
      others.push_back(moved(fit, steps.col(one.first)));
      anew.signatures.push_back({.values = one.values, .first = static_cast<Index>(anew.signatures.size())});
    }
    const Layout layout(*system_, with(fit.layout.set(), proposal.effect));
    anew.columns.resize(by.recordings());
    parallel_for(by.recordings(), [&](std::size_t r) {
      MatrixXd raw = MatrixXd::Zero(paths[r].reading.size(), static_cast<Index>(others.size()));
      Prediction there;
      for (const Signature& one : anew.signatures) {
        const VectorXd& beside_it = others[static_cast<std::size_t>(one.first)];
        const auto [shared, local] =
            unknowns_with(layout, fit.layout, beside_it, fit.local[r], proposal.effect, one.values);
        // Less what the linear model itself says of the others' steps: the rest is the effect's own.
        if (system_->predict(layout.set(), r, shared, local, false, there))
          raw.col(one.first) = there.reading - paths[r].reading - paths[r].by_shared * (beside_it - fit.shared);
      }
      anew.columns[r] = by.whitened(r, raw).cast<float>();
    });
    Proposal found = judge(anew, proposal.effect, beside, starts);
    if (found.log_bayes_factor < proposal.log_bayes_factor) continue;
    const MatrixXd again = steps_beside(anew, beside);
    for (StartPoint& start : found.starts)
      for (const Signature& one : anew.signatures)
        if (start.shared == one.values) start.beside = moved(fit, again.col(one.first));
    proposal = std::move(found);
  }
  std::ranges::stable_sort(proposals, std::greater{}, &Proposal::log_bayes_factor);
}

}  // namespace bevel::inference
