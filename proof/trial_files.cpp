// SPDX-License-Identifier: MIT
#include "proof/trial_files.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include <bevel/error.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include <bevel/io/result_file.hpp>
#include <bevel/model/samples.hpp>
#include "proof/commitment.hpp"

namespace bevel::proof {

using nlohmann::json;

namespace {

constexpr std::int64_t kFirst_utime = 1'700'000'000'000'000;
constexpr double kActuatorPeriod_s = 0.02;
constexpr double kCommandPeriod_s = 0.2;

std::int64_t microseconds(double seconds) { return std::llround(seconds * 1e6); }

struct Event {
  std::int64_t arrival;
  const char* channel;
  std::vector<std::uint8_t> bytes;
};

void add_tips(std::vector<Event>& events, const TrialRecording& recording, const CameraNoise& noise) {
  const Frames& frames = recording.frames;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    model::TipMeasurement tip;
    tip.utime = kFirst_utime + microseconds(frames.times_s[i]);
    tip.seq = frames.numbers[i];
    tip.position_mm = recording.reported_mm.col(static_cast<Eigen::Index>(i));
    const Eigen::Vector3d claimed = noise.claim_ratio * noise.sigmas_mm();
    tip.information_per_mm2 = claimed.cwiseProduct(claimed).cwiseInverse().asDiagonal();
    events.push_back({kFirst_utime + microseconds(frames.arrivals_s[i]), io::channel::kTipMeasurement,
                      io::encode(io::to_message(tip))});
  }
}

void add_actuators(std::vector<Event>& events, const AxisMotion& motion) {
  const auto stride = static_cast<std::size_t>(std::lround(kActuatorPeriod_s / kStep_s));
  constexpr double kCount_mm = 5e-4;  // encoder counts
  constexpr double kCount_rad = 5e-4;
  for (std::size_t i = 0; i < motion.size(); i += stride) {
    model::ActuatorState state;
    state.utime = kFirst_utime + microseconds(kStep_s * static_cast<double>(i));
    state.seq = static_cast<std::int64_t>(i / stride);
    state.axis_status = {2, 2};
    state.insertion_mm = kCount_mm * std::round(motion.insertion_mm[i] / kCount_mm);
    state.insertion_rate_mm_s = motion.insertion_rate_mm_s[i];
    state.rotation_rad = kCount_rad * std::round(motion.rotation_rad[i] / kCount_rad);
    state.rotation_rate_rad_s = motion.rotation_rate_rad_s[i];
    events.push_back({state.utime + 300, io::channel::kActuatorState, io::encode(io::to_message(state))});
  }
}

void add_commands(std::vector<Event>& events, const Script& script) {
  std::int64_t seq = 0;
  double start_s = 0;
  for (const Segment& segment : script.segments) {
    for (int i = 0; i * kCommandPeriod_s < segment.duration_s; ++i) {
      model::MotionCommand command;
      command.utime = kFirst_utime + microseconds(start_s + i * kCommandPeriod_s);
      command.seq = seq++;
      command.mode = 1;
      command.insertion_rate_mm_s = segment.insertion_rate_mm_s;
      command.rotation_rate_rad_s = segment.rotation_rate_rad_s;
      events.push_back({command.utime + 200, io::channel::kMotionCommand, io::encode(io::to_message(command))});
    }
    start_s += segment.duration_s;
  }
}

void write_log(const fs::path& path, const TrialRecording& recording, const CameraNoise& noise) {
  std::vector<Event> events;
  add_commands(events, recording.script);
  add_actuators(events, recording.motion);
  add_tips(events, recording, noise);
  std::ranges::stable_sort(events, {}, &Event::arrival);
  io::LogWriter log(path.string());
  for (const Event& event : events) log.write(event.arrival, event.channel, event.bytes);
  log.close();
}

json as_json(const BaseNeedle& n) {
  return {{"curvature_per_mm", n.curvature_per_mm},
          {"wheelbase_mm", n.wheelbase_mm},
          {"lambda1_per_rad", n.lambda1_per_rad},
          {"lambda2", n.lambda2}};
}

json as_json(const CameraNoise& n) {
  return {{"sigma_mm", n.sigma_mm},
          {"ar1", n.ar1},
          {"ar2", n.ar2},
          {"tail_degrees", n.tail_degrees},
          {"outlier_share", n.outlier_share},
          {"dropout_share", n.dropout_share},
          {"late_share", n.late_share},
          {"claim_ratio", n.claim_ratio}};
}

json as_json(const DriveRipple& r) {
  return {{"insertion_mm", r.insertion_mm},
          {"insertion_period_mm", r.insertion_period_mm},
          {"rotation_rad", r.rotation_rad}};
}

json as_json(const TruthEntry& entry) {
  json j{
      {"name", entry.effect.name}, {"parameters", entry.effect.parameters}, {"visible_sigmas", entry.visible_sigmas}};
  if (!entry.nearest.empty()) j["nearest"] = entry.nearest;
  if (!entry.effect.kind.empty()) j["kind"] = entry.effect.kind;
  if (!entry.effect.per_recording.empty()) j["per_recording"] = entry.effect.per_recording;
  return j;
}

std::string log_name(const Truth& truth, std::size_t index) {
  const std::string group = truth.changed.empty() ? "" : truth.changed[index] ? "after/" : "before/";
  return group + "rec0" + std::to_string(index + 1) + ".lcm";
}

}  // namespace

