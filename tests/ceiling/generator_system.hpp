// SPDX-License-Identifier: MIT
#pragma once
// The generator of the validation as a system of the inference engine (bevel/diagnosis/inference/system.hpp). It has a
// separate integrator and separate forms of the effects, including unmodelled ones, under the needle's priors.
// What the tool is measured against, so it belongs to neither room: proof/ and diagnosis/ meet here alone.
//
// Of one trial it has what the logs do not say: the share of the physical forms (HiddenPhysics::departure) and the
// axes' motion at 1 kHz. The drives' periodic errors are unknown to it, as to the tool, unless they are given.
#include <mutex>

#include <bevel/diagnosis/needle/needle_system.hpp>
#include "proof/trial.hpp"

namespace bevel::ceiling {

// Where a parameter of an effect acts in the generator.
struct Slot {
  double proof::HiddenPhysics::*physics = nullptr;
  double model::BeamPlantConfig::*beam = nullptr;
  bool logarithmic = false;  // the unknown is the logarithm of the value
  // Of the differences for its derivative; where readings depend on it in steps (an event that falls on a millisecond)
  // so wide that many lie within, to both sides.
  double step = 0;
  bool in_steps = false;
  // What the generator draws it from: a shape uniform, a size as in generator_prior.hpp.
  bool is_size = false;
  proof::ParameterRange range{};
};

class GeneratorSystem final : public inference::System {
 public:
  // Readings, base, nuisances and curves are those of `needle`, made of this trial's logs; it must live as long.
  // Throws ArgumentError where a reading has no frame of the trial.
  GeneratorSystem(const diagnosis::NeedleSystem& needle, const proof::Trial& trial,
                  const proof::DriveRipple& ripple = {});

  const inference::Dataset& data() const override { return needle_.data(); }
  const std::vector<inference::Parameter>& base() const override { return needle_.base(); }
  // The catalogue's kinds by their names (lost_steps twice: of rotation, of insertion), tip_swing and beam_relaxation:
  // the beam in the place of the bicycle.
  const std::vector<inference::Effect>& effects() const override { return effects_; }
  const std::vector<inference::Nuisance>& nuisances() const override { return needle_.nuisances(); }
  const std::vector<inference::NuisanceGroup>& nuisance_groups() const override { return needle_.nuisance_groups(); }
  const std::vector<inference::Curve>& curves() const override { return needle_.curves(); }
  bool allows(const inference::ModelSet& set) const override;
  // Derivatives by differences, columns of instants zero. They are kept from one point to the next as long as the
  // unknowns moved little and they foretell the readings there: a chord in the place of a tangent, for a tenth of the
  // time.
  bool predict(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
               const Eigen::VectorXd& local, bool derivatives, inference::Prediction& out) const override;
  Eigen::VectorXd by_inputs(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                            const Eigen::VectorXd& local) const override;
  Eigen::MatrixXd by_curves(std::size_t recording, const Eigen::VectorXd& base) const override {
    return needle_.by_curves(recording, base);
  }

  // In the order of the effect's parameters.
  const std::vector<Slot>& slots(std::size_t effect) const { return slots_[effect]; }
  bool on_a_list(std::size_t effect) const { return effects_[effect].name != "unknown"; }
  // The effect that has this name (of one on no list: this kind) and these parameters, or -1.
  int find(const proof::ConcealedEffect& effect) const;

 private:
  struct Plant {
    proof::BaseNeedle needle;
    proof::HiddenPhysics physics;
    model::BeamPlantConfig beam;
    bool is_beam = false;
    proof::InsertionVariation own;
  };
  struct Tangent {
    std::mutex mutex;
    inference::ModelSet set;
    Eigen::VectorXd shared, local;
    inference::Prediction prediction;
  };
  void add_kinds();
  void add_beam();
  bool differentiate(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                     const Eigen::VectorXd& local, inference::Prediction& out) const;
  // By how much unknowns may move before derivatives are sought again.
  Eigen::VectorXd reach_of_shared(const inference::ModelSet& set) const;
  bool still_holds(const Tangent& tangent, const inference::ModelSet& set, const Eigen::VectorXd& shared,
                   const Eigen::VectorXd& local, const Eigen::VectorXd& reading) const;
  Plant plant_of(const inference::ModelSet& set, const Eigen::VectorXd& shared, const Eigen::VectorXd& local) const;
  // False outside the model's domain.
  bool read(const proof::Setting& setting, const Plant& plant, std::size_t recording, Eigen::VectorXd& out) const;

  const diagnosis::NeedleSystem& needle_;
  double wheelbase_mm_, departure_;
  std::vector<proof::Setting> settings_;          // one a recording
  std::vector<std::vector<Eigen::Index>> frame_;  // per recording: of each row
  std::vector<Eigen::MatrixX3d> axis_;            // per recording: of each row
  std::vector<inference::Effect> effects_;
  std::vector<std::vector<Slot>> slots_;
  mutable std::vector<Tangent> tangents_;  // one a recording
};

}  // namespace bevel::ceiling
