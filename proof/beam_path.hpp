// SPDX-License-Identifier: MIT
#pragma once
// The beam plant in the trials: what it is drawn from, the tip's path, and the beam in elastic tissue closest to a
// path.
#include <map>
#include <string>

#include <bevel/model/beam/beam_plant.hpp>
#include "proof/needle_path.hpp"
#include "proof/visibility.hpp"

namespace bevel::proof {

model::BeamPlantConfig draw_beam(Random& random);
TipPath travel_beam(const model::BeamPlantConfig& config, const AxisMotion& motion);

// What the cameras see of it, without noise. A beam's guide stands as it stands: where insertions differ in the entry,
// the whole path is turned, and about z for the roll; the curvature's share is the bevel force's.
Views views_of(const Setting& setting, const model::BeamPlantConfig& config);

// As the effect tip_swing names a beam: bending_mm = 1 / lambda = (4 EI / k)^(1/4), and guide_mm.
std::map<std::string, double> swing_of(const model::BeamPlantConfig& config);

// The beam in tissue that does not relax that comes closest to `seen`: modulus, force and gap refitted from `start`.
struct ElasticFit {
  model::BeamPlantConfig beam;
  double sigmas = 0;  // what is left
};
ElasticFit nearest_elastic(const Setting& setting, const Views& seen, const model::BeamPlantConfig& start);

}  // namespace bevel::proof
