#include "diagnosis/mismatch/freedom.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "diagnosis/mismatch/corrections.hpp"
#include "diagnosis/mismatch/local_unknowns.hpp"

namespace bevel::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kExpectedShare = 0.75;  // standard deviation of a size, of the largest that is reported
constexpr double kTail = 4;              // degrees of freedom of Student's t
constexpr double kOrdersBelow = 3;       // orders of magnitude of a size, below what is reported
constexpr double kKnotsHang = 2.0;       // knots over which a curve's values hang together
constexpr double kUnseenPrice = 6.0;     // of a value that the effect's causes do not bring about

// A flat expectation over a range has the volume of a normal one of this variance.
double variance_of_range(double range) { return range * range / (2 * std::numbers::pi); }

// How far a size may be expected from `none`.
double expected_size(const model::EffectParameter& parameter) {
  double reported = parameter.reported;
  if (!(reported > 0)) {
    reported = 0;
    for (const double start : parameter.starts) reported = std::max(reported, 2 * std::abs(start - parameter.none));
  }
  return kExpectedShare * reported;
}

// Of a value, against one that a normal expectation has at its middle.
double surprise_of(double standard_deviations) {
  return (kTail + 1) * std::log1p(standard_deviations * standard_deviations / kTail);
}

// A size is as large as what is reported, or of any order below: rigs that are made well are reported least. Of the
// second kind it is known no better than to its own error.
double surprise_of_size(double standard_deviations, double known_to) {
  const double size = std::max(std::abs(standard_deviations), known_to);
  const double any_order = std::sqrt(2 * std::numbers::pi) / (2 * kOrdersBelow * std::numbers::ln10 * size);
  const double reported = std::exp(-0.5 * surprise_of(standard_deviations));
  return -2 * std::log(0.5 * (reported + (size * kExpectedShare < 1 ? any_order : 0)));
}

struct Expectation {
  MatrixXd covariance;
  double surprise = 0;
};

// The knots of each curve, as places in the list of unknowns.
std::vector<std::vector<Index>> knots_by_curve(const Hypothesis& hypothesis, const std::vector<Index>& which) {
  std::vector<std::vector<Index>> curves;
  for (std::size_t m = 0; m < hypothesis.set().size(); ++m) {
    if (!is_correction(hypothesis.set()[m])) continue;
    std::vector<Index> knots;
    for (std::size_t i = 0; i < which.size(); ++i)
      if (hypothesis.unknowns()[static_cast<std::size_t>(which[i])].member == static_cast<int>(m))
        knots.push_back(static_cast<Index>(i));
    if (!knots.empty()) curves.push_back(std::move(knots));
  }
  return curves;
}

// A curve's knots together: a smooth one, of the scale that it was found to have.
MatrixXd expectation_of_curve(const Fit& fit, const std::vector<Index>& which, const std::vector<Index>& knots) {
  const auto count = static_cast<Index>(knots.size());
  VectorXd values(count);
  MatrixXd hang(count, count);
  for (Index a = 0; a < count; ++a) {
    values[a] = fit.values[which[static_cast<std::size_t>(knots[static_cast<std::size_t>(a)])]];
    for (Index b = 0; b < count; ++b) hang(a, b) = std::exp(-std::abs(static_cast<double>(a - b)) / kKnotsHang);
  }
  const double variance = values.dot(hang.llt().solve(values)) / static_cast<double>(count);
  return std::max(variance, 1e-30) * hang;
}

