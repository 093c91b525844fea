#include "diagnosis/mismatch/dictionary.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/mismatch/local_unknowns.hpp"
#include "diagnosis/mismatch/parallel.hpp"
#include "diagnosis/statistics/median.hpp"

namespace bevel::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kInstants = 14;       // of a jump, over a recording
constexpr double kOnPenalty = 8.0;  // chi2 that a jump has to bring in a recording: 2 log of the instants and more
constexpr double kFarthest = 4.0;   // amplitudes promised reach to so many times their start

// Whitened prediction of one recording with the effect added at these values; empty outside the model's domain.
VectorXd path_with(const Evidence& evidence, const Hypothesis& hypothesis, const VectorXd& values, std::size_t r,
                   Workspace& workspace) {
  if (!evaluate(evidence, hypothesis, r, values, false, workspace)) return {};
  return -workspace.residuals.white;  // plus the whitened measurement, which cancels in differences
}

class SignatureMaker {
 public:
  SignatureMaker(const Evidence& evidence, const Fit& fit, const Ground& ground, const Candidate& candidate)
      : evidence_(evidence), ground_(ground), candidate_(candidate), hypothesis_(extended(evidence, fit, candidate)) {
    base_ = hypothesis_.start_from(fit.hypothesis, fit.values);
  }

  // False where the effect leaves the model's domain or does nothing at all.
  bool make(Signature& signature) {
    const auto& parameters = candidate_.member.effect->parameters();
    if (candidate_.local >= 0) return make_choices(signature);
    std::vector<std::vector<double>> settings;
    for (int a : candidate_.amplitudes) {
      auto one = signature.shape;
      for (int other : candidate_.amplitudes)
        if (other != a) one[static_cast<std::size_t>(other)] = parameters[static_cast<std::size_t>(other)].none;
      settings.push_back(one);
    }
    if (settings.empty()) settings.push_back(signature.shape);
    signature.columns.resize(ground_.residual.size(), static_cast<Index>(settings.size()));
    for (std::size_t s = 0; s < settings.size(); ++s)
      for (std::size_t r = 0; r + 1 < ground_.rows.size(); ++r) {
        const VectorXd change = change_of(r, settings[s], 0);
        if (change.size() == 0) return false;
        signature.columns.col(static_cast<Index>(s)).segment(ground_.rows[r], change.size()) = change;
      }
    const double whole = signature.columns.squaredNorm();
    signature.columns -= ground_.Q * (ground_.Q.transpose() * signature.columns).eval();
    const MatrixXd gram = signature.columns.transpose() * signature.columns;
    if (!(gram.diagonal().maxCoeff() > 1e-12)) return false;
    signature.absorbed = 1 - gram.trace() / whole;
    signature.gram_inverse = gram.completeOrthogonalDecomposition().pseudoInverse();
    return true;
  }

 private:
  static Hypothesis extended(const Evidence& evidence, const Fit& fit, const Candidate& candidate) {
    EffectSet set = fit.hypothesis.set();
    set.push_back(candidate.member);
    return Hypothesis(evidence.belief, set, *evidence.recorded);
  }

  VectorXd change_of(std::size_t r, const std::vector<double>& parameters, double local) {
    VectorXd values = base_;
    const std::size_t m = hypothesis_.set().size() - 1;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      const int i = hypothesis_.find(m, p, static_cast<int>(r));
      if (i >= 0) values[i] = static_cast<int>(p) == candidate_.local ? local : parameters[p];
    }
    VectorXd path = path_with(evidence_, hypothesis_, values, r, workspace_);
    if (path.size() != 0) path -= ground_.path_white[r];
    return path;
  }

  bool make_choices(Signature& signature) {
    const auto& parameter = candidate_.member.effect->parameters()[static_cast<std::size_t>(candidate_.local)];
    signature.choices.resize(ground_.rows.size() - 1);
    double whole = 0, left = 0;
    for (std::size_t r = 0; r < signature.choices.size(); ++r) {
      std::vector<double> values = parameter.starts;
      if (!parameter.periodic) {
        values.clear();
        const double duration_s = evidence_.recorded->recordings[r].duration_s();
        for (int i = 0; i < kInstants; ++i) values.push_back(duration_s * (i + 0.5) / kInstants);
      }
      const Index rows = ground_.rows[r + 1] - ground_.rows[r];
      for (double value : values) {
        VectorXd change = change_of(r, signature.shape, value);
        if (change.size() == 0) continue;
        const double absorbed = (ground_.Q.middleRows(ground_.rows[r], rows).transpose() * change).squaredNorm();
        const double squared = change.squaredNorm() - absorbed;
        whole += change.squaredNorm();
        left += squared;
        signature.choices[r].push_back({value, std::move(change), squared});
      }
    }
    signature.absorbed = whole > 0 ? 1 - left / whole : 0;
    return left > 1e-12;
  }

  const Evidence& evidence_;
  const Ground& ground_;
  const Candidate& candidate_;
  Hypothesis hypothesis_;
  VectorXd base_;
  Workspace workspace_;
};

