#pragma once
// The needle as the engine's client (diagnosis/inference): readings of the cameras from the base's motion, with what
// differs between insertions, the effects of the library, and a discrepancy in each component of the tip's twist and
// of the reading.
#include "diagnosis/inference/system.hpp"
#include "diagnosis/mismatch/recorded_case.hpp"

namespace bevel::diagnosis {

// Shared parameters, in this order; u = lambda1 - lambda2^2/(2 pi) >= 0 is the domain (26) as a bound.
enum BaseParameter : int { kCurvature, kU, kLambda2, kBaseParameters };
// What insertions have of their own: curvature as a share of the needle's, the heading's rotation vector at the entry
// (rad), the bevel's roll there (rad), registration (mm).
enum Variation : int { kOwnCurvature, kTiltX, kTiltY, kRoll, kEntryX, kEntryY, kVariations };

class NeedleSystem final : public inference::System {
 public:
  NeedleSystem(RecordedCase recorded, const model::NeedleParameters& model);

  const RecordedCase& recorded() const { return recorded_; }
  const inference::Dataset& data() const override { return data_; }
  const std::vector<inference::Parameter>& base() const override { return base_; }
  const std::vector<inference::Effect>& effects() const override { return effects_; }
  const std::vector<inference::Nuisance>& nuisances() const override { return nuisances_; }
  const std::vector<inference::NuisanceGroup>& nuisance_groups() const override { return groups_; }
  const std::vector<inference::Curve>& curves() const override { return curves_; }
  bool allows(const inference::ModelSet& set) const override;
  bool predict(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
               const Eigen::VectorXd& local, bool derivatives, inference::Prediction& out) const override;
  Eigen::MatrixXd by_curves(std::size_t recording, const Eigen::VectorXd& base) const override;

 private:
  model::NeedleParameters needle(const Eigen::VectorXd& shared) const;
  Eigen::MatrixXd rows_of(std::size_t recording, const model::OpenLoop& path, bool derivatives) const;

  RecordedCase recorded_;
  model::NeedleParameters model_;
  inference::Dataset data_;
  std::vector<inference::Parameter> base_;
  std::vector<inference::Effect> effects_;
  std::vector<const model::Effect*> physics_;  // of each effect
  std::vector<std::uint32_t> variants_;
  std::vector<inference::Nuisance> nuisances_;
  std::vector<inference::NuisanceGroup> groups_;
  std::vector<inference::Curve> curves_;
  std::vector<std::shared_ptr<const model::Effect>> curve_physics_;  // parts of the curves, in their order
};

}  // namespace bevel::diagnosis
