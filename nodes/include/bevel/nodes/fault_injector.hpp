// SPDX-License-Identifier: MIT
#pragma once
// Spoils what one component sends, as failing cameras, processes and networks do, to prove that motion stops: in
// simulated time by the thousand (tests/faults) and live (bevel-demo --fault camera:off@5s). Nothing else uses it.
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

enum class FaultKind {
  off,      // sends nothing any more
  stuck,    // the newest message for ever: byte for byte, or with new stamps and numbers
  garbage,  // bytes that mean nothing, of the right type or not
  wrong,    // well-formed and false: a tip 10 mm aside, a heading turned, axes that jump, a command nobody computed
  slow,     // one message in a quarter of a second
  delayed,  // each message late by 0.15 to 0.5 s
  intermittent,   // gaps of 0.15 to 0.4 s
  replayed,       // beside its own messages those of a second before
  second_sender,  // beside its own messages those of another, false and in good form
};
inline constexpr int kFaultKinds = 9;
const char* name_of(FaultKind kind);

enum class Component { camera, estimator, controller, stepper, insertion_drive, rotation_drive };
inline constexpr int kComponents = 6;
const char* name_of(Component component);
// The channel on which a process speaks to the others; "" for drives, which are on the bus.
const char* channel_of(Component component);
// All of them: a camera's headings fail with its positions.
std::vector<std::string> channels_of(Component component);

struct Fault {
  Component component = Component::camera;
  FaultKind kind = FaultKind::off;
  double at_s = 0;  // after the start of the process, or of the simulation
};
// "camera:off@5s". Throws ArgumentError saying what is allowed.
Fault parse_fault(const std::string& text);

class FaultInjector {
 public:
  using Emit = std::function<void(const char* channel, std::span<const std::uint8_t> bytes)>;

  // Lets everything pass until begin().
  explicit FaultInjector(Component component) : channels_(channels_of(component)) {}
  // Acts from start_ns (steady clock) on. The seed draws the variant, lengths and bytes.
  void begin(FaultKind kind, std::int64_t start_ns, std::uint64_t seed);

  bool concerns(std::string_view channel) const;
  // Takes a message that its component sends; what comes out of it is emitted by flush(), on the same channel. A
  // channel that it does not concern throws ArgumentError.
  void pass(std::string_view channel, const std::vector<std::uint8_t>& bytes, std::int64_t now_ns,
            std::int64_t now_utime);
  // Emits what is due.
  void flush(std::int64_t now_ns, const Emit& emit);

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Due {
    std::int64_t at_ns;
    std::size_t channel;  // of channels_
    Bytes bytes;
  };
  // at_ns never falls
  void emit_at(std::int64_t at_ns, std::size_t channel, Bytes bytes) {
    due_.push_back({at_ns, channel, std::move(bytes)});
  }
  const Due* newest_of(std::size_t channel) const;  // of before the fault; nullptr: none
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
  std::int64_t slow_sent_ns_ = 0;    // when the newest was let through, and its channel
  std::size_t slow_channel_ = 0;
  std::vector<std::int64_t> own_seq_;  // of the second sender, on each channel
  std::deque<Due> past_;               // of the last second
  std::deque<Due> due_;
};

}  // namespace bevel::nodes
