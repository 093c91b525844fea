// SPDX-License-Identifier: MIT
#include <bevel/analysis/close_loop/rig_figure.hpp>

#include <algorithm>
#include <cmath>

#include <bevel/rig/plant/plant.hpp>

namespace bevel::analysis {
namespace {

// The plant along a recorded motion, to any time: between nodes the base moves evenly.
class Replayed {
 public:
  Replayed(const model::Motion& motion, rig::KinematicPlant& plant)
      : motion_(motion), plant_(plant), at_(motion.nodes.front()) {}

  void advance_to(double time_s) {
    for (; next_ < motion_.nodes.size() && motion_.nodes[next_].time_s <= time_s; ++next_) move(motion_.nodes[next_]);
    if (next_ == motion_.nodes.size() || time_s <= at_.time_s) return;
    const model::BaseMotion& to = motion_.nodes[next_];
    const double share = (time_s - at_.time_s) / (to.time_s - at_.time_s);
    move({time_s, at_.insertion_mm + share * (to.insertion_mm - at_.insertion_mm),
          at_.rotation_rad + share * (to.rotation_rad - at_.rotation_rad)});
  }

 private:
  void move(const model::BaseMotion& to) {
    plant_.advance(to.insertion_mm - at_.insertion_mm, to.rotation_rad - at_.rotation_rad, to.time_s - at_.time_s);
    at_ = to;
  }

  const model::Motion& motion_;
  rig::KinematicPlant& plant_;
  model::BaseMotion at_;
  std::size_t next_ = 1;
};

}  // namespace

std::vector<Eigen::Vector3d> simulate_recording(const diagnosis::Recording& recording, const io::ModelFile& model) {
  rig::KinematicPlant plant(model.needle, io::active_effects(model, recording.name));
  Replayed motion(recording.motion, plant);
  const double late_s = plant.model().latency_s().value;
  std::vector<Eigen::Vector3d> seen;
  for (const std::size_t node : recording.motion.at) {
    motion.advance_to(recording.motion.nodes[node].time_s - late_s);
    model::TipReading reading{plant.tip().p_mm, model::PointColumns(3, 0)};
    plant.model().through_cameras(reading);
    seen.push_back(reading.position_mm);
  }
  return seen;
}

RigFigure simulate_rig(const diagnosis::RecordedCase& recorded, const inference::Noise& noise,
                       const io::ModelFile& model) {
  RigFigure figure;
  double squares = 0, chi2 = 0;
  for (const auto& recording : recorded.recordings) {
    const auto seen = simulate_recording(recording, model);
    double own_squares = 0, own_chi2 = 0;
    std::size_t own = 0;
    for (std::size_t c = 0; c < recorded.channels.size(); ++c) {
      const diagnosis::Series& series = recording.series[c];
      Eigen::VectorXd errors(static_cast<Eigen::Index>(series.message.size()));
      for (std::size_t i = 0; i < series.message.size(); ++i)
        errors[static_cast<Eigen::Index>(i)] =
            series.measured[i] - recorded.channels[c].axis.dot(seen[series.message[i]]);
      own += series.message.size();
      own_squares += errors.squaredNorm();
      if (errors.size() > 0) figure.max_mm = std::max(figure.max_mm, errors.cwiseAbs().maxCoeff());
      inference::whiten(inference::make_whitening(series, noise, noise.sigma[c]), errors);
      own_chi2 += errors.squaredNorm();
    }
    const auto n = static_cast<double>(std::max<std::size_t>(own, 1));
    figure.recordings.push_back({recording.name, std::sqrt(own_squares / n), own_chi2 / n});
    squares += own_squares, chi2 += own_chi2, figure.readings += own;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(figure.readings, 1));
  figure.rmse_mm = std::sqrt(squares / n);
  figure.chi2_per_reading = chi2 / n;
  return figure;
}

}  // namespace bevel::analysis
