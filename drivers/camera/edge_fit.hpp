#pragma once
// Where a needle ends along its own direction. The darkness integrated across the needle is full on the shaft, falls
// over the length of the bevel and is zero beyond the tip, all blurred by the lens:
//   m(s) = base + height * [R(tip - s) - R(tip - taper - s)] / taper,  R(x) = x Phi(x/blur) + blur phi(x/blur)
// (the integral of the Gaussian step; for taper -> 0 the plain blurred edge, height * Phi((tip - s)/blur)). How fast a
// bevel fades depends on its roll and on the light, so the taper is fitted too: the tip is where the darkness ends, not
// where it is halved.
#include <span>

namespace bevel::camera {

struct EdgeFit {
  bool converged = false;
  double tip_px = 0.0;            ///< arc length of the foremost point, in the unit and origin of `s`
  double tip_variance_px2 = 0.0;  ///< from the residuals; already inflated by their correlation
  double height = 0.0;
  double base = 0.0;
  double taper_px = 0.0;
  double blur_px = 0.0;
  double residual = 0.0;  ///< root mean square, weighted
};

struct EdgeGuess {
  double tip_px = 0.0;
  double height = 0.0;    ///< darkness of the shaft
  double taper_px = 0.0;  ///< of the bevel
  double blur_px = 1.0;   ///< of the lens, as measured across the shaft, where nothing tapers
};

/// Levenberg-Marquardt over (tip, height, base, log blur, log taper) with Huber weights. Where a bevel fades slowly
/// into the background these trade off, so all but the tip carry a prior: height as guessed +-15 %, base 0 +-3 gray,
/// blur as guessed +-20 %, taper as guessed within a factor of 1.5. `s` and `profile` have equal length, at least 8;
/// evenly spaced by one pixel.
EdgeFit fit_edge(std::span<const double> s, std::span<const double> profile, const EdgeGuess& guess,
                 double correlation_px);

}  // namespace bevel::camera
