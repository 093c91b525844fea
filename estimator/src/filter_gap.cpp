// SPDX-License-Identifier: MIT
// The filter across a gap: an interval in which nobody observed the axes.
//
// Known are their positions at both ends, the length dt of the gap and the rates V, W that no axis exceeds. Unknown is
// the path, and with it the order of turning and inserting: inserted first, the needle bends to where the bevel pointed
// before; turned first, to where it points after. In W dt / 2 = pi / 2, a quarter of a second at 12 rad/s, the bevel
// can have pointed anywhere, so that no direction of bend is more probable than another: the mean goes straight.
//
// To first order in the tilt, the heading's deviation dh from that and the tip's deviation dp across the needle are,
// along each axis of {A}, with the bend's direction u, |u| <= 1, over the way s that the tip travelled, to and fro,
//     dh = k int u dl,   dp = k int a u dl,   a = l_1 - l(s),
// a being the lever by which a change of heading at l moves the tip at the end l_1. The way is at most P = V dt; with
// the net insertion D it leads beyond the ends by E = (P - |D|) / 2. By Cauchy and Schwarz, for any u and any weights
// alpha, beta,
//     (alpha dh + beta dp)^2 <= k^2 P int (alpha + beta a)^2 ds,
// summed over both axes if |u| is that of both. With the bevel's roll unknown each axis has half of it:
//     Q = k^2 P / 2 [ P        int a ds   ]  =  k^2 P / 2 [ P        D P / 2                    ]
//                   [ int a ds int a^2 ds ]               [ D P / 2  (E^3 + (|D| + E)^3) / 3    ]
// where the integrals are those of the longest excursion, the mean of one beyond the start and one beyond the end. For
// a path with these integrals dx^T Q^-1 dx <= 2 over both axes, whatever the bevel did: half of the four degrees of
// freedom. k^2 is the second moment, k^2 + var k. The tip is less deep
// by at most int |dh|^2 / 2 ds = k^2 P^3 / 6. Process noise is that of the whole way and of all that the shaft can have
// turned, W dt. A wind-up leaves the tip's lag anywhere within its play.
//
// With effects, whose memory has to follow the axes, the mean is the interpolated path; |u - u_interpolated| <= 2 then
// makes Q four times as large.
#include <algorithm>
#include <cmath>

#include <bevel/estimator/error_state.hpp>
#include <bevel/estimator/propagate.hpp>

namespace bevel::estimator {
namespace {

// A heading that is wider than the slip law's domain, 1 rad, is not known at all; more makes no difference but to
// arithmetic.
constexpr double kWidestTilt_rad = 1;

double square(double x) { return x * x; }
double cube(double x) { return x * x * x; }

}  // namespace

template <int kSize>
bool NeedleFilter::cut_straight_sized(FilterState& state, double insertion_mm) const {
  model::NeedleJacobian J;
  if (!model::advance(state.pose, {insertion_mm, 0, {0, 0}}, slip_of(state), J)) return false;
  J.needle.col(0).setZero();  // no bend, whatever k is; the tenth of a stiff shaft goes with the bend
  if (stiff_) J.needle.col(3).setZero();
  if (coloured_ || has_nuisance_) carry_shared<kSize>(state, J.pose, J.needle.leftCols<kSize - 6>());
  Covariance<kSize> P = covariance_of<kSize>(state);
  propagate<kSize>(P, J.pose, J.needle.leftCols<kSize - 6>());
  set_covariance<kSize>(state, P);
  return true;
}

void NeedleFilter::cut_straight(FilterState& state, double insertion_mm) const {
  if (insertion_mm == 0) return;
  state.outside_model =
      !(ten_states_ ? cut_straight_sized<10>(state, insertion_mm) : cut_straight_sized<9>(state, insertion_mm));
}

void NeedleFilter::widen_by_gap(FilterState& state, double insertion_mm, double rotation_rad, double duration_s) const {
  const double k2 = square(state.curvature_per_mm) + std::max(state.covariance(6, 6), 0.0);
  const double net_mm = std::abs(insertion_mm);
  const double widest_mm = std::max(std::sqrt(2 / std::max(k2, 1e-12)) * kWidestTilt_rad, net_mm);
  const double way_mm = std::clamp(config_.axes.insertion_rate_mm_s * duration_s, net_mm, widest_mm);
  const double beyond_mm = (way_mm - net_mm) / 2;
  const double turned_rad = std::max(config_.axes.rotation_rate_rad_s * duration_s, std::abs(rotation_rad));
  const double share = (config_.effects.empty() ? 0.5 : 2.0) * k2 * way_mm;
  widen_pose(state, {share * (cube(beyond_mm) + cube(net_mm + beyond_mm)) / 3, share * insertion_mm * way_mm / 2,
                     share * way_mm, square(k2 * cube(way_mm) / 6)});
  state.covariance.diagonal() += process_variance<9>(state.covariance, way_mm, turned_rad);
  const double play_rad =
      std::max(state.nuisance.mean[kWindup], 0.0) * square(std::max(state.nuisance.inserted_mm, 0.0) / 100);
  state.covariance(5, 5) += square(2 * play_rad);
}

}  // namespace bevel::estimator