// Every combination of starts of the parameters that all recordings share.
std::vector<std::vector<double>> starts_of(const Candidate& candidate) {
  std::vector<std::vector<double>> all = {{}};
  const auto& parameters = candidate.member.effect->parameters();
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    std::vector<double> values = parameters[p].starts;
    if (!candidate.member.fits(p)) values = {parameters[p].none};
    if (static_cast<int>(p) == candidate.local) values = {0.0};
    std::vector<std::vector<double>> longer;
    for (const auto& head : all)
      for (double value : values) {
        longer.push_back(head);
        longer.back().push_back(value);
      }
    all = std::move(longer);
  }
  return all;
}

Candidate candidate_for(const Member& member) {
  Candidate candidate{.member = member, .amplitudes = {}, .signatures = {}};
  candidate.local_may_be_off = has_instants(member);
  const auto& parameters = member.effect->parameters();
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    if (!member.fits(p)) continue;
    if (parameters[p].scope == model::Scope::recording)
      candidate.local = static_cast<int>(p);
    else if (!std::isnan(parameters[p].none) && !parameters[p].shape)
      candidate.amplitudes.push_back(static_cast<int>(p));
  }
  return candidate;
}

// Amplitudes as shares of the start, back to parameters; a share below zero is no effect where `none` is the bound.
bool apply_shares(const Candidate& candidate, const VectorXd& shares, std::vector<double>& parameters) {
  for (std::size_t a = 0; a < candidate.amplitudes.size(); ++a) {
    const auto p = static_cast<std::size_t>(candidate.amplitudes[a]);
    const auto& info = candidate.member.effect->parameters()[p];
    const double share = std::clamp(shares[static_cast<Index>(a)], -kFarthest, kFarthest);
    const double value = info.none + share * (parameters[p] - info.none);
    if (info.none <= info.lower && value <= info.lower) return false;
    parameters[p] = std::clamp(value, info.lower, info.upper);
  }
  return true;
}

