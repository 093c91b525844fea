// SPDX-License-Identifier: MIT
#pragma once
// How much of what is concealed can be seen at all: the part of its change of the paths that k, lambda1 and lambda2
// cannot absorb, nor variation between insertions where there is any, in standard deviations of the noise, summed over
// a trial (the root of the sum of squares of the whitened difference).
#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "proof/camera_noise.hpp"
#include "proof/insertion_variation.hpp"
#include "proof/needle_path.hpp"

namespace bevel::proof {

// The recordings of a trial, but for the noise.
struct Setting {
  std::vector<AxisMotion> motions;
  std::vector<Frames> frames;
  std::vector<Whitener> whiteners;
  DriveRipple ripple;
  std::vector<InsertionVariation> variation;  // per recording; empty: none
  std::vector<Absorber> absorbers;            // of such variation; empty: none
  std::vector<bool> changed;                  // of two groups: where physics act; empty: everywhere
};

using Views = std::vector<Eigen::Matrix3Xd>;  // one a recording

Views views_of(const Setting& setting, const BaseNeedle& needle, const HiddenPhysics& physics);
// One Absorber a recording, for variation of this spread about a needle.
std::vector<Absorber> find_absorbers(const Setting& setting, const BaseNeedle& needle, const VariationSpread& spread);
Eigen::VectorXd whitened_difference(const Setting& setting, const Views& a, const Views& b);

struct Refit {
  BaseNeedle needle;  // k, lambda1, lambda2 refitted, ell as it was
  double sigmas = 0;  // what is left
  bool converged = false;
};
// Gauss-Newton with finite differences: the needle that comes closest to `seen`, `known` physics given.
Refit refit_base(const Setting& setting, const Views& seen, const BaseNeedle& start, const HiddenPhysics& known);

// A listed effect (plain form, k, lambda1, lambda2 refitted along with its own parameters) that comes closer to `seen`
// than `limit_sigmas`: from these recordings nobody can tell it from what was really concealed.
struct Rival {
  std::string name;
  double sigmas;
};
std::vector<Rival> find_rivals(const Setting& setting, const Views& seen, const BaseNeedle& start, double limit_sigmas);

// Parameters, effect by effect, at which the plain forms of `effects` come closest to `seen`, k, lambda1 and lambda2
// refitted along: what an estimate by the plain form would come to without noise.
std::vector<std::map<std::string, double>> nearest_plain(const Setting& setting, const Views& seen,
                                                         const BaseNeedle& start,
                                                         const std::vector<ConcealedEffect>& effects);

// Part of a whitened difference that no small change of k, lambda1, lambda2 makes.
class BaseTangent {
 public:
  BaseTangent(const Setting& setting, const BaseNeedle& needle, const HiddenPhysics& physics);
  void also(const Eigen::VectorXd& direction);  // takes another direction out as well
  double norm_beyond(const Eigen::VectorXd& difference) const;

 private:
  std::vector<Eigen::VectorXd> basis_;  // orthonormal
};

}  // namespace bevel::proof
