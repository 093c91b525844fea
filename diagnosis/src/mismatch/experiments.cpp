// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/mismatch/experiments.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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
  if (d >= 10) {
    Script saw = say("insertion reversals: 10 mm in and 4 mm back at 8 mm/s, over and over");
    for (double at = 0; at + 10 <= d; at += 6) saw.insert(10, 8).insert(-4, 8);
    all.push_back(saw.done());
  }
  all.push_back(
      say("slow: 2 mm/s, no rotation, a rest of 3 s in the middle").insert(d / 2, 2).rest(3).insert(d / 2, 2).done());
  return all;
}

Experiments::Experiments(const NeedleSystem& system, const inference::Noise& noise)
    : system_(system), scripts_(motion_scripts(system.recorded().deepest_mm(), system.data().frame_s)) {
  RecordedCase planned;
  planned.channels = system.recorded().channels;
  planned.frame_s = system.recorded().frame_s;
  planned.has_clock = system.recorded().has_clock;
  for (const MotionScript& script : scripts_) {
    Recording recording;
    recording.name = script.text;
    recording.changed = system.recorded().two_groups();
    recording.motion = script.motion;
    inference::Series series;
    for (std::size_t i = 0; i < script.motion.at.size(); ++i) {
      series.message.push_back(i);
      series.time_s.push_back(script.motion.nodes[script.motion.at[i]].time_s);
      series.measured.push_back(0);
      series.relative_sd.push_back(1);
    }
    recording.series.assign(planned.channels.size(), series);
    planned.recordings.push_back(std::move(recording));
  }
  planned_ = std::make_unique<const NeedleSystem>(std::move(planned), system.model(),
                                                  KnownPhysics{.in_recording = {}, .elsewhere = system.known(-1)});
  likelihood_ = std::make_unique<const inference::Likelihood>(*planned_, inference::Readings(scripts_.size()), noise);
}

double Experiments::separation(std::size_t script, const Imagined& truth, const Imagined& rival) const {
  const model::Motion& motion = scripts_[script].motion;
  // What two groups get wrong alike has a part in each channel, which a path has not: the difference is the rival's.
  const Index common = static_cast<Index>(system_.base().size()) - kBaseParameters;
  VectorXd true_shared = truth.shared, rival_shared = rival.shared;
  rival_shared.segment(kBaseParameters, common) -= true_shared.segment(kBaseParameters, common);
  true_shared.segment(kBaseParameters, common).setZero();
  model::OpenLoop path;
  if (!system_.tip_path(truth.set, motion, -1, true_shared, truth.local, truth.discrepancy, path)) return 0;
  inference::Prediction prediction;
  if (!planned_->predict(rival.set, script, rival_shared, rival.local, true, prediction)) return 0;
  VectorXd difference = -prediction.reading;
  Index row = 0;
  for (const Channel& channel : system_.recorded().channels)
    for (const auto& vector : channel.heading ? path.heading : path.position_mm)
      difference[row++] += channel.axis.dot(vector);
  const MatrixXd white = likelihood_->whitened(script, difference);
  // The rival may move its parameters, as far as what is recorded already lets it, and call it another insertion.
  MatrixXd J(difference.size(), prediction.by_shared.cols() + prediction.by_local.cols());
  J << likelihood_->whitened(script, prediction.by_shared), likelihood_->whitened(script, prediction.by_local);
  MatrixXd A = J.transpose() * J;
  const Index shared = prediction.by_shared.cols();
  A.topLeftCorner(shared, shared) += rival.information.topLeftCorner(shared, shared);
  for (Index i = 0; i < prediction.by_local.cols(); ++i)
    A(shared + i, shared + i) += i < rival.local_precision.size() ? rival.local_precision[i] : 0;
  A.diagonal() *= 1 + 1e-12;
  const VectorXd b = J.transpose() * white;
  return std::max(0.0, white.squaredNorm() - b.dot(A.ldlt().solve(b)));
}

NextExperiment Experiments::best(const Imagined& truth, const Imagined& rival) const {
  NextExperiment out;
  out.separates = {describe(system_, truth.set), describe(system_, rival.set)};
  if (!truth.discrepancy.empty()) out.separates[0] = "a discrepancy beside " + out.separates[0];
  out.expected_gain = -1;
  for (std::size_t s = 0; s < scripts_.size(); ++s)
    if (const double gain = separation(s, truth, rival); gain > out.expected_gain)
      out.script = scripts_[s].text, out.expected_gain = gain;
  return out;
}

Imagined imagined(const inference::Fit& fit, const ChosenModel& model) {
  Imagined out{
      .set = fit.layout.set(), .shared = fit.shared, .local = fit.local.front(), .discrepancy = model.discrepancy};
  for (std::size_t i = 0; i < fit.layout.local().size(); ++i)
    if (!fit.layout.is_scanned(i)) out.local[static_cast<Index>(i)] = 0;
  out.information = solve_about(fit, model.blocks, model.curve).information;
  out.local_precision = VectorXd::Zero(out.local.size());
  for (std::size_t i = 0; i < fit.layout.local().size(); ++i)
    if (!fit.layout.is_scanned(i)) {
      const auto group = static_cast<Index>(fit.layout.system().nuisances()[i].group);
      const double sd = std::max(fit.scales.nuisance_sd[group], inference::kNone_sd);
      out.local_precision[static_cast<Index>(i)] = 1 / (sd * sd);
    }
  return out;
}

}  // namespace bevel::diagnosis
