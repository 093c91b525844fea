// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/curve_tangent.hpp>

#include <atomic>

#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

std::shared_ptr<const CurveTangent> make_tangent(const System& system, const TangentPoint& beside,
                                                 std::vector<CurveValues> about) {
  auto out = std::make_shared<CurveTangent>();
  Eigen::Index count = 0;
  for (const CurveValues& one : about) count += one.values.size();
  out->values.resize(count);
  count = 0;
  for (const CurveValues& one : about) {
    out->values.segment(count, one.values.size()) = one.values;
    count += one.values.size();
  }
  out->about = std::move(about);
  out->by_values.resize(beside.local.size());
  std::atomic<bool> valid = true;
  parallel_for(beside.local.size(), [&](std::size_t r) {
    Prediction prediction;
    if (valid && !system.predict_with(beside.set, r, beside.shared, beside.local[r], out->about, false, prediction,
                                      &out->by_values[r]))
      valid = false;
  });
  return valid ? out : nullptr;
}

}  // namespace bevel::inference