// Of the unknowns listed, in their order; the surprise is the names'.
Expectation expectation_of(const Fit& fit, const MatrixXd& covariance, const std::vector<Index>& which) {
  const auto& hypothesis = fit.hypothesis;
  const auto n = static_cast<Index>(which.size());
  Expectation out{.covariance = MatrixXd::Zero(n, n)};
  for (Index i = 0; i < n; ++i) {
    const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(which[static_cast<std::size_t>(i)])];
    const Member& member = hypothesis.set()[static_cast<std::size_t>(u.member)];
    if (is_correction(member)) continue;
    const auto& parameter = member.effect->parameters()[static_cast<std::size_t>(u.parameter)];
    const double value = fit.values[which[static_cast<std::size_t>(i)]];
    if (parameter.periodic && std::isnan(parameter.none)) {
      out.covariance(i, i) = variance_of_range(u.upper - u.lower);
    } else if (std::isnan(parameter.none)) {
      const double low = *std::min_element(parameter.starts.begin(), parameter.starts.end());
      const double high =
          std::max(*std::max_element(parameter.starts.begin(), parameter.starts.end()), parameter.reported);
      const double variance = variance_of_range(std::max(high - low, std::abs(high)));
      out.covariance(i, i) = variance;
      out.surprise += surprise_of(std::max({low - value, value - high, 0.0}) / std::sqrt(variance));
    } else {
      const double sd = expected_size(parameter);
      out.covariance(i, i) = sd * sd;
      const auto at = which[static_cast<std::size_t>(i)];
      out.surprise += surprise_of_size((value - parameter.none) / sd, std::sqrt(covariance(at, at)) / sd);
      if (value > parameter.largest_seen || std::abs(value - parameter.none) < parameter.smallest_seen)
        out.surprise += kUnseenPrice;
      const bool one_sided = parameter.lower == parameter.none || parameter.largest_seen == parameter.none;
      if (one_sided) out.surprise -= 2 * std::numbers::ln2;
    }
  }
  for (const auto& knots : knots_by_curve(hypothesis, which))
    out.covariance(knots, knots) = expectation_of_curve(fit, which, knots);
  return out;
}

double log_determinant(const MatrixXd& matrix) { return matrix.ldlt().vectorD().array().max(1e-300).log().sum(); }

// Of a curve's values, whose scale could have been of any order of magnitude below the one that it was found to have:
// -2 ln of the integral over the logarithm of the scale, of how likely what was found is at each, against the volume
// at the scale found. `found` and `expected` are the covariances of all, the curve's at `knots`.
double surprise_of_curve(const VectorXd& values, const MatrixXd& found, const MatrixXd& expected,
                         const std::vector<Index>& knots) {
  constexpr double kStep = 0.1;
  constexpr double kRange = kOrdersBelow * std::numbers::ln10;
  constexpr int kSteps = static_cast<int>(1.5 * kRange / kStep) + 1;
  MatrixXd either = found + expected;
  const double volume = log_determinant(either);
  const VectorXd of_curve = values(knots);
  double integral = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double scale = std::exp(i * kStep - kRange);
    either(knots, knots) = found(knots, knots) + scale * scale * expected(knots, knots);
    const MatrixXd of_knots = either(knots, knots);
    const double distance = of_curve.dot(of_knots.ldlt().solve(of_curve));
    integral += kStep / kRange * std::exp(-0.5 * (distance + log_determinant(either) - volume));
  }
  return -2 * std::log(std::max(integral, 1e-300));
}

}  // namespace

double price_of_freedom(const Fit& fit) {
  const auto& unknowns = fit.hypothesis.unknowns();
  const MatrixXd whole = fit.covariance();
  std::vector<Index> which;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const auto at = static_cast<Index>(i);
    if (unknowns[i].member >= 0 && !is_instant(fit.hypothesis, unknowns[i]) && whole(at, at) > 0) which.push_back(at);
  }
  if (which.empty()) return 0;
  const Expectation expected = expectation_of(fit, whole, which);
  // In standard errors, so that parameters of all units can stand together.
  const VectorXd variances = whole.diagonal(), error = variances(which).cwiseSqrt();
  const auto in_errors = [&](const MatrixXd& covariance) -> MatrixXd {
    return covariance.array() / (error * error.transpose()).array();
  };
  const MatrixXd found = in_errors(whole(which, which)), widened = in_errors(expected.covariance);
  const VectorXd values = VectorXd(fit.values(which)).cwiseQuotient(error);
  double price = log_determinant(found + widened) - log_determinant(found) + expected.surprise;
  for (const auto& knots : knots_by_curve(fit.hypothesis, which))
    price += surprise_of_curve(values, found, widened, knots);
  return price;
}

MatrixXd precision_of_curves(const Fit& fit) {
  std::vector<Index> all(static_cast<std::size_t>(fit.hypothesis.size()));
  std::iota(all.begin(), all.end(), Index{0});
  MatrixXd precision = MatrixXd::Zero(fit.hypothesis.size(), fit.hypothesis.size());
  for (const auto& knots : knots_by_curve(fit.hypothesis, all))
    precision(knots, knots) = MatrixXd(expectation_of_curve(fit, all, knots).inverse());
  return precision;
}

}  // namespace bevel::diagnosis
