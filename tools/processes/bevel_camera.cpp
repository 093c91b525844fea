// SPDX-License-Identifier: MIT
// bevel-camera: frames in (the rig, a folder, a video file, a V4L2 device), TIP_MEASUREMENT out.
#include <bevel/error.hpp>
#include <bevel/nodes/camera_node.hpp>
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  cli::CommandLine command_line("bevel-camera", "Finds the needle tip in pictures and publishes where it is.");
  command_line.example("bevel-camera --config config/demo.toml");
  std::string source, record;
  bool print = false;
  double pictures_hz = 0;
  command_line.option("--source", source, "path instead of the file's source.path");
  command_line.option("--record", record, "folder to keep the frames in, a source of the kind folder then");
  command_line.option("--picture-hz", pictures_hz,
                      "send each camera's picture, made small, so often, for bevel-view; 0: never", 0.0,
                      nodes::kMostPictures_hz);
  command_line.flag("--print", print, "print each observation as CSV");
  return tools::process_main(command_line, argc, argv, nodes::camera_process_name, [&](tools::ProcessContext& context) {
    nodes::SystemConfig& config = context.config;
    if (!source.empty()) config.source.path = source;
    if (config.source.kind == camera::SourceKind::folder || config.source.kind == camera::SourceKind::video)
      config.source.start_utime = nodes::now().utime;
    nodes::CameraNode node(context.lcm, config, pictures_hz);
    tools::inject(context, node.port());
    if (!record.empty()) node.record(record);
    if (print) {
      std::puts("utime,seq,camera,status,x_mm,y_mm,z_mm,u_px,v_px,reason");
      node.on_observation = [](const camera::TipObservation& o) {
        std::printf("%lld,%lld,%d,%d,%.4f,%.4f,%.4f,%.2f,%.2f,%s\n", static_cast<long long>(o.capture_utime),
                    static_cast<long long>(o.seq), o.camera, static_cast<int>(o.status), o.position_mm[0],
                    o.position_mm[1], o.position_mm[2], o.tip_px.x, o.tip_px.y, std::string(o.reason).c_str());
      };
    }
    const auto end_recording = [&node] {
      if (const std::string said = node.end_recording(); !said.empty())
        std::fprintf(stderr, "bevel-camera: %s\n", said.c_str());
    };
    while (!nodes::stop_requested()) {
      nodes::pump(context.lcm);
      const auto outcome = node.step(nodes::now(), 50);
      if (outcome == nodes::CameraNode::Outcome::failed) {
        end_recording();
        throw bevel::IoError(node.failure());
      }
      if (outcome == nodes::CameraNode::Outcome::ended) break;
    }
    end_recording();
    return 0;
  });
}