std::string trial_name(int number) {
  std::string digits = std::to_string(number);
  return "t" + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

TrialFolders::TrialFolders(const fs::path& out, int number)
    : trial(out / "trials" / trial_name(number)),
      given(trial / "case"),
      commitment(trial / "commitment.json"),
      truth(out / "sealed" / (trial_name(number) + ".json")),
      tool_output(trial / "out"),
      run(trial / "run.json"),
      score(trial / "score.json") {}

void write_atomically(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  io::write_result_file(path.string(), text);
}

std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw IoError(path.string() + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string truth_json(const Truth& truth) {
  json j{{"trial", truth.trial},
         {"class", name_of(truth.trial_class)},
         {"plant", truth.beam ? "beam" : "kinematic"},
         {"expected", truth.expected()},
         {"visible_sigmas", truth.visible_sigmas},
         {"rich_scripts", truth.rich},
         {"scripts", truth.script_kinds},
         {"departure", truth.departure},
         {"departure_sigmas", truth.departure_sigmas},
         {"ripple_sigmas", truth.ripple_sigmas},
         {"needle", as_json(truth.needle)},
         {"believed", as_json(truth.believed)},
         {"noise", as_json(truth.noise)},
         {"ripple", as_json(truth.ripple)},
         {"effects", json::array()},
         {"rivals", json::array()}};
  for (const TruthEntry& entry : truth.entries) j["effects"].push_back(as_json(entry));
  for (const Rival& rival : truth.rivals) j["rivals"].push_back({{"name", rival.name}, {"sigmas", rival.sigmas}});
  if (!truth.changed.empty()) j["changed"] = truth.changed;
  if (truth.spread.any()) {
    j["variation"] = {{"curvature_share", truth.spread.curvature_share},
                      {"entry_rad", truth.spread.entry_rad},
                      {"registration_mm", truth.spread.registration_mm},
                      {"roll_rad", truth.spread.roll_rad},
                      {"recordings", json::array()}};
    for (InsertionVariation one : truth.variation) {
      json row = json::array();
      for (int i = 0; i < InsertionVariation::kCount; ++i) row.push_back(one[i]);
      j["variation"]["recordings"].push_back(row);
    }
  }
  if (truth.beam_config)
    j["beam"] = {{"foundation_modulus_kPa", truth.beam_config->foundation_modulus_kPa},
                 {"bevel_force_N", truth.beam_config->bevel_force_N},
                 {"relaxing_fraction", truth.beam_config->relaxing_fraction},
                 {"relaxation_time_s", truth.beam_config->relaxation_time_s},
                 {"guide_gap_mm", truth.beam_config->guide_gap_mm}};
  return j.dump(1);
}

std::string model_file_text(const Truth& truth) {
  // Written by hand: the library's writer knows the effects, and this room is to know nothing of those.
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(),
                "# the simulation in use when these recordings were made\n[needle]\n"
                "curvature_per_mm = %.6f\nwheelbase_mm = %.4f\nlambda1_per_rad = %.4f\nlambda2 = %.4f\n"
                "slip = \"isotropic\"\nfront_wheel = \"published\"\n",
                truth.believed.curvature_per_mm, truth.believed.wheelbase_mm, truth.believed.lambda1_per_rad,
                truth.believed.lambda2);
  return text.data();
}

void write_trial(const fs::path& out, const Trial& trial) {
  const TrialFolders folders(out, trial.truth.trial);
  const fs::path unfinished = folders.trial / ("case.unfinished." + std::to_string(::getpid()));
  fs::create_directories(unfinished);
  json inputs;
  for (std::size_t i = 0; i < trial.recordings.size(); ++i) {
    const fs::path log = unfinished / log_name(trial.truth, i);
    fs::create_directories(log.parent_path());
    write_log(log, trial.recordings[i], trial.truth.noise);
    inputs[log_name(trial.truth, i)] = io::sha256_of_file(log);
  }
  write_atomically(unfinished / "model.toml", model_file_text(trial.truth));
  inputs["model.toml"] = io::sha256_of_file(unfinished / "model.toml");
  fs::remove_all(folders.given);
  fs::rename(unfinished, folders.given);

  const std::string truth = truth_json(trial.truth);
  const std::string salt = draw_salt();
  fs::create_directories(folders.truth.parent_path());
  fs::permissions(folders.truth.parent_path(), fs::perms::owner_all);
  write_atomically(folders.truth, json{{"salt", salt}, {"truth", truth}}.dump(1) + "\n");
  write_atomically(folders.commitment, json{{"trial", trial.truth.trial},
                                            {"sha256_of_salt_and_truth", commitment_to(salt, truth)},
                                            {"sha256_of_inputs", inputs}}
                                               .dump(1) +
                                           "\n");
}

bool prepare_trial(const fs::path& out, std::uint64_t seed, int number, const Population& population) {
  if (fs::exists(TrialFolders(out, number).commitment)) return false;
  write_trial(out, draw_trial(seed, number, population));
  return true;
}

std::string open_truth(const TrialFolders& folders) {
  const json sealed = json::parse(read_text(folders.truth));
  const json commitment = json::parse(read_text(folders.commitment));
  std::string truth = sealed.at("truth");
  if (commitment_to(sealed.at("salt").get<std::string>(), truth) != commitment.at("sha256_of_salt_and_truth"))
    throw IoError(folders.truth.string() + ": not the truth that " + folders.commitment.string() + " commits to");
  return truth;
}

}  // namespace bevel::proof
