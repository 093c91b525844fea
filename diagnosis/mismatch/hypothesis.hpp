#pragma once
// A set of effects as a hypothesis about what a model left out: its unknowns, their bounds, and the needle that values
// of them make in one recording.
#include <string>
#include <vector>

#include "diagnosis/mismatch/recorded_case.hpp"

namespace bevel::diagnosis {

struct Member {
  const model::Effect* effect = nullptr;
  std::uint32_t variant = ~0U;  // which of its parameters are fitted, see Effect::variants

  bool operator==(const Member&) const = default;
  bool fits(std::size_t parameter) const { return (variant >> parameter & 1U) != 0; }
};
using EffectSet = std::vector<Member>;

std::string describe(const EffectSet& set);  // "layer + drilling", "nothing"

// Whether the unknowns of a set are few enough for one recording (model::kMaxColumns). A Hypothesis of more throws.
bool can_be_fitted(const EffectSet& set);

// The first three unknowns are always k, u and lambda2, with u = lambda1 - lambda2^2/(2 pi) >= 0: the domain (26) as a
// bound. ell is the model file's.
enum BaseUnknown : int { kUnknownK, kUnknownU, kUnknownLambda2, kBaseUnknowns };

struct Unknown {
  int member = -1;     // of the set; -1: the needle's own
  int parameter = -1;  // of the effect
  int recording = -1;  // of the case, where each has its own; -1: all
  double lower = 0, upper = 0;
  bool periodic = false;
};

class Hypothesis {
 public:
  Hypothesis(const model::NeedleParameters& needle, EffectSet set, const RecordedCase& recorded);

  const EffectSet& set() const { return set_; }
  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(unknowns_.size()); }
  // Index of an unknown, or -1 where the parameter is not fitted.
  int find(std::size_t member, std::size_t parameter, int recording = -1) const;

  // The needle of the model file, and every effect at the first of its starts (amplitudes at "none").
  Eigen::VectorXd start() const;
  // Values of another hypothesis carried over, member by member; the rest from start().
  Eigen::VectorXd start_from(const Hypothesis& other, const Eigen::VectorXd& values) const;
  // Back within the bounds; angles by whole turns, and the angles that go with them (EffectParameter::half_turns).
  void clamp(Eigen::VectorXd& values) const;

  // Which unknowns move one recording, in the order of the columns of make_needle.
  const std::vector<int>& columns(std::size_t recording) const { return columns_[recording]; }
  model::AugmentedNeedle make_needle(std::size_t recording, const Eigen::VectorXd& values, bool with_columns) const;
  model::NeedleParameters needle(const Eigen::VectorXd& values) const;
  double parameter(const Eigen::VectorXd& values, std::size_t member, std::size_t parameter, int recording = -1) const;

 private:
  void turn_partners(const Unknown& turned, Eigen::VectorXd& values) const;

  model::NeedleParameters needle_;
  EffectSet set_;
  std::vector<Unknown> unknowns_;
  std::vector<std::vector<int>> columns_;
};

}  // namespace bevel::diagnosis
