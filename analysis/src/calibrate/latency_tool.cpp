// SPDX-License-Identifier: MIT
#include <map>
#include <ostream>

#include <bevel/analysis/calibrate/calibrate_tool.hpp>
#include <bevel/cli/exit_status.hpp>
#include <bevel/diagnosis/latency/latency_fit.hpp>
#include <bevel/error.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/io/recording.hpp>
#include <bevel/io/recording_clock.hpp>
#include <bevel/report/numbers.hpp>

namespace bevel::analysis {
namespace {

using report::format_significant;

// What bevel-camera took off the stamps of each camera already when the log was recorded, as its CONFIG says.
std::map<int, double> latencies_in(const std::string& config) {
  std::map<int, double> latency_s;
  try {
    io::ConfigFile file = io::ConfigFile::parse(config, "CONFIG");
    std::string kind;
    file.section("source", io::optional).read("kind", kind, io::optional);
    if (kind == "video" || kind == "folder") return {};  // whose stamps are their own: nothing was taken off
    for (io::Section s : file.sections("camera", io::optional)) {
      int camera = 0;
      double value_s = 0;
      s.read("camera", camera, io::optional);
      s.read("latency_s", value_s, io::optional);
      latency_s[camera] = value_s;
    }
  } catch (const io::ConfigError&) {
    return {};  // of another program's making
  }
  return latency_s;
}

}  // namespace

int fit_latency(const CalibrateOptions& o, std::ostream& out, std::ostream& err) {
  io::ModelFile model = io::load_model_file(o.model);
  if (std::erase_if(model.effects, [](const io::EffectEntry& e) { return e.name == "camera_latency"; }) > 0)
    err << o.model << ": its camera_latency is left aside: what is found here is all of it\n";
  const io::Recording recording = io::read_recording(o.latency);
  io::require_usable(o.latency, recording);
  err << recording.remarks(o.latency);
  if (!io::has_clock(recording))
    throw IoError(o.latency + ": its times are an order and no clock; nothing is late in it");
  std::map<int, std::vector<model::TipMeasurement>> of_camera;
  for (const model::TipMeasurement& m : recording.tips) of_camera[m.camera].push_back(m);
  const std::map<int, double> applied_s = latencies_in(recording.config);
  const model::AugmentedNeedle needle(model.needle, io::active_effects(model, o.latency));
  bool refused = of_camera.empty();
  if (refused) err << o.latency << ": no TIP_MEASUREMENT\n";
  for (const auto& [camera, tips] : of_camera) {
    const diagnosis::LatencyFit fit = diagnosis::fit_latency(needle, recording.actuators, tips);
    if (!fit.refusal.empty()) {
      err << o.latency << ": camera " << camera << ": " << fit.refusal << '\n';
      refused = true;
      continue;
    }
    const auto before = applied_s.find(camera);
    const double already_s = before == applied_s.end() ? 0 : before->second;
    out << "camera " << camera << ": stamps are " << format_significant(1e3 * fit.latency_s) << " ms late, +-"
        << format_significant(1e3 * fit.within_95_s, 2) << " ms (95 %, by " << fit.stretches << " stretches); "
        << fit.readings << " readings, RMS " << format_significant(fit.rms_mm) << " mm along the needle, correlation "
        << format_significant(fit.correlation, 2) << " over " << format_significant(1e3 * fit.spacing_s) << " ms\n";
    if (already_s != 0)
      out << "  beside the " << format_significant(1e3 * already_s) << " ms that the log's CONFIG takes off already\n";
    out << "\n[[camera]]\ncamera = " << camera << "\nlatency_s = " << format_significant(already_s + fit.latency_s, 4)
        << "\n\n";
  }
  if (refused) return cli::kFailed;
  return recording.intact() ? cli::kOk : cli::kDamagedInput;
}

}  // namespace bevel::analysis
