#pragma once
// The other plant: a beam in elastic tissue that remembers its cut (model/beam). No bicycle describes it exactly.
#include "model/beam/beam_plant.hpp"
#include "proof/needle_path.hpp"

namespace bevel::proof {

model::BeamPlantConfig draw_beam(Random& random);
TipPath travel_beam(const model::BeamPlantConfig& config, const AxisMotion& motion);

}  // namespace bevel::proof
