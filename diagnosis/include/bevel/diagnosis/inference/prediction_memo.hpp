// SPDX-License-Identifier: MIT
/// @file
/// Cache of a system's latest predictions. A mode is fitted, linearised, evaluated with new noise and fitted again from
/// the same place: the noise changes, the predictions do not, and predictions are most of the cost.
#pragma once
#include <memory>
#include <mutex>

#include <bevel/diagnosis/inference/curve_tangent.hpp>

namespace bevel::inference {

/// Cache of predictions, per recording.
class PredictionMemo {
 public:
  /// Makes an empty cache.
  /// @param system Model; must outlive this object.
  explicit PredictionMemo(const System& system);
  /// Predicts as System::predict(), or as predict_with() with the tangent's curve values. Thread-safe. The result does
  /// not depend on whether it was cached.
  /// @param set Candidate model.
  /// @param recording Index of the recording.
  /// @param shared Shared unknowns.
  /// @param local Local unknowns of the recording.
  /// @param derivatives Whether to compute derivatives; only predictions with derivatives are cached.
  /// @param tangent Curve values; null: no curves.
  /// @return Prediction; null outside the model's domain.
  std::shared_ptr<const Prediction> predict(const ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                                            const Eigen::VectorXd& local, bool derivatives,
                                            const std::shared_ptr<const CurveTangent>& tangent = nullptr);

 private:
  struct Known {
    ModelSet set;
    Eigen::VectorXd shared, local;
    std::shared_ptr<const CurveTangent> tangent;
    std::shared_ptr<const Prediction> prediction;
  };
  struct OfRecording {
    std::mutex mutex;
    std::vector<Known> known;  // most recent first
  };
  const System* system_;
  std::vector<OfRecording> recordings_;
};

}  // namespace bevel::inference
