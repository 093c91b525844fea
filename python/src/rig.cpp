// SPDX-License-Identifier: MIT
#include <cmath>
#include <memory>
#include <utility>

#include <bevel/error.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/model/beam/beam_plant.hpp>
#include <bevel/model/effects/variation.hpp>
#include <bevel/rig/plant/plant.hpp>
#include "arrays.hpp"
#include "module.hpp"
#include "simulated_rig.hpp"

namespace bevel::python {
namespace {

using Sigma = std::variant<double, Vector3>;

SimulatedRig::Noise noise_of(const Sigma& sigma, double heading_rad) {
  SimulatedRig::Noise noise{std::holds_alternative<double>(sigma) ? Eigen::Vector3d::Constant(std::get<double>(sigma))
                                                                  : to_eigen(std::get<Vector3>(sigma)),
                            heading_rad};
  for (const double sd : {noise.sigma_mm[0], noise.sigma_mm[1], noise.sigma_mm[2], heading_rad})
    if (!(sd > 0))
      throw ArgumentError("a standard deviation of the noise is " + std::to_string(sd) +
                          "; allowed: above 0, inf for an axis that is not measured");
  return noise;
}

std::unique_ptr<rig::Plant> kinematic_plant(const io::ModelFile& model, double roll_rad, bool through_channel,
                                            std::uint64_t seed) {
  const model::OwnValues own = model.variation ? model::draw(*model.variation, seed) : model::OwnValues{};
  return std::make_unique<rig::KinematicPlant>(model.needle, io::active_effects(model, ""), roll_rad, own,
                                               through_channel ? rig::Cut::kept : rig::Cut::forgotten);
}

SimulatedRig beam_rig(double modulus_kPa, double force_N, double stiffness_N_mm2, double guide_gap_mm,
                      const Sigma& noise_mm, double heading_noise_rad, std::uint64_t seed) {
  model::BeamPlantConfig config;
  config.foundation_modulus_kPa = modulus_kPa;
  config.bevel_force_N = force_N;
  config.bending_stiffness_N_mm2 = stiffness_N_mm2;
  config.guide_gap_mm = guide_gap_mm;
  return {std::make_unique<rig::BeamNeedle>(config), noise_of(noise_mm, heading_noise_rad), seed};
}

}  // namespace

void bind_rig(nb::module_& m) {
  nb::class_<SimulatedRig>(m, "Rig",
                           "A simulated insertion: axes are moved, the tip is measured with noise, all is recorded.\n\n"
                           "Equal seeds give equal insertions.")
      .def(
          "__init__",
          [](SimulatedRig* self, const io::ModelFile& model, const Sigma& noise_mm, double heading_noise_rad,
             std::uint64_t seed, double roll_rad, bool through_channel) {
            new (self) SimulatedRig(kinematic_plant(model, roll_rad, through_channel, seed),
                                    noise_of(noise_mm, heading_noise_rad), seed);
          },
          "model"_a, nb::kw_only(), "noise_mm"_a = 0.2, "heading_noise_rad"_a = 0.01, "seed"_a = 1, "roll_rad"_a = 0.0,
          "through_channel"_a = true,
          nb::sig("def __init__(self, model: Model | Needle, *, noise_mm: float | "
                  "collections.abc.Sequence[float] = 0.2, heading_noise_rad: float = 0.01, seed: int = 1, "
                  "roll_rad: float = 0.0, through_channel: bool = True) -> None"),
          "Args:\n"
          "    model: the true needle, with the effects that act on it. Where the model has a variation, this "
          "insertion "
          "draws its own values from it.\n"
          "    noise_mm: standard deviation of a measured position, mm: one number, or one for each axis of {A}; inf: "
          "not measured.\n"
          "    heading_noise_rad: standard deviation of a measured heading, rad.\n"
          "    seed: of the noise and of the variation.\n"
          "    roll_rad: roll of the bevel at the start, rad.\n"
          "    through_channel: a retracted needle follows the channel that it has cut; without effects only.")
      .def_static("beam", &beam_rig, nb::kw_only(), "modulus_kPa"_a = 20.0, "force_N"_a = 0.5,
                  "stiffness_N_mm2"_a = 1.6e4, "guide_gap_mm"_a = 15.0, "noise_mm"_a = 0.2,
                  "heading_noise_rad"_a = 0.01, "seed"_a = 1,
                  nb::sig("def beam(*, modulus_kPa: float = 20.0, force_N: float = 0.5, stiffness_N_mm2: float = "
                          "16000.0, guide_gap_mm: float = 15.0, noise_mm: float | collections.abc.Sequence[float] = "
                          "0.2, heading_noise_rad: float = 0.01, seed: int = 1) -> Rig"),
                  "Makes a rig whose needle is a beam in elastic tissue: a plant that differs from the kinematic "
                  "model.\n\n"
                  "Args:\n"
                  "    modulus_kPa: modulus of the elastic foundation, kPa.\n"
                  "    force_N: lateral force on the bevel, N.\n"
                  "    stiffness_N_mm2: bending stiffness EI of the shaft, N mm^2.\n"
                  "    guide_gap_mm: distance from the guide to the tissue, mm.")
      .def("move", &SimulatedRig::move, "insertion_mm"_a, "rotation_rad"_a = 0.0, "duration_s"_a = 0.01,
           "Moves the axes by increments at constant rates, and records an axis sample at the end.\n\n"
           "Raises:\n"
           "    DomainError: the needle would leave the domain of the slip law (Eq. 25).")
      .def(
          "follow",
          [](SimulatedRig& self, const AxisMotion& motion, double camera_hz, bool headings) {
            const nb::gil_scoped_release release;
            self.follow(motion, camera_hz, headings);
          },
          "motion"_a, "camera_hz"_a = 30.0, "headings"_a = false,
          "Moves the axes by the increments of a motion, and measures at a fixed rate.\n\n"
          "Args:\n"
          "    motion: motion of the axes, relative to its first sample.\n"
          "    camera_hz: measurements per second; each is taken at the next axis sample. 0: none.\n"
          "    headings: measure the heading too.")
      .def("measure_position", &SimulatedRig::measure_position,
           "Measures the position now, mm, shape (3,); NaN along an axis that is not measured.")
      .def("measure_heading", &SimulatedRig::measure_heading, "Measures the heading now, unit vector, shape (3,).")
      .def("recording", &SimulatedRig::recording, "name"_a = "rig.lcm",
           "Returns everything since the start as a Recording, true states included.")
      .def_prop_ro("time_s", &SimulatedRig::time_s, "Time since the start, s.")
      .def_prop_ro("insertion_mm", &SimulatedRig::insertion_mm, "Insertion, mm.")
      .def_prop_ro("rotation_rad", &SimulatedRig::rotation_rad, "Rotation of the shaft, rad.")
      .def_prop_ro(
          "tip_mm", [](const SimulatedRig& self) { return self.plant().tip().p_mm; },
          "True tip in {A}, mm, shape (3,).")
      .def_prop_ro(
          "tip_rotation", [](const SimulatedRig& self) { return self.plant().tip().R; },
          "True orientation of {B} in {A}, shape (3, 3).")
      .def_prop_ro(
          "shaft_mm", [](const SimulatedRig& self) { return stack(self.plant().shaft_mm()); },
          "True axis of the shaft from the entry point to the tip, {A}, mm, shape (n, 3).")
      .def_prop_ro(
          "needle", [](const SimulatedRig& self) { return self.plant().model().needle(); },
          "True needle; of a beam the bicycle that it is deep in uniform tissue.");
}

}  // namespace bevel::python
