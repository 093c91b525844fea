// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/prediction_memo.hpp>

#include <algorithm>

namespace bevel::inference {
namespace {

constexpr std::size_t kKept = 4;  // of a recording: two that a thread goes to and fro between, for each of two threads

bool same(const Eigen::VectorXd& a, const Eigen::VectorXd& b) { return a.size() == b.size() && a == b; }

}  // namespace

PredictionMemo::PredictionMemo(const System& system) : system_(&system), recordings_(system.data().recordings.size()) {}

std::shared_ptr<const Prediction> PredictionMemo::predict(const ModelSet& set, std::size_t recording,
                                                          const Eigen::VectorXd& shared, const Eigen::VectorXd& local,
                                                          bool derivatives,
                                                          const std::shared_ptr<const CurveTangent>& tangent) {
  OfRecording& here = recordings_[recording];
  const auto made = [&](Prediction& out) {
    return tangent ? system_->predict_with(set, recording, shared, local, tangent->about, derivatives, out, nullptr)
                   : system_->predict(set, recording, shared, local, derivatives, out);
  };
  // Without derivatives a path is cheap, and a scan does not come back to one.
  if (!derivatives) {
    const auto prediction = std::make_shared<Prediction>();
    return made(*prediction) ? prediction : nullptr;
  }
  const auto find = [&]() -> std::shared_ptr<const Prediction> {
    const auto at = std::ranges::find_if(here.known, [&](const Known& one) {
      return one.set == set && one.tangent == tangent && same(one.shared, shared) && same(one.local, local);
    });
    if (at == here.known.end()) return nullptr;
    std::rotate(here.known.begin(), at, at + 1);
    return here.known.front().prediction;
  };
  {
    const std::scoped_lock lock(here.mutex);
    if (auto known = find()) return known;
  }
  const auto prediction = std::make_shared<Prediction>();
  if (!made(*prediction)) return nullptr;
  const std::scoped_lock lock(here.mutex);
  if (auto known = find()) return known;  // by another thread meanwhile
  if (here.known.size() == kKept) here.known.pop_back();
  here.known.insert(here.known.begin(),
                    {.set = set, .shared = shared, .local = local, .tangent = tangent, .prediction = prediction});
  return prediction;
}

}  // namespace bevel::inference
