// A whole log in memory, decoded and checked, as the plain structures of the core.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "io/checked_decode.hpp"
#include "io/log_reader.hpp"
#include "model/samples.hpp"

namespace bevel::io {

// Messages refused on one channel, by reason.
using RejectCounts = std::array<std::int64_t, kDecodeFaultCount>;

struct Recording {
  // Each in the order of the log, which is the order of arrival and need not be that of utime.
  std::vector<model::TipMeasurement> tips;
  std::vector<model::ActuatorState> actuators;
  std::vector<model::MotionCommand> commands;
  std::vector<steering_target_t> targets;
  std::vector<needle_state_t> estimates;  // NEEDLE_STATE
  std::vector<needle_state_t> truths;     // NEEDLE_TRUTH
  std::string config;                     // text of CONFIG; "" if the log has none

  std::map<std::string, RejectCounts> rejects;           // channel -> counts; only channels with rejects
  std::map<std::string, std::int64_t> skipped_channels;  // channels that this reader does not decode -> messages
  LogDamage damage;
  std::int64_t events = 0;

  std::int64_t rejected() const;
  bool intact() const { return damage.intact() && rejected() == 0; }
  std::string describe_faults() const;  // one line per kind of fault; "" if intact
};

Recording read_recording(std::span<const std::uint8_t> log);
// Throws std::runtime_error if the file cannot be read; damage inside it is reported in the result.
Recording read_recording(const std::string& path);

}  // namespace bevel::io
