// SPDX-License-Identifier: MIT
#pragma once
// What a system predicted last. A mode is fitted, linearised, judged by a new noise and fitted on from where it is: the
// noise changes, what the system predicts there does not, and predicting is most of what all of it costs.
#include <memory>
#include <mutex>

#include <bevel/diagnosis/inference/curve_tangent.hpp>

namespace bevel::inference {

class PredictionMemo {
 public:
  explicit PredictionMemo(const System& system);
  // As System::predict(), or predict_with() where the tangent's curves have its values; null outside the model's
  // domain. Thread-safe. The same to the last bit whether or not it was asked before.
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
    std::vector<Known> known;  // the last asked first
  };
  const System* system_;
  std::vector<OfRecording> recordings_;
};

}  // namespace bevel::inference