Promise promise_of_choices(const Candidate& candidate, const Signature& signature, const Ground& ground,
                           const VectorXd& residual) {
  const std::size_t recordings = signature.choices.size();
  std::vector<std::vector<double>> pull(recordings);
  std::vector<double> shares;
  for (std::size_t r = 0; r < recordings; ++r) {
    double best = 0, share = 0;
    const auto part = residual.segment(ground.rows[r], ground.rows[r + 1] - ground.rows[r]);
    for (const auto& choice : signature.choices[r]) {
      const double b = choice.column.dot(part);
      pull[r].push_back(b);
      if (choice.squared > 1e-9 && b > 0 && b * b / choice.squared > best)
        best = b * b / choice.squared, share = b / choice.squared;
    }
    if (share > 0) shares.push_back(std::min(share, kFarthest));
  }
  Promise promise;
  double best_share = 0;
  const auto gain_at = [&](double share, std::vector<double>* chosen) {
    std::vector<double> gains;
    for (std::size_t r = 0; r < recordings; ++r) {
      double best = candidate.local_may_be_off ? 0 : -1e300;
      double value = 0;
      for (std::size_t j = 0; j < pull[r].size(); ++j) {
        const double gain = 2 * share * pull[r][j] - share * share * signature.choices[r][j].squared -
                            (candidate.local_may_be_off ? kOnPenalty : 0);
        if (gain > best) best = gain, value = signature.choices[r][j].value;
      }
      gains.push_back(pull[r].empty() ? 0 : best);
      if (chosen) chosen->push_back(value);
    }
    // An instant in nearly all recordings is no accident.
    if (candidate.local_may_be_off) {
      std::vector<std::size_t> by_gain(recordings);
      std::iota(by_gain.begin(), by_gain.end(), std::size_t{0});
      std::stable_sort(by_gain.begin(), by_gain.end(),
                       [&gains](std::size_t a, std::size_t b) { return gains[a] > gains[b]; });
      for (std::size_t i = most_recordings_with_an_instant(recordings); i < recordings; ++i) {
        gains[by_gain[i]] = 0;
        if (chosen) (*chosen)[by_gain[i]] = 0;
      }
    }
    return std::accumulate(gains.begin(), gains.end(), 0.0);
  };
  for (std::size_t i = 0, n = shares.size(); i < n; ++i) shares.push_back(0.5 * shares[i]);
  for (double share : shares) {
    const double gain = gain_at(share, nullptr);
    if (gain > promise.gain) promise.gain = gain, best_share = share;
  }
  gain_at(best_share, &promise.local_by_recording);
  promise.parameters = signature.shape;
  apply_shares(candidate, VectorXd::Constant(static_cast<Index>(candidate.amplitudes.size()), best_share),
               promise.parameters);
  return promise;
}

}  // namespace

Ground make_ground(const Evidence& evidence, const Fit& fit) {
  Ground ground;
  ground.rows = {0};
  std::vector<Residuals> parts;
  Workspace workspace;
  for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
    evaluate(evidence, fit.hypothesis, r, fit.values, true, workspace);
    parts.push_back(workspace.residuals);
    ground.rows.push_back(ground.rows.back() + workspace.residuals.white.size());
    ground.path_white.emplace_back(-workspace.residuals.white);
  }
  MatrixXd J = MatrixXd::Zero(ground.rows.back(), fit.hypothesis.size());
  ground.residual.resize(ground.rows.back());
  for (std::size_t r = 0; r < parts.size(); ++r) {
    ground.residual.segment(ground.rows[r], parts[r].white.size()) = parts[r].white;
    for (std::size_t i = 0; i < fit.hypothesis.columns(r).size(); ++i)
      J.col(fit.hypothesis.columns(r)[i]).segment(ground.rows[r], parts[r].white.size()) =
          parts[r].jacobian.col(static_cast<Index>(i));
  }
  for (Index i = 0; i < J.cols(); ++i) {
    const double norm = J.col(i).norm();
    if (norm > 0) J.col(i) /= norm;
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(J);
  Index rank = 0;
  for (Index i = 0; i < J.cols(); ++i)
    if (std::abs(qr.matrixR()(i, i)) > 1e-6) ++rank;
  ground.Q = qr.householderQ() * MatrixXd::Identity(J.rows(), rank);
  ground.residual -= ground.Q * (ground.Q.transpose() * ground.residual).eval();
  return ground;
}

std::vector<Member> members_of_library(const EffectSet& but) {
  std::vector<Member> members;
  for (const model::Effect* effect : model::all_effects()) {
    if (std::any_of(but.begin(), but.end(), [&](const Member& m) { return m.effect == effect; })) continue;
    for (const std::uint32_t variant : effect->variants()) members.push_back({effect, variant});
  }
  return members;
}

std::vector<Candidate> make_dictionary(const Evidence& evidence, const Fit& fit, const Ground& ground,
                                       const std::vector<Member>& members, int threads) {
  std::vector<Candidate> dictionary(members.size());
  std::vector<std::pair<std::size_t, std::size_t>> work;
  for (std::size_t m = 0; m < members.size(); ++m) {
    dictionary[m] = candidate_for(members[m]);
    for (auto& shape : starts_of(dictionary[m])) {
      dictionary[m].signatures.push_back({.shape = std::move(shape), .columns = {}, .gram_inverse = {}, .choices = {}});
      work.emplace_back(m, dictionary[m].signatures.size() - 1);
    }
  }
  std::vector<char> good(work.size(), 0);
  parallel_for(work.size(), threads, [&](std::size_t i) {
    Candidate& candidate = dictionary[work[i].first];
    good[i] = SignatureMaker(evidence, fit, ground, candidate).make(candidate.signatures[work[i].second]) ? 1 : 0;
  });
  for (std::size_t i = work.size(); i-- > 0;)
    if (!good[i]) {
      auto& signatures = dictionary[work[i].first].signatures;
      signatures.erase(signatures.begin() + static_cast<std::ptrdiff_t>(work[i].second));
    }
  return dictionary;
}

