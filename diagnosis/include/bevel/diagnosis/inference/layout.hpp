// SPDX-License-Identifier: MIT
/// @file
/// Order of the unknowns of one candidate model.
#pragma once
#include <bevel/diagnosis/inference/system.hpp>

namespace bevel::inference {

/// One unknown: a parameter of the nominal model or of a member, or an insertion-specific parameter.
struct Unknown {
  int member = -1;  ///< Position of the effect in the candidate model; -1: nominal model.
  int index = -1;   ///< Index of the parameter in its effect, or of the insertion-specific parameter.
  const Parameter* parameter = nullptr;  ///< Parameter; null: insertion-specific parameter.
};

/// Earliest event time in a recording, in s.
inline constexpr double kEarliest_s = 0.004;

/// Order of the shared and the local unknowns of a candidate model.
class Layout {
 public:
  /// Makes the layout of a candidate model.
  /// @param system Model; must outlive this object and its copies.
  /// @param set Candidate model.
  Layout(const System& system, ModelSet set);

  /// Returns the model.
  /// @return Argument of the constructor.
  const System& system() const { return *system_; }
  /// Returns the candidate model.
  /// @return Argument of the constructor.
  const ModelSet& set() const { return set_; }
  /// Returns the shared unknowns: nominal model, then members.
  /// @return Unknowns in order.
  const std::vector<Unknown>& shared() const { return shared_; }
  /// Returns the local unknowns: insertion-specific parameters, then members.
  /// @return Unknowns in order.
  const std::vector<Unknown>& local() const { return local_; }
  /// Finds a shared unknown.
  /// @param member Position of the effect in set().
  /// @param parameter Index of the parameter in its effect.
  /// @return Index into shared(); -1 if it is not there.
  int find_shared(std::size_t member, std::size_t parameter) const { return find(shared_, member, parameter); }
  /// Finds a local unknown.
  /// @param member Position of the effect in set().
  /// @param parameter Index of the parameter in its effect.
  /// @return Index into local(); -1 if it is not there.
  int find_local(std::size_t member, std::size_t parameter) const { return find(local_, member, parameter); }
  /// Tests whether a local unknown is an event time.
  /// @param local Index into local().
  /// @return True for Scope::instant.
  bool is_instant(std::size_t local) const;
  /// Tests whether fits move a local unknown: all but event times at which the predictions jump.
  /// @param local Index into local().
  /// @return True if it is fitted.
  bool is_fitted(std::size_t local) const;
  /// Tests whether a local unknown is a phase or an event time. These have many local minima and are scanned.
  /// @param local Index into local().
  /// @return True if it is scanned.
  bool is_scanned(std::size_t local) const { return local_[local].parameter != nullptr; }
  /// Computes the upper bound of a phase or an event time in a recording. An event time is within the recording.
  /// @param local Index into local() of a scanned unknown.
  /// @param recording Index of the recording.
  /// @return Upper bound, in the parameter's unit.
  double upper(std::size_t local, std::size_t recording) const;

  /// Computes start values: parameters with a `none` at it, other effect parameters at their first start, nominal
  /// parameters at the centre of their priors.
  /// @return Values of shared().
  Eigen::VectorXd shared_start() const;
  /// Computes start values of the local unknowns.
  /// @return Zeros, as many as local().
  Eigen::VectorXd local_start() const { return Eigen::VectorXd::Zero(static_cast<Eigen::Index>(local_.size())); }
  /// Transfers shared unknowns from another layout, effect by effect; the others have their start values.
  /// @param other Other layout.
  /// @param values Values of other.shared().
  /// @return Values of shared().
  Eigen::VectorXd shared_from(const Layout& other, const Eigen::VectorXd& values) const;
  /// Transfers local unknowns of a recording from another layout; the others have their start values.
  /// @param other Other layout.
  /// @param values Values of other.local().
  /// @return Values of local().
  Eigen::VectorXd local_from(const Layout& other, const Eigen::VectorXd& values) const;
  /// Moves values back within their bounds. An event time other than 0 stays at least kEarliest_s. Angles change by
  /// whole turns, together with their partners (Parameter::half_turns).
  /// @param[in,out] shared Values of shared().
  /// @param[in,out] local Values of local(), per recording.
  void clamp(Eigen::VectorXd& shared, std::vector<Eigen::VectorXd>& local) const;

 private:
  static int find(const std::vector<Unknown>& unknowns, std::size_t member, std::size_t parameter);
  int place_in(const Layout& other, const Unknown& unknown, bool shared) const;

  const System* system_;
  ModelSet set_;
  std::vector<Unknown> shared_, local_;
};

/// Adds an effect to a candidate model.
/// @param set Candidate model without the effect.
/// @param effect Index into System::effects().
/// @return Ascending indices.
ModelSet with(const ModelSet& set, std::size_t effect);
/// Removes an effect from a candidate model.
/// @param set Candidate model.
/// @param effect Index into System::effects().
/// @return Ascending indices.
ModelSet without(const ModelSet& set, std::size_t effect);
/// Tests whether a candidate model contains an effect.
/// @param set Candidate model.
/// @param effect Index into System::effects().
/// @return True if it does.
bool contains(const ModelSet& set, std::size_t effect);
/// Describes a candidate model by the labels of its effects.
/// @param system Model.
/// @param set Candidate model.
/// @return For example "layer + drilling"; "nothing" for the empty set.
std::string describe(const System& system, const ModelSet& set);

}  // namespace bevel::inference
