#pragma once
// Where a needle ends along its own direction. The darkness integrated across the needle is full on the shaft, falls
// over the length of the bevel to a rest, and drops to zero at the tip, all blurred by the lens:
//   m(s) = base + height * {(1 - rest) * [R(tip - s) - R(tip - taper - s)] / taper + rest * Phi((tip - s)/blur)}
//   R(x) = x Phi(x/blur) + blur phi(x/blur), the integral of the Gaussian step Phi
// Seen from the side a bevel runs out to nothing (rest 0), seen onto its face it ends round (rest near 1), and a point
// that shines is paler than it is thin; so taper and rest are fitted. The tip is where the darkness ends, not where it
// is halved.
#include <span>

namespace bevel::camera {

struct EdgeFit {
  bool converged = false;
  double tip_px = 0.0;            ///< arc length of the foremost point, in the unit and origin of `s`
  double tip_variance_px2 = 0.0;  ///< from the residuals; already inflated by their correlation
  double height = 0.0;
  double base = 0.0;
  double taper_px = 0.0;
  double rest = 0.0;  ///< share of the height left just before the tip
  double blur_px = 0.0;
  double residual = 0.0;  ///< root mean square, weighted
};

struct EdgeGuess {
  double tip_px = 0.0;
  double height = 0.0;    ///< darkness of the shaft
  double taper_px = 0.0;  ///< of the bevel
  double blur_px = 1.0;   ///< of the lens, as measured across the shaft, where nothing tapers
};

/// Levenberg-Marquardt over (tip, height, base, log blur, log taper, rest) with Huber weights. Where a bevel fades
/// slowly into the background these trade off, so all but the tip carry a prior: height as guessed +-15 %, base 0 +-3
/// gray, blur as guessed +-20 %, taper as guessed within a factor of 2.2. `s` and `profile` have equal length, at least
/// 8; evenly spaced by one pixel.
EdgeFit fit_edge(std::span<const double> s, std::span<const double> profile, const EdgeGuess& guess,
                 double correlation_px);

}  // namespace bevel::camera
