#include "diagnosis/mismatch/experiments.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace bevel::diagnosis {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNode_s = 0.02;

// Builds a motion leg by leg, at constant rates.
class Script {
 public:
  Script(std::string text, double frame_s) : frame_s_(frame_s) {
    out_.text = std::move(text);
    actuators_.push_back({});
  }
  Script& move(double insertion_mm, double rotation_rad, double seconds) {
    const auto steps = std::max(1, static_cast<int>(std::lround(seconds / kNode_s)));
    const model::ActuatorState from = actuators_.back();
    for (int i = 1; i <= steps; ++i) {
      model::ActuatorState state;
      state.utime = from.utime + static_cast<std::int64_t>(std::llround(1e6 * seconds * i / steps));
      state.insertion_mm = from.insertion_mm + insertion_mm * i / steps;
      state.rotation_rad = from.rotation_rad + rotation_rad * i / steps;
      actuators_.push_back(state);
    }
    return *this;
  }
  Script& insert(double mm, double mm_s) { return move(mm, 0, std::abs(mm) / mm_s); }
  Script& turn(double rad, double rad_s = kPi) { return move(0, rad, std::abs(rad) / rad_s); }
  Script& rest(double seconds) { return move(0, 0, seconds); }
  MotionScript done() {
    std::vector<std::int64_t> readings;
    for (double t = frame_s_; t * 1e6 < static_cast<double>(actuators_.back().utime); t += frame_s_)
      readings.push_back(static_cast<std::int64_t>(t * 1e6));
    out_.motion = model::make_motion(actuators_, readings);
    return out_;
  }

 private:
  MotionScript out_;
  double frame_s_;
  std::vector<model::ActuatorState> actuators_;
};

}  // namespace

std::vector<MotionScript> motion_scripts(double depth_mm, double frame_s) {
  const double d = depth_mm;
  std::vector<MotionScript> all;
  const auto say = [&](const std::string& text) { return Script(text, frame_s); };
  all.push_back(say("insert steadily at 5 mm/s, no rotation").insert(d, 5).done());
  all.push_back(say("insert steadily at 10 mm/s, no rotation").insert(d, 10).done());
  all.push_back(say("speed ladder: thirds of the depth at 2, 10 and 5 mm/s")
                    .insert(d / 3, 2)
                    .insert(d / 3, 10)
                    .insert(d / 3, 5)
                    .done());
  all.push_back(say("turn by 180 degrees before entering, then insert at 5 mm/s").turn(kPi).insert(d, 5).done());
  all.push_back(say("turn by 90 degrees before entering, then insert at 5 mm/s").turn(kPi / 2).insert(d, 5).done());
  Script reversal =
      say("reversal ladder: every tenth of the depth turn by +90, then -90 degrees, then go on at 8 mm/s");
  for (int i = 0; i < 10; ++i) reversal.insert(d / 10, 8).turn(i % 2 ? -kPi / 2 : kPi / 2);
  all.push_back(reversal.done());
  all.push_back(say("flip by 180 degrees at a third and at two thirds of the depth, 8 mm/s")
                    .insert(d / 3, 8)
                    .turn(kPi)
                    .insert(d / 3, 8)
                    .turn(-kPi)
                    .insert(d / 3, 8)
                    .done());
  Script small = say("small turns: every twentieth of the depth +20, then -20 degrees, 8 mm/s");
  for (int i = 0; i < 20; ++i) small.insert(d / 20, 8).turn(i % 2 ? -0.35 : 0.35);
  all.push_back(small.done());
  all.push_back(say("stop and hold: a third of the depth at 8 mm/s, 5 s of rest, three times")
                    .insert(d / 3, 8)
                    .rest(5)
                    .insert(d / 3, 8)
                    .rest(5)
                    .insert(d / 3, 8)
                    .rest(5)
                    .done());
  all.push_back(
      say("spin: insert at 5 mm/s while turning at half a revolution a second").move(d, kPi * d / 5, d / 5).done());
  all.push_back(
      say("spin and plain in turns: quarters of the depth at 5 mm/s, the second and fourth turning once a second")
          .insert(d / 4, 5)
          .move(d / 4, 2 * kPi * d / 20, d / 20)
          .insert(d / 4, 5)
          .move(d / 4, 2 * kPi * d / 20, d / 20)
          .done());
  all.push_back(say("retraction: insert half the depth at 8 mm/s, draw back a quarter, turn by 90 degrees, insert to "
                    "the full depth")
                    .insert(d / 2, 8)
                    .insert(-d / 4, 8)
                    .turn(kPi / 2)
                    .insert(3 * d / 4, 8)
                    .done());
  Script saw = say("insertion reversals: 10 mm in and 4 mm back at 8 mm/s, over and over");
  for (double at = 0; at + 10 <= d; at += 6) saw.insert(10, 8).insert(-4, 8);
  all.push_back(saw.done());
  all.push_back(
      say("slow: 2 mm/s, no rotation, a rest of 3 s in the middle").insert(d / 2, 2).rest(3).insert(d / 2, 2).done());
  return all;
}

double separation(const Evidence& evidence, const MotionScript& script, const Fit& truth, const Fit& rival) {
  RecordedCase imagined;
  imagined.channels = evidence.recorded->channels;
  imagined.frame_s = evidence.recorded->frame_s;
  Recording recording;
  recording.name = "imagined";
  recording.motion = script.motion;
  model::OpenLoop path;
  // Phases and instants of a recording that is still to be made: those of the first one stand for them.
  if (!model::predict(truth.hypothesis.make_needle(0, truth.values, false), script.motion, path)) return 0;
  for (const auto& channel : imagined.channels) {
    Series series;
    for (std::size_t i = 0; i < script.motion.at.size(); ++i) {
      series.reading.push_back(i);
      series.time_s.push_back(script.motion.nodes[script.motion.at[i]].time_s);
      series.measured_mm.push_back(channel.axis.dot(path.position_mm[i]));
      series.relative_sd.push_back(1);
    }
    recording.series.push_back(std::move(series));
  }
  imagined.recordings.push_back(std::move(recording));
  Evidence new_evidence = evidence;
  new_evidence.recorded = &imagined;
  Workspace workspace;
  if (!evaluate(new_evidence, rival.hypothesis, 0, rival.values, true, workspace)) return 0;
  // The rival may move its parameters, as far as what is recorded already lets it.
  const auto& columns = rival.hypothesis.columns(0);
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd A = workspace.residuals.jacobian.transpose() * workspace.residuals.jacobian;
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      A(i, j) += rival.information(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]);
  A.diagonal().array() += 1e-12 * A.diagonal().maxCoeff();
  const Eigen::VectorXd b = workspace.residuals.jacobian.transpose() * workspace.residuals.white;
  return std::max(0.0, workspace.residuals.white.squaredNorm() - b.dot(A.ldlt().solve(b)));
}

NextExperiment best_experiment(const Evidence& evidence, const Fit& truth, const Fit& rival, double depth_mm) {
  NextExperiment best;
  best.separates = {describe(truth.hypothesis.set()), describe(rival.hypothesis.set())};
  best.expected_gain = -1;
  for (const auto& script : motion_scripts(depth_mm, evidence.recorded->frame_s)) {
    const double gain = separation(evidence, script, truth, rival);
    if (gain > best.expected_gain) best.script = script.text, best.expected_gain = gain;
  }
  return best;
}

}  // namespace bevel::diagnosis
