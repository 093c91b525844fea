// SPDX-License-Identifier: MIT
// How long from a MOTION_COMMAND to the frame that carries its rate on the bus, through bevel-stepper, beside the least
// that it can be, in the same run:
//
//   hop     an LCM message to another process that waits for nothing else, until its handler begins
//   write   a CAN frame, until another participant of the bus has it
//   relay   both in one: that other process writes a frame as soon as the message is there
//   command through bevel-stepper
//
// Each of the four comes after a pause of the same length, in an order that is drawn anew each time: what has slept for
// long wakes up slowly, whoever it is. Where `system.realtime` is set the other process has the priority of
// bevel-stepper.
//
//   tests/loop/processes_test.sh build/bin . command_latency
//
// bevel-rig and bevel-stepper run already; whoever starts this has a network of its own. Arguments: SYSTEM_FILE
// SAMPLES.
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bevel/motion_command_t.hpp>
#include <bevel/process_status_t.hpp>
#include <bevel/steering_target_t.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <bevel/drivers/can/open_bus.hpp>
#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/io/process_state.hpp>
#include <bevel/nodes/runtime.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::test {
namespace {

using nodes::now;
constexpr std::int64_t kMs = 1'000'000;  // ns
constexpr std::int64_t kLongest_ns = 50 * kMs;
// So near to each other that no limit of acceleration stands in between.
constexpr double kRate_mm_s = 5.0, kStep_mm_s = 0.001;
constexpr std::uint32_t kNobodys = 0x7E0;
constexpr int kPriority = 50;  // of bevel-stepper
constexpr double kMostOfBare = 1.3;

// The other process, which does nothing but hear and write. It ends with the one that started it.
class BarePeer {
 public:
  explicit BarePeer(const nodes::SystemConfig& config) {
    void* shared =
        mmap(nullptr, sizeof(std::atomic<std::int64_t>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) throw std::runtime_error("no memory to share");
    arrived_ns_ = new (shared) std::atomic<std::int64_t>(0);
    const int parent = getpid();
    if (const int child = fork(); child != 0) {
      if (child < 0) throw std::runtime_error("no second process");
      return;
    }
    nodes::end_with(parent);
    run(config);
    _exit(0);
  }
  void forget() { *arrived_ns_ = 0; }
  std::int64_t arrived_ns() const { return *arrived_ns_; }  // of the last hop; 0: none since forget()

 private:
  [[noreturn]] void run(const nodes::SystemConfig& config) {
    if (config.realtime) (void)nodes::try_realtime(kPriority);
    const std::array<std::uint32_t, 1> nothing{kNobodys + 1};
    bus_ = can::open_bus(config.can, nothing);
    lcm::LCM lcm(config.lcm_url);
    lcm.subscribe("BENCH_HOP", &BarePeer::on_hop, this);
    lcm.subscribe("BENCH_RELAY", &BarePeer::on_relay, this);
    for (;;) {
      if (lcm.handleTimeout(100) == 0) bus_->maintain(now().ns);  // the rig, whose bus it is, may start later
    }
  }
  void on_hop(const lcm::ReceiveBuffer*, const std::string&) { *arrived_ns_ = now().ns; }
  void on_relay(const lcm::ReceiveBuffer*, const std::string&) { (void)bus_->send({kNobodys, 8, {}}); }

  std::atomic<std::int64_t>* arrived_ns_ = nullptr;
  std::unique_ptr<can::Bus> bus_;
};

class Bench {
 public:
  Bench(const nodes::SystemConfig& config, BarePeer& peer)
      : config_(config),
        peer_(peer),
        writer_(can::open_bus(config.can)),
        reader_(can::open_bus(config.can)),
        lcm_(config.lcm_url) {
    lcm_.subscribe("PROCESS_STATUS", &Bench::on_status, this);
  }

  bool arm() {
    const std::int64_t end_ns = now().ns + 8000 * kMs;
    while (now().ns < end_ns && !enabled()) {
      publish("MOTION_COMMAND", 0.0);
      if (is(io::ProcessState::ready)) say_arm();
      hear_for(20 * kMs);
    }
    return enabled();
  }
  std::string said() const { return stepper_.state + ": " + stepper_.reason; }
  bool is(io::ProcessState state) const { return stepper_.state_code == static_cast<std::int32_t>(state); }
  bool enabled() const { return is(io::ProcessState::enabled); }

  // ns; nothing where it took longer than kLongest_ns.
  std::optional<std::int64_t> hop() {
    peer_.forget();
    const std::int64_t begun_ns = now().ns;
    publish("BENCH_HOP", 0.0);
    while (peer_.arrived_ns() == 0 && now().ns - begun_ns < kLongest_ns) (void)poll(nullptr, 0, 2);
    if (peer_.arrived_ns() == 0) return std::nullopt;
    return peer_.arrived_ns() - begun_ns;
  }
  std::optional<std::int64_t> write() {
    return until_heard(kNobodys, {}, [&] { (void)writer_->send({kNobodys, 8, {}}); });
  }
  std::optional<std::int64_t> relay() {
    return until_heard(kNobodys, {}, [&] { publish("BENCH_RELAY", 0.0); });
  }
  std::optional<std::int64_t> command(double rate_mm_s) {
    const stepper::AxisConfig& axis = config_.stepper.axes[0];
    const auto counts_s = static_cast<std::uint32_t>(std::lround(rate_mm_s * axis.counts_per_unit));
    return until_heard(stepper::cia301::rpdo1_id(axis.node_id), counts_s,
                       [&] { publish("MOTION_COMMAND", rate_mm_s); });
  }
  void command_again(double rate_mm_s) { publish("MOTION_COMMAND", rate_mm_s); }
  void hear_for(std::int64_t ns) {
    for (const std::int64_t end_ns = now().ns + ns; now().ns < end_ns;) lcm_.handleTimeout(1);
    for (can::Bus* bus : {reader_.get(), writer_.get()}) {
      bus->maintain(now().ns);
      while (bus->receive().kind != can::Reception::Kind::nothing) {
      }
    }
  }