Promise promise_of(const Candidate& candidate, const Signature& signature, const Ground& ground,
                   const VectorXd& residual) {
  if (candidate.local >= 0) return promise_of_choices(candidate, signature, ground, residual);
  Promise promise;
  promise.parameters = signature.shape;
  const VectorXd b = signature.columns.transpose() * residual;
  if (candidate.amplitudes.empty()) {
    promise.gain = 2 * b[0] - signature.columns.col(0).squaredNorm();
    return promise;
  }
  const VectorXd shares = signature.gram_inverse * b;
  if (apply_shares(candidate, shares, promise.parameters)) promise.gain = b.dot(shares);
  return promise;
}

std::vector<Promise> best_promises(const Candidate& candidate, const Ground& ground, std::size_t count) {
  std::vector<Promise> promises;
  for (const auto& signature : candidate.signatures)
    promises.push_back(promise_of(candidate, signature, ground, ground.residual));
  std::stable_sort(promises.begin(), promises.end(), [](const auto& a, const auto& b) { return a.gain > b.gain; });
  if (promises.size() > count) promises.resize(count);
  return promises;
}

PromisingStart most_promising_start(const Candidate& candidate, const Ground& ground) {
  PromisingStart best;
  for (const auto& signature : candidate.signatures) {
    Promise one = promise_of(candidate, signature, ground, ground.residual);
    if (!best.signature || one.gain > best.promise.gain) best = {&signature, std::move(one)};
  }
  return best;
}

double visible_per_unit(const Candidate& candidate, std::size_t amplitude) {
  const auto p = static_cast<std::size_t>(candidate.amplitudes[amplitude]);
  const double none = candidate.member.effect->parameters()[p].none;
  std::vector<double> sizes;
  for (const auto& signature : candidate.signatures) {
    double squared = 0;
    if (candidate.local < 0) {
      // One amplitude with the effect's others free.
      const auto a = static_cast<Index>(amplitude);
      if (signature.gram_inverse(a, a) > 0) squared = 1 / signature.gram_inverse(a, a);
    } else if (candidate.local_may_be_off) {
      // In one recording, at an instant like any other.
      std::vector<double> all;
      for (const auto& choices : signature.choices)
        for (const auto& choice : choices) all.push_back(choice.squared);
      squared = median(all);
    } else {
      for (const auto& choices : signature.choices)
        if (!choices.empty()) squared += choices.front().squared;
    }
    sizes.push_back(std::sqrt(std::max(squared, 0.0)) / std::abs(signature.shape[p] - none));
  }
  return median(sizes);
}

double absorbed_share(const Candidate& candidate) {
  std::vector<double> shares;
  for (const auto& signature : candidate.signatures) shares.push_back(signature.absorbed);
  return median(shares);
}

MatrixXd visible_basis(const Candidate& candidate, const Ground& ground) {
  const auto [best, promise] = most_promising_start(candidate, ground);
  if (!best) return {};
  MatrixXd columns = best->columns;
  if (candidate.local >= 0) {
    columns = MatrixXd::Zero(ground.residual.size(), 1);
    for (std::size_t r = 0; r < best->choices.size(); ++r)
      for (const auto& choice : best->choices[r])
        if (r < promise.local_by_recording.size() && choice.value == promise.local_by_recording[r])
          columns.col(0).segment(ground.rows[r], choice.column.size()) = choice.column;
    columns -= ground.Q * (ground.Q.transpose() * columns).eval();
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(columns);
  const Index rank = columns.squaredNorm() > 1e-12 ? qr.rank() : 0;
  return qr.householderQ() * MatrixXd::Identity(columns.rows(), rank);
}

}  // namespace bevel::diagnosis
