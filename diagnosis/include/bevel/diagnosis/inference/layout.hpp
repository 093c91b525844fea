// SPDX-License-Identifier: MIT
#pragma once
// Which unknown stands where, for one set of effects.
#include <bevel/diagnosis/inference/system.hpp>

namespace bevel::inference {

// One unknown: a parameter of the base (member -1) or of a member of the set, or a nuisance (parameter null).
struct Unknown {
  int member = -1;
  int index = -1;  // of the parameter in its effect, or of the nuisance
  const Parameter* parameter = nullptr;
};

// The earliest that what happens in a recording does.
inline constexpr double kEarliest_s = 0.004;

class Layout {
 public:
  Layout(const System& system, ModelSet set);

  const System& system() const { return *system_; }
  const ModelSet& set() const { return set_; }
  const std::vector<Unknown>& shared() const { return shared_; }
  const std::vector<Unknown>& local() const { return local_; }
  // Index into shared() or local(), or -1.
  int find_shared(std::size_t member, std::size_t parameter) const { return find(shared_, member, parameter); }
  int find_local(std::size_t member, std::size_t parameter) const { return find(local_, member, parameter); }
  bool is_instant(std::size_t local) const;
  // All but an instant at which readings jump.
  bool is_fitted(std::size_t local) const;
  // A phase or an instant: what has many local minima and is scanned.
  bool is_scanned(std::size_t local) const { return local_[local].parameter != nullptr; }
  // Largest value of a local unknown in a recording: an instant lies within it.
  double upper(std::size_t local, std::size_t recording) const;

  // Amplitudes at "none", the rest at the first of their starts; base parameters in the middle of their priors.
  Eigen::VectorXd shared_start() const;
  Eigen::VectorXd local_start() const { return Eigen::VectorXd::Zero(static_cast<Eigen::Index>(local_.size())); }
  // Values of another layout carried over, effect by effect; the rest from the start.
  Eigen::VectorXd shared_from(const Layout& other, const Eigen::VectorXd& values) const;
  Eigen::VectorXd local_from(const Layout& other, const Eigen::VectorXd& values) const;
  // Back within the bounds, an instant that is one never at none; angles by whole turns, with the angles that go with
  // them (Parameter::half_turns).
  void clamp(Eigen::VectorXd& shared, std::vector<Eigen::VectorXd>& local) const;

 private:
  static int find(const std::vector<Unknown>& unknowns, std::size_t member, std::size_t parameter);
  int place_in(const Layout& other, const Unknown& unknown, bool shared) const;

  const System* system_;
  ModelSet set_;
  std::vector<Unknown> shared_, local_;
};

ModelSet with(const ModelSet& set, std::size_t effect);
ModelSet without(const ModelSet& set, std::size_t effect);
bool contains(const ModelSet& set, std::size_t effect);
std::string describe(const System& system, const ModelSet& set);  // "layer + drilling", "nothing"

}  // namespace bevel::inference
