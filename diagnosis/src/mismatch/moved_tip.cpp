// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/mismatch/moved_tip.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::diagnosis {
namespace {

bool follow(const NeedleSystem& system, const ModelledTip& model, std::size_t r, model::OpenLoop& path) {
  const model::Motion& motion = system.recorded().recordings[r].motion;
  return system.tip_path(model.layout->set(), motion, static_cast<int>(r), *model.shared, (*model.local)[r],
                         model.discrepancy, path);
}

// The first of the readings that are as deep as any.
std::size_t deepest_reading(const model::Motion& motion) {
  const auto at =
      std::ranges::max_element(motion.at, {}, [&](std::size_t node) { return motion.nodes[node].insertion_mm; });
  return static_cast<std::size_t>(at - motion.at.begin());
}

}  // namespace

double apart_at_depth_mm(const NeedleSystem& system, const ModelledTip& one, const ModelledTip& other) {
  double squares_mm2 = 0;
  std::size_t count = 0;
  model::OpenLoop path, other_path;
  for (std::size_t r = 0; r < system.recorded().recordings.size(); ++r) {
    const Recording& recording = system.recorded().recordings[r];
    if (recording.motion.at.empty() || (system.recorded().two_groups() && !recording.changed)) continue;
    if (!follow(system, one, r, path) || !follow(system, other, r, other_path))
      return std::numeric_limits<double>::quiet_NaN();
    const std::size_t i = deepest_reading(recording.motion);
    squares_mm2 += (path.position_mm[i] - other_path.position_mm[i]).squaredNorm();
    ++count;
  }
  return std::sqrt(squares_mm2 / static_cast<double>(count));
}

double moved_by_member_mm(const NeedleSystem& system, const ModelledTip& model, std::size_t member) {
  const inference::Layout& layout = *model.layout;
  const inference::Layout rest(system, inference::without(layout.set(), layout.set()[member]));
  const Eigen::VectorXd shared = rest.shared_from(layout, *model.shared);
  std::vector<Eigen::VectorXd> local;
  for (const auto& own : *model.local) local.push_back(rest.local_from(layout, own));
  return apart_at_depth_mm(system, model,
                           {.layout = &rest, .shared = &shared, .local = &local, .discrepancy = model.discrepancy});
}

}  // namespace bevel::diagnosis
