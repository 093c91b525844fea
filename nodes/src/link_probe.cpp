// SPDX-License-Identifier: MIT
#include <bevel/nodes/link_probe.hpp>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <thread>
#include <utility>

#include <bevel/drivers/can/open_bus.hpp>
#include <bevel/error.hpp>
#include <bevel/nodes/open_lcm.hpp>
#include <bevel/nodes/runtime.hpp>

namespace bevel::nodes {

using namespace drivers;  // NOLINT(google-build-using-namespace): what is measured and judged

namespace {

using stepper::kMs;

constexpr const char* kChannel = "BEVEL_CHECK";
constexpr std::int64_t kCameraListen_ns = 1500 * kMs;
constexpr int kRealtimePriority = 50;  // bevel-stepper's

struct Ears {
  std::int64_t awaited = 0;
  bool heard = false;
  void on_message(const lcm::ReceiveBuffer* buffer, const std::string&) {
    std::int64_t got = 0;
    if (buffer->data_size != sizeof got) return;
    std::memcpy(&got, buffer->data, sizeof got);
    heard = heard || got == awaited;
  }
};

}  // namespace

MulticastMeasured measure_multicast(lcm::LCM& lcm) {
  MulticastMeasured measured;
  // The second starts the receiver; a subscription crashes where that fails.
  measured.started = lcm.good() && lcm.getFileno() >= 0;
  if (!measured.started) return measured;
  Ears ears;
  lcm::Subscription* const subscription = lcm.subscribe(kChannel, &Ears::on_message, &ears);
  // Another bevel-check on this network must not answer for this one.
  const std::int64_t nonce = nodes::now().ns;
  constexpr int kMessages = 20;
  constexpr std::int64_t kWait_ns = 250 * kMs;
  for (int i = 0; i < kMessages; ++i) {
    ears = {nonce + i, false};
    const std::int64_t sent_ns = nodes::now().ns;
    if (lcm.publish(kChannel, &ears.awaited, sizeof ears.awaited) == 0) ++measured.sent;
    while (!ears.heard && nodes::now().ns - sent_ns < kWait_ns) lcm.handleTimeout(10);
    if (!ears.heard && measured.heard == 0 && i == 3) break;
    if (!ears.heard) continue;
    ++measured.heard;
    measured.longest_ns = std::max(measured.longest_ns, nodes::now().ns - sent_ns);
  }
  lcm.unsubscribe(subscription);
  return measured;
}

Findings check_bus(const stepper::StepperConfig& config, const std::string& address, const std::string& system_file,
                   const std::function<void()>& meanwhile) {
  std::unique_ptr<can::Bus> bus;
  try {
    bus = can::open_bus(address);
  } catch (const Error& e) {
    return {{"bus " + address, Verdict::failed, e.what(), "a CAN interface, or unix:/path of the rig's local bus",
             "sudo modprobe can_raw; ip link show type can; system.can of " + system_file}};
  }
  BusProbe probe(*bus, config);
  while (!probe.done() && !nodes::stop_requested()) {
    probe.step(nodes::now().ns);
    meanwhile();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return judge_bus(probe.measured(), config, address, system_file);
}

std::vector<std::int64_t> measure_lateness(std::int64_t period_ns) {
  constexpr std::int64_t kMeasure_ns = 1000 * kMs;
  std::vector<std::int64_t> lateness_ns;
  const auto cycles = static_cast<std::size_t>(std::max<std::int64_t>(kMeasure_ns / period_ns, 1));
  lateness_ns.reserve(cycles);
  std::int64_t due_ns = nodes::now().ns;
  for (std::size_t i = 0; i < cycles && !nodes::stop_requested(); ++i) {
    due_ns += period_ns;
    const timespec due{due_ns / 1'000'000'000, due_ns % 1'000'000'000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR && !nodes::stop_requested()) {
    }
    const std::int64_t woken_ns = nodes::now().ns;
    lateness_ns.push_back(woken_ns - due_ns);
    due_ns = std::max(due_ns, woken_ns - period_ns);  // missed cycles are not caught up
  }
  return lateness_ns;
}

CameraEars::CameraEars(lcm::LCM& lcm) : lcm_(lcm), begun_ns_(nodes::now().ns), port_(lcm) {
  port_.subscribe<tip_measurement_t>(io::channel::kTipMeasurement, [this](const tip_measurement_t& m) {
    const std::int64_t now_ns = nodes::now().ns;
    const auto last = last_ns_.emplace(m.camera, begun_ns_).first;
    CameraMeasured& camera = cameras_[m.camera];
    ++camera.messages;
    camera.longest_silence_ns = std::max(camera.longest_silence_ns, now_ns - last->second);
    last->second = now_ns;
  });
}

void CameraEars::listen() { nodes::pump(lcm_); }

std::int64_t CameraEars::listened_ns() const { return nodes::now().ns - begun_ns_; }

std::map<int, CameraMeasured> CameraEars::heard() const {
  auto cameras = cameras_;
  for (auto& [number, camera] : cameras)
    camera.longest_silence_ns = std::max(camera.longest_silence_ns, nodes::now().ns - last_ns_.at(number));
  return cameras;
}

Findings check_all(const nodes::SystemConfig& config, const std::string& lcm_url, const std::string& can,
                   const std::string& system_file) {
  Findings all;
  const auto add = [&all](const Findings& more) { all.insert(all.end(), more.begin(), more.end()); };
  nodes::warn_of_lcm_url(lcm_url);
  lcm::LCM lcm(lcm_url);
  const MulticastMeasured multicast = measure_multicast(lcm);
  all.push_back(judge_multicast(multicast));
  if (multicast.started) {
    CameraEars ears(lcm);
    add(check_bus(config.stepper, can, system_file, [&ears] { ears.listen(); }));
    while (ears.listened_ns() < kCameraListen_ns && !nodes::stop_requested()) lcm.handleTimeout(10);
    std::vector<int> numbers;
    for (const nodes::CameraViewConfig& camera : config.cameras) numbers.push_back(camera.camera);
    add(judge_cameras(ears.heard(), numbers, ears.listened_ns(),
                      static_cast<std::int64_t>(config.estimator.limits.measurement_silence_s * 1e9)));
  } else {
    add(check_bus(config.stepper, can, system_file, [] {}));
  }
  const bool realtime = config.realtime && nodes::try_realtime(kRealtimePriority).empty();
  all.push_back(judge_timer(measure_lateness(config.stepper.period_ns), config.stepper.period_ns, realtime));
  return all;
}

}  // namespace bevel::nodes