 private:
  template <class Act>
  std::optional<std::int64_t> until_heard(std::uint32_t id, std::optional<std::uint32_t> velocity, const Act& act) {
    const std::int64_t begun_ns = now().ns;
    act();
    while (now().ns - begun_ns < kLongest_ns)
      if (heard(id, velocity)) return now().ns - begun_ns;
    return std::nullopt;
  }
  bool heard(std::uint32_t id, std::optional<std::uint32_t> velocity) {
    pollfd waited{reader_->poll_fd(), POLLIN, 0};
    (void)poll(&waited, 1, 20);
    for (auto found = reader_->receive(); found.kind != can::Reception::Kind::nothing; found = reader_->receive())
      if (found.frame.id == id && (!velocity || stepper::cia301::get_u32(found.frame, 2) == *velocity)) return true;
    return false;
  }
  void on_status(const lcm::ReceiveBuffer*, const std::string&, const process_status_t* m) {
    if (m->process == "bevel-stepper") stepper_ = *m;
  }
  void publish(const char* channel, double rate_mm_s) {
    motion_command_t m{};
    m.utime = now().utime;
    m.seq = seq_++;
    m.mode = 1;
    m.insertion_rate_mm_s = rate_mm_s;
    lcm_.publish(channel, &m);
  }
  void say_arm() {
    steering_target_t m{};
    m.utime = now().utime;
    m.seq = words_++;
    m.request = 1;
    m.session[1] = stepper_.session;
    lcm_.publish("STEERING_TARGET", &m);
  }

  nodes::SystemConfig config_;
  BarePeer& peer_;
  std::unique_ptr<can::Bus> writer_, reader_;
  lcm::LCM lcm_;
  process_status_t stepper_{};
  std::int64_t seq_ = 0, words_ = 0;
};

enum Way { kHop, kWrite, kRelay, kCommand, kWays };
constexpr std::array<const char*, kWays> kNames{"bare LCM hop", "bare CAN write", "both in one: relayed",
                                                "LCM command to CAN frame"};

double at_us(std::vector<std::int64_t> samples, double share) {
  std::sort(samples.begin(), samples.end());
  return static_cast<double>(samples.at(static_cast<std::size_t>(share * static_cast<double>(samples.size() - 1)))) /
         1000;
}

int run(const std::string& file, int count) {
  const nodes::SystemConfig config = nodes::load_system_config(file);
  BarePeer peer(config);
  const std::string refused = config.realtime ? nodes::try_realtime(kPriority) : "as it was not asked for";
  if (!refused.empty()) std::printf("without real-time scheduling: %s\n", refused.c_str());
  Bench bench(config, peer);
  if (!bench.arm()) {
    std::printf("bevel-stepper was not enabled: %s\n", bench.said().c_str());
    return 1;
  }
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> pause_ns(8 * kMs, 18 * kMs);  // at every phase of the driver's cycle
  std::array<std::vector<std::int64_t>, kWays> taken;
  std::array<Way, kWays> order{kHop, kWrite, kRelay, kCommand};
  double rate_mm_s = kRate_mm_s;
  for (int i = 0; i < count && bench.enabled(); ++i) {
    std::array<std::optional<std::int64_t>, kWays> once;
    std::shuffle(order.begin(), order.end(), random);
    for (const Way way : order) {
      if (way == kCommand) rate_mm_s = kRate_mm_s + (i % 2) * kStep_mm_s;
      once.at(way) = way == kHop     ? bench.hop()
                     : way == kWrite ? bench.write()
                     : way == kRelay ? bench.relay()
                                     : bench.command(rate_mm_s);
      bench.hear_for(pause_ns(random));
      bench.command_again(rate_mm_s);  // so that none of them grows old
      bench.hear_for(pause_ns(random));
    }
    if (std::all_of(once.begin(), once.end(), [](const auto& ns) { return ns.has_value(); }))
      for (std::size_t way = 0; way < kWays; ++way) taken.at(way).push_back(*once.at(way));
  }
  if (taken[kHop].size() < static_cast<std::size_t>(count) / 2) {
    std::printf("%zu of %d measured; bevel-stepper says %s\n", taken[kHop].size(), count, bench.said().c_str());
    return 1;
  }
  for (std::size_t way = 0; way < kWays; ++way)
    std::printf("%-26s p50 %7.1f us   p99 %7.1f us\n", kNames.at(way), at_us(taken.at(way), 0.5),
                at_us(taken.at(way), 0.99));
  const double path_us = at_us(taken[kCommand], 0.5);
  const double bare_us = at_us(taken[kHop], 0.5) + at_us(taken[kWrite], 0.5);
  std::printf("ratio at p50: %.2f to hop and write, %.2f to the relay, of %zu samples\n", path_us / bare_us,
              path_us / at_us(taken[kRelay], 0.5), taken[kHop].size());
  // Without its priorities the scheduler decides, by what else runs here.
  if (!refused.empty() || path_us <= kMostOfBare * bare_us) return 0;
  std::printf("allowed: %.2f to hop and write\n", kMostOfBare);
  return 1;
}

}  // namespace
}  // namespace bevel::test

int main(int argc, char** argv) {
  if (argc != 3) {
    std::puts("usage: command_latency SYSTEM_FILE SAMPLES");
    return 2;
  }
  return bevel::test::run(argv[1], std::atoi(argv[2]));
}
