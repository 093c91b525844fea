// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Corruption of the messages of one component, as failing cameras, processes and networks cause it, for tests that
/// motion stops: in simulated time (tests/faults) and live (bevel-demo --fault camera:off@5s).
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace bevel::nodes {

/// Kind of fault.
enum class FaultKind {
  off,            ///< sends nothing any more
  stuck,          ///< repeats the newest message: byte for byte, or with new time stamps and numbers
  garbage,        ///< random bytes, of the right type or not
  wrong,          ///< well-formed and false: a tip 10 mm aside, a rotated heading, axes that jump, an arbitrary command
  slow,           ///< one message every quarter of a second
  delayed,        ///< delays each message by 0.15 to 0.5 s
  intermittent,   ///< gaps of 0.15 to 0.4 s
  replayed,       ///< in addition to its own messages, those of one second before
  second_sender,  ///< in addition to its own messages, false and well-formed ones of another sender
};
inline constexpr int kFaultKinds = 9;  ///< number of kinds
/// Returns the name of a kind, as parse_fault() reads it.
/// @param kind kind of fault
/// @return static string
const char* name_of(FaultKind kind);

/// Component that fails.
enum class Component {
  camera,           ///< bevel-camera
  estimator,        ///< bevel-estimator
  controller,       ///< bevel-controller
  stepper,          ///< bevel-stepper
  insertion_drive,  ///< drive of the insertion axis
  rotation_drive    ///< drive of the rotation axis
};
inline constexpr int kComponents = 6;  ///< number of components
/// Returns the name of a component, as parse_fault() reads it.
/// @param component component
/// @return static string
const char* name_of(Component component);
/// Returns the channel on which a process publishes.
/// @param component component
/// @return channel; "" for drives, which are on the bus
const char* channel_of(Component component);
/// Returns all channels on which a process publishes: the headings of a camera fail with its positions.
/// @param component component
/// @return channels; one empty name for a drive
std::vector<std::string> channels_of(Component component);

/// A fault of one component.
struct Fault {
  Component component = Component::camera;  ///< component that fails
  FaultKind kind = FaultKind::off;          ///< kind of fault
  double at_s = 0;  ///< start of the fault after the start of the process or of the simulation, s
};
/// Parses a fault.
/// @param text component, kind and start: "camera:off@5s"
/// @return fault
/// @throws ArgumentError stating what is allowed
Fault parse_fault(const std::string& text);

/// Corrupts the messages of one component.
class FaultInjector {
 public:
  /// Function that sends a message on a channel.
  using Emit = std::function<void(const char* channel, std::span<const std::uint8_t> bytes)>;

  /// Creates an injector that passes everything on until begin().
  /// @param component component whose messages are corrupted
  explicit FaultInjector(Component component) : channels_(channels_of(component)) {}
  /// Starts the fault.
  /// @param kind     kind of fault
  /// @param start_ns start of the fault, steady clock, ns
  /// @param seed     seed of the variant, the durations and the bytes
  void begin(FaultKind kind, std::int64_t start_ns, std::uint64_t seed);

  /// Returns whether the component publishes on a channel.
  /// @param channel channel
  /// @return true if it does
  bool concerns(std::string_view channel) const;
  /// Takes a message of the component. flush() emits the result on the same channel.
  /// @param channel   channel of the component
  /// @param bytes     encoded message
  /// @param now_ns    steady clock, ns
  /// @param now_utime wall clock, us since the epoch
  /// @throws ArgumentError if the component does not publish on the channel
  void pass(std::string_view channel, const std::vector<std::uint8_t>& bytes, std::int64_t now_ns,
            std::int64_t now_utime);
  /// Emits the messages that are due.
  /// @param now_ns steady clock, ns
  /// @param emit   called for each message
  void flush(std::int64_t now_ns, const Emit& emit);

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Due {
    std::int64_t at_ns;
    std::size_t channel;  // of channels_
    Bytes bytes;
  };
  // at_ns must not decrease between calls.
  void emit_at(std::int64_t at_ns, std::size_t channel, Bytes bytes) {
    due_.push_back({at_ns, channel, std::move(bytes)});
  }
  const Due* newest_of(std::size_t channel) const;  // newest message before the fault; nullptr: none
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng_); }
  Bytes garbage(const Bytes& like);

  std::vector<std::string> channels_;
  FaultKind kind_ = FaultKind::off;
  std::int64_t start_ns_ = std::numeric_limits<std::int64_t>::max();
  std::mt19937_64 rng_;
  bool variant_ = false;
  std::int64_t shift_ns_ = 0;        // of delays
  std::int64_t pass_until_ns_ = 0;   // intermittent
  std::int64_t block_until_ns_ = 0;  // intermittent, slow
  std::int64_t slow_sent_ns_ = 0;    // time and channel of the newest message that passed
  std::size_t slow_channel_ = 0;
  std::vector<std::int64_t> own_seq_;  // of the second sender, on each channel
  std::deque<Due> past_;               // of the last second
  std::deque<Due> due_;
};

}  // namespace bevel::nodes
