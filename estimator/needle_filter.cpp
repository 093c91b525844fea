#include "estimator/needle_filter.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <numbers>

#include "estimator/propagate.hpp"

namespace bevel::estimator {
namespace {

// Information below this share of the largest is an axis that the camera does not see.
constexpr double kRankTolerance = 1e-9;
constexpr double kLambda2Max = 0.9;  // (24) with room: 1 - lambda2 stays away from zero
constexpr double kVarianceFloor = 1e-14;

double square(double x) { return x * x; }

// The axes along which a measurement has information, in the last `rank` columns, and its variance along them.
struct SeenAxes {
  Eigen::Matrix3d axes;
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  int rank = 0;
};

SeenAxes seen_axes(const Eigen::Matrix3d& information) {
  SeenAxes seen;
  Eigen::Vector3d values = information.diagonal();
  // Cameras that look along an axis of {A}, and most do, need no search for eigenvectors.
  if (information(0, 1) == 0 && information(0, 2) == 0 && information(1, 2) == 0) {
    seen.axes.setIdentity();
    for (int i = 0; i < 2; ++i)  // ascending, by two passes of a bubble
      for (int j = 0; j < 2 - i; ++j)
        if (values[j] > values[j + 1]) {
          std::swap(values[j], values[j + 1]);
          seen.axes.col(j).swap(seen.axes.col(j + 1));
        }
  } else {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(information);
    values = eigen.eigenvalues();
    seen.axes = eigen.eigenvectors();
  }
  for (int i = 0; i < 3; ++i)
    if (values[i] > kRankTolerance * values[2] && values[i] > 0) {
      seen.variance[i] = 1 / values[i];
      ++seen.rank;
    }
  return seen;
}

// `by_state`: derivative of what is seen by the first columns of the error; R of the pose if it is the tip itself.
template <int kRank, int kColumns>
Update update_rank(FilterState& state, const Eigen::Matrix<double, 3, kColumns>& by_state, const Eigen::Matrix3d& axes,
                   const Eigen::Vector3d& variance, const Eigen::Vector3d& residual, double gate) {
  using Vec = Eigen::Matrix<double, kRank, 1>;
  using Mat = Eigen::Matrix<double, kRank, kRank>;
  const Eigen::Matrix<double, kRank, kColumns> H = axes.rightCols<kRank>().transpose() * by_state;
  const Eigen::Matrix<double, 9, kRank> PHt = state.covariance.leftCols<kColumns>() * H.transpose();
  Mat S = H * PHt.template topRows<kColumns>();
  S.diagonal() += variance.tail<kRank>();
  const Eigen::LLT<Mat> llt(S);
  const Vec y = axes.rightCols<kRank>().transpose() * residual;
  const Vec whitened = llt.matrixL().solve(y);

  Update result;
  result.rank = kRank;
  result.mahalanobis2 = whitened.squaredNorm();
  result.test_ratio = result.mahalanobis2 / gate;
  result.innovation.head<kRank>() = y;
  result.innovation_whitened.head<kRank>() = whitened;
  result.accepted = result.test_ratio <= 1;  // false for a NaN too
  if (!result.accepted) return result;

  const Eigen::Matrix<double, 9, kRank> K = llt.solve(PHt.transpose()).transpose();
  const Vector9d correction = K * y;
  // Joseph form, (I - K H) P (I - K H)^T + K R K^T, with H only in its first columns; small products written out.
  Matrix9d P = state.covariance;
  P.noalias() -= K.lazyProduct(PHt.transpose());
  Eigen::Matrix<double, 9, kRank> PHt2 = P.leftCols<kColumns>().lazyProduct(H.transpose());
  PHt2 -= K * variance.tail<kRank>().asDiagonal();
  P.noalias() -= PHt2.lazyProduct(K.transpose());
  state.covariance = 0.5 * (P + P.transpose());
  state.pose = state.pose * model::exp_se3(correction.head<6>());
  state.pose.R = model::orthonormalised(state.pose.R);
  state.curvature_per_mm += correction[6];
  state.lambda1_per_rad += correction[7];
  state.lambda2 += correction[8];
  return result;
}

template <int kColumns>
Update update_seen(FilterState& state, const Eigen::Matrix<double, 3, kColumns>& by_state, const SeenAxes& seen,
                   const Eigen::Vector3d& residual, const std::array<double, 3>& gate) {
  switch (seen.rank) {
    case 1:
      return update_rank<1, kColumns>(state, by_state, seen.axes, seen.variance, residual, gate[0]);
    case 2:
      return update_rank<2, kColumns>(state, by_state, seen.axes, seen.variance, residual, gate[1]);
    case 3:
      return update_rank<3, kColumns>(state, by_state, seen.axes, seen.variance, residual, gate[2]);
    default:
      return {};
  }
}

}  // namespace

NeedleFilter::NeedleFilter(const EstimatorConfig& config)
    : config_(config),
      slip_(model::slip_parameters(config.prior.needle)),
      needle_(config.prior.needle, config.effects, 9, {.curvature = 6, .lambda1 = 7, .lambda2 = 8}) {
  for (int rank = 1; rank <= 3; ++rank)
    gate_[static_cast<std::size_t>(rank - 1)] =
        boost::math::quantile(boost::math::chi_squared(rank), config.gate.probability);
}

FilterState NeedleFilter::initial(double insertion_mm, double rotation_rad) const {
  const Prior& prior = config_.prior;
  FilterState state;
  state.curvature_per_mm = prior.needle.curvature_per_mm;
  state.lambda1_per_rad = prior.needle.lambda1_per_rad;
  state.lambda2 = prior.needle.lambda2;
  state.covariance.diagonal() << Eigen::Vector3d::Constant(square(prior.position_sd_mm)), square(prior.tilt_sd_rad),
      square(prior.tilt_sd_rad), square(prior.roll_sd_rad), square(prior.curvature_sd_per_mm),
      square(prior.lambda1_sd_per_rad), square(prior.lambda2_sd);
  if (config_.effects.empty()) return state;
  const model::AugmentedState entry = needle_.entry({0, insertion_mm, rotation_rad});
  state.pose = entry.pose;
  state.effects.entry = state.effects.base = entry.base;
  state.effects.tip_insertion_mm = insertion_mm;
  state.effects.tip_rotation_rad = rotation_rad;
  return state;
}

void NeedleFilter::predict(FilterState& state, double insertion_mm, double rotation_rad, double duration_s) const {
  if (!config_.effects.empty()) {
    state.outside_model = !predict_with_effects(state, {duration_s, insertion_mm, rotation_rad});
    return;
  }
  if (insertion_mm == 0 && rotation_rad == 0) return;
  model::SlipParameters slip = slip_;
  slip.lambda1_per_rad = state.lambda1_per_rad;
  slip.lambda2 = state.lambda2;
  model::NeedleJacobian jacobian;
  if (!model::advance(state.pose, {insertion_mm, rotation_rad, {state.curvature_per_mm, 0}}, slip, jacobian)) {
    state.outside_model = true;
    return;
  }
  state.outside_model = false;

  propagate<9>(state.covariance, jacobian.pose, jacobian.needle.leftCols<3>());
  state.covariance.diagonal() += process_variance(state.covariance, insertion_mm, rotation_rad);
}

Vector9d NeedleFilter::process_variance(const Matrix9d& covariance, double insertion_mm, double rotation_rad) const {
  const ProcessNoise& noise = config_.process;
  Vector9d added;
  added << Eigen::Vector3d::Constant(square(noise.position_mm)), square(noise.tilt_rad), square(noise.tilt_rad),
      square(noise.roll_rad), square(noise.curvature_per_mm), square(noise.lambda1_per_rad), square(noise.lambda2);
  added *= std::abs(insertion_mm);
  added[5] += square(noise.roll_per_sqrt_rad) * std::abs(rotation_rad);
  // A parameter that the prior holds fixed (standard deviation zero) stays fixed: no walk is added to it.
  for (int i = 6; i < 9; ++i)
    if (covariance(i, i) == 0) added[i] = 0;
  return added;
}

Update NeedleFilter::update(FilterState& state, const model::TipMeasurement& measurement) const {
  const SeenAxes seen = seen_axes(measurement.information_per_mm2);
  if (seen.rank == 0) return {};  // sees nothing: no rejection either
  Update result;
  if (config_.effects.empty()) {
    result = update_seen<3>(state, state.pose.R, seen, measurement.position_mm - state.pose.p_mm, gate_);
  } else {
    const model::TipReading at = reading(state);
    result = update_seen<9>(state, at.D, seen, measurement.position_mm - at.position_mm, gate_);
  }
  if (result.accepted) {
    state.measurement_utime = measurement.utime;
    state.rejects_in_row = 0;
    keep_in_domain(state);
  } else if (++state.rejects_in_row >= config_.gate.rejects_before_reset) {
    declare_reset(state);
    result.reset = true;
  }
  return result;
}

// Moves the parameters back into the valid set of Section III.A along the covariance, so that what is correlated with
// them moves too; the covariance itself is kept (a bound that is reached must not make the filter confident).
void NeedleFilter::keep_in_domain(FilterState& state) const {
  const auto move = [&state](const Vector9d& normal, double excess) {
    const Vector9d Pa = state.covariance * normal;
    const double variance = normal.dot(Pa);
    if (!(variance > 0)) return;
    const Vector9d correction = -Pa * (excess / variance);
    state.pose = state.pose * model::exp_se3(correction.head<6>());
    state.curvature_per_mm += correction[6];
    state.lambda1_per_rad += correction[7];
    state.lambda2 += correction[8];
  };
  if (state.lambda1_per_rad == 0 && state.lambda2 == 0) return;
  if (state.lambda2 > kLambda2Max) move(Vector9d::Unit(8), state.lambda2 - kLambda2Max);
  // (26), linearised at the present lambda2; the set is convex, so twice is enough for small excesses.
  for (int i = 0; i < 2; ++i) {
    const double bound = square(state.lambda2) / (2 * std::numbers::pi) + 1e-6;
    if (state.lambda1_per_rad >= bound) break;
    Vector9d normal = Vector9d::Zero();
    normal[7] = 1;
    normal[8] = -state.lambda2 / std::numbers::pi;
    move(normal, state.lambda1_per_rad - bound);
  }
  // Whatever the covariance allowed, the state ends inside.
  state.lambda2 = std::min(state.lambda2, kLambda2Max);
  state.lambda1_per_rad = std::max(state.lambda1_per_rad, square(state.lambda2) / (2 * std::numbers::pi) + 1e-9);
  for (int i = 0; i < 9; ++i)
    if (state.covariance(i, i) != 0) state.covariance(i, i) = std::max(state.covariance(i, i), kVarianceFloor);
}

void NeedleFilter::declare_reset(FilterState& state) const {
  // The pose is believed no more; the parameters are, but less: their prior widths come back, correlations go.
  const FilterState prior = initial();
  const Gate& gate = config_.gate;
  state.covariance = prior.covariance;
  state.covariance.diagonal().head<6>() << Eigen::Vector3d::Constant(square(gate.reset_position_sd_mm)),
      square(gate.reset_tilt_sd_rad), square(gate.reset_tilt_sd_rad),
      square(std::max(gate.reset_tilt_sd_rad, config_.prior.roll_sd_rad));
  state.rejects_in_row = 0;
  state.measurement_utime = 0;
  ++state.reset_count;
}

}  // namespace bevel::estimator
