#pragma once
// bevel-camera: frames in, TIP_MEASUREMENT out. The estimate, if there is one, says where to look.
#include "drivers/camera/pipeline.hpp"
#include "nodes/lcm_port.hpp"
#include "nodes/system_config.hpp"

namespace bevel::nodes {

class CameraNode {
 public:
  // Throws camera::SourceError or std::invalid_argument, naming what is wrong.
  CameraNode(lcm::LCM& lcm, const SystemConfig& config);
  enum class Outcome { frame, nothing, ended, failed };
  // Waits at most timeout_ms for a frame and publishes what it shows.
  Outcome step(std::int64_t now_utime, int timeout_ms);
  const std::string& failure() const { return failure_; }
  const camera::CameraCounters& counters() const { return pipeline_->counters(); }
  // Called with each observation, for programs that print them.
  std::function<void(const camera::TipObservation&)> on_observation;

 private:
  LcmPort port_;
  std::unique_ptr<camera::CameraPipeline> pipeline_;
  StatusReporter status_;
  std::string failure_;
  std::int64_t seq_ = 0;
};

}  // namespace bevel::nodes
