// How long from a MOTION_COMMAND to the frame that carries its rate on the bus, through bevel-stepper, beside the least
// that it can be: one bare LCM hop and one bare CAN write, taken in turns with it in the same run.
//
//   tests/loop/processes_test.sh build/bin . command_latency
//
// bevel-rig and bevel-stepper run already; whoever starts this has a network of its own. Arguments: SYSTEM_FILE
// SAMPLES.
#include <poll.h>

#include <algorithm>
#include <bevel/motion_command_t.hpp>
#include <bevel/process_status_t.hpp>
#include <bevel/steering_target_t.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "drivers/can/open_bus.hpp"
#include "drivers/stepper/cia301.hpp"
#include "nodes/runtime.hpp"
#include "nodes/system_config.hpp"

namespace bevel::test {
namespace {

using nodes::now;
constexpr std::int64_t kMs = 1'000'000;  // ns
constexpr std::uint32_t kNobodys = 0x7E0;

struct Ears {
  process_status_t stepper{};
  std::int64_t hops = 0;
  void on_status(const lcm::ReceiveBuffer*, const std::string&, const process_status_t* m) {
    if (m->process == "bevel-stepper") stepper = *m;
  }
  void on_hop(const lcm::ReceiveBuffer*, const std::string&, const motion_command_t*) { ++hops; }
};

class Bench {
 public:
  explicit Bench(const nodes::SystemConfig& config)
      : config_(config), writer_(can::open_bus(config.can)), reader_(can::open_bus(config.can)), lcm_(config.lcm_url) {
    lcm_.subscribe("PROCESS_STATUS", &Ears::on_status, &ears_);
    lcm_.subscribe("BENCH_HOP", &Ears::on_hop, &ears_);
  }

  bool arm() {
    const std::int64_t end_ns = now().ns + 8000 * kMs;
    while (now().ns < end_ns && ears_.stepper.state != "enabled") {
      command(0.0);
      if (ears_.stepper.state == "ready") say_arm();
      hear_for(20 * kMs);
    }
    return ears_.stepper.state == "enabled";
  }
  std::string said() const { return ears_.stepper.state + ": " + ears_.stepper.reason; }
  bool enabled() const { return ears_.stepper.state == "enabled"; }

  // ns; nothing where it took longer than 50 ms.
  std::optional<std::int64_t> hop() {
    const std::int64_t before = ears_.hops;
    return timed([&] { publish("BENCH_HOP", 0.0); },
                 [&] { return wait(lcm_.getFileno()) && lcm_.handleTimeout(0) > 0 && ears_.hops > before; });
  }
  std::optional<std::int64_t> write() {
    return timed([&] { (void)writer_->send({kNobodys, 8, {}}); }, [&] { return heard(kNobodys, {}); });
  }
  std::optional<std::int64_t> command_to_frame(double rate_mm_s) {
    const stepper::AxisConfig& axis = config_.stepper.axes[0];
    const auto counts_s = static_cast<std::uint32_t>(std::lround(rate_mm_s * axis.counts_per_unit));
    return timed([&] { command(rate_mm_s); }, [&] { return heard(stepper::cia301::rpdo1_id(axis.node_id), counts_s); });
  }
  void hear_for(std::int64_t ns) {
    for (const std::int64_t end_ns = now().ns + ns; now().ns < end_ns;) lcm_.handleTimeout(1);
    for (can::Bus* bus : {reader_.get(), writer_.get()}) {
      bus->maintain(now().ns);  // the rig, whose bus it is, may start later
      drain(*bus);
    }
  }

 private:
  template <class Act, class Done>
  static std::optional<std::int64_t> timed(const Act& act, const Done& done) {
    const std::int64_t begun_ns = now().ns;
    act();
    while (now().ns - begun_ns < 50 * kMs)
      if (done()) return now().ns - begun_ns;
    return std::nullopt;
  }
  static bool wait(int fd) {
    pollfd waited{fd, POLLIN, 0};
    return poll(&waited, 1, 20) > 0;
  }
  static void drain(can::Bus& bus) {
    while (bus.receive().kind != can::Reception::Kind::nothing) {
    }
  }
  bool heard(std::uint32_t id, std::optional<std::uint32_t> velocity) {
    (void)wait(reader_->poll_fd());
    for (auto found = reader_->receive(); found.kind != can::Reception::Kind::nothing; found = reader_->receive())
      if (found.frame.id == id && (!velocity || stepper::cia301::get_u32(found.frame, 2) == *velocity)) return true;
    return false;
  }
  void publish(const char* channel, double rate_mm_s) {
    motion_command_t m{};
    m.utime = now().utime;
    m.seq = seq_++;
    m.mode = 1;
    m.insertion_rate_mm_s = rate_mm_s;
    lcm_.publish(channel, &m);
  }
  void command(double rate_mm_s) { publish("MOTION_COMMAND", rate_mm_s); }
  void say_arm() {
    steering_target_t m{};
    m.utime = now().utime;
    m.seq = words_++;
    m.request = 1;
    m.session[1] = ears_.stepper.session;
    lcm_.publish("STEERING_TARGET", &m);
  }

  nodes::SystemConfig config_;
  std::unique_ptr<can::Bus> writer_, reader_;
  lcm::LCM lcm_;
  Ears ears_;
  std::int64_t seq_ = 0, words_ = 0;
};

double at_us(std::vector<std::int64_t>& samples, double share) {
  std::sort(samples.begin(), samples.end());
  return static_cast<double>(samples.at(static_cast<std::size_t>(share * static_cast<double>(samples.size() - 1)))) /
         1000;
}

int run(const std::string& file, int count) {
  const nodes::SystemConfig config = nodes::load_system_config(file);
  Bench bench(config);
  if (!bench.arm()) {
    std::printf("bevel-stepper was not enabled: %s\n", bench.said().c_str());
    return 1;
  }
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> pause_ns(8 * kMs, 18 * kMs);  // at every phase of the driver's cycle
  std::vector<std::int64_t> hops, writes, paths, sums;
  for (int i = 0; i < count && bench.enabled(); ++i) {
    const auto path = bench.command_to_frame(5.0 + 0.01 * (i % 20));
    const auto hop = bench.hop();
    const auto write = bench.write();
    if (path && hop && write) {
      paths.push_back(*path);
      hops.push_back(*hop);
      writes.push_back(*write);
      sums.push_back(*hop + *write);
    }
    bench.hear_for(pause_ns(random));
  }
  if (paths.size() < static_cast<std::size_t>(count) / 2) {
    std::printf("%zu of %d measured; bevel-stepper says %s\n", paths.size(), count, bench.said().c_str());
    return 1;
  }
  const auto line = [](const char* name, std::vector<std::int64_t>& samples) {
    std::printf("%-44s p50 %7.1f us   p99 %7.1f us\n", name, at_us(samples, 0.5), at_us(samples, 0.99));
  };
  line("bare LCM hop", hops);
  line("bare CAN write", writes);
  line("both, one after the other", sums);
  line("LCM command to CAN frame", paths);
  const double ratio = at_us(paths, 0.5) / at_us(sums, 0.5);
  std::printf("ratio at p50: %.2f, of %zu samples\n", ratio, paths.size());
  return 0;
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
