// SPDX-License-Identifier: MIT
#include <bevel/drivers/commissioning/judgement.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>

namespace bevel::drivers {
namespace {

using stepper::kMs;

constexpr std::int64_t kSlowestMulticast_ns = 20 * kMs;  // a stop has as long to be passed on

template <typename... Values>
std::string text(const char* format, Values... values) {
  std::string line(256, '\0');
  line.resize(static_cast<std::size_t>(std::clamp(std::snprintf(line.data(), line.size(), format, values...), 0, 255)));
  return line;
}

double in_ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

Finding judged(std::string name, bool ok, std::string measured, std::string allowed, std::string remedy) {
  return {std::move(name), ok ? Verdict::ok : Verdict::failed, std::move(measured), std::move(allowed),
          ok ? "" : std::move(remedy)};
}

bool is_local(const std::string& address) { return address.starts_with("unix:"); }

std::string how_to_open(const std::string& address, const std::string& system_file) {
  if (is_local(address)) return "build/bin/bevel-rig --config " + system_file;
  return "sudo ip link set " + address + " up type can bitrate 500000 restart-ms 0; sudo ip link set " + address +
         " txqueuelen 10";
}

Finding judge_link(const BusMeasured& bus, const stepper::StepperConfig& config, const std::string& address,
                   const std::string& system_file) {
  const std::string name = "bus " + address;
  const double limit_ms = in_ms(config.echo_timeout_ns);
  const std::string allowed =
      text("open, no errors, what is sent on the wire within echo_timeout_ms (%.0f ms)", limit_ms);
  if (!bus.open || bus.lost)
    return judged(name, false, bus.lost ? "lost while it was measured" : "not open", allowed,
                  how_to_open(address, system_file));
  const std::string state = bus.bus_off ? ", bus-off" : bus.error_passive ? ", error-passive" : "";
  const auto waiting = bus.sent - std::min(bus.sent, bus.echoed);
  const bool ok = !bus.bus_off && !bus.error_passive && waiting == 0 && bus.slowest_echo_ns <= config.echo_timeout_ns;
  return judged(name, ok,
                text("%llu sent, %llu of them never on the wire, slowest %.1f ms; %llu heard%s",
                     static_cast<unsigned long long>(bus.sent), static_cast<unsigned long long>(waiting),
                     in_ms(bus.slowest_echo_ns), static_cast<unsigned long long>(bus.received), state.c_str()),
                allowed,
                is_local(address) ? "stop what keeps bevel-rig from running: it is the hub"
                                  : "ip -details -statistics link show " + address +
                                        "; nobody acknowledges: power of the drives, bit rate, termination");
}

Finding judge_identity(const DriveMeasured& drive, const stepper::AxisConfig& axis, stepper::VelocityMode mode,
                       const std::string& name, const std::string& system_file) {
  const std::array<std::uint32_t, 4> wanted{axis.vendor_id, axis.product_code, axis.revision, axis.serial};
  static constexpr std::array<const char*, 4> kKeys{"vendor_id", "product_code", "revision", "serial"};
  std::string allowed = text("CiA 402 (1000 = 0x....0192), mode %d (6502)", static_cast<int>(mode));
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (wanted.at(i) != 0) allowed += text(", %s 0x%X", kKeys.at(i), wanted.at(i));
  const int node = axis.node_id;
  const std::string keys = "stepper." + name + " in " + system_file;
  if (!drive.answered)
    return judged(name + " drive", false, text("node %d does not answer", node), allowed,
                  "power and node id of the drive; then node_id of " + keys);
  const std::string measured =
      text("node %d: %s, type 0x%X, vendor 0x%X, product 0x%X, revision 0x%X, serial 0x%X, modes 0x%X", node,
           drive.name.empty() ? "without a name" : drive.name.c_str(), drive.device_type, drive.identity[0],
           drive.identity[1], drive.identity[2], drive.identity[3], drive.modes);
  if (drive.refused_object)
    return judged(name + " drive", false,
                  measured + text("; object 0x%X refused with 0x%08X", *drive.refused_object, drive.refusal), allowed,
                  "the drive is no CiA 402 drive, or busy: switch it off and on");
  if ((drive.device_type & 0xFFFF) != 402)
    return judged(name + " drive", false, measured, allowed, "another device has this node id: node_id of " + keys);
  if ((drive.modes >> (static_cast<unsigned>(mode) - 1) & 1U) == 0)
    return judged(name + " drive", false, measured, allowed,
                  "mode of [stepper] in " + system_file + ": \"pv\" or \"csv\"");
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (wanted.at(i) != 0 && wanted.at(i) != drive.identity.at(i))
      return judged(
          name + " drive", false, measured, allowed,
          text("if this is the right drive: %s = 0x%X of %s", kKeys.at(i), drive.identity.at(i), keys.c_str()));
  return judged(name + " drive", true, measured, allowed, "");
}

// As bevel-stepper decides before it enables a drive. It sets the velocity factor 0x6096 to 1:1 itself.
Finding judge_velocity_unit(DriveMeasured drive, const stepper::AxisConfig& axis, std::size_t index) {
  const std::string name = index == stepper::kInsertion ? "insertion" : "rotation";
  auto& [numerator, divisor] = drive.units.factor;
  if (numerator) numerator = divisor = 1;
  const stepper::UnitDecision decision = stepper::scales_of(drive.units, axis);
  const bool ok = decision.refusal == stepper::StopReason::none;
  std::string measured = text("60A9 %s, 6096 %s; ",
                              drive.units.velocity_unit ? text("0x%08X", *drive.units.velocity_unit).c_str() : "absent",
                              numerator ? "present" : "absent");
  measured += ok ? text("%g velocity units in one count/s", decision.scales.velocity_per_count_s) : "not usable";
  const stepper::Stop refusal{
      .reason = decision.refusal, .axis = static_cast<int>(index), .code = decision.found, .object = decision.object};
  return judged(name + " velocity unit", ok, measured, "counts/s (6096), or a unit that can be converted",
                stepper::describe(refusal));
}

// The axis turns the needle once in 2 pi counts_per_unit. A ratio other than 1 is a gear, or an error that no report of
// the drive shows.
Finding judge_rotation_scale(const DriveMeasured& drive, const stepper::AxisConfig& axis) {
  const auto& [feed, revolutions] = drive.units.feed;
  const double configured = 2.0 * std::numbers::pi * std::abs(axis.counts_per_unit);
  if (!feed || !revolutions || *revolutions == 0)
    return {"rotation scale", Verdict::not_tried, "the drive does not state its counts per revolution (6092)", "", ""};
  const double stated = static_cast<double>(*feed) / *revolutions;
  return {"rotation scale", Verdict::not_tried,
          text("counts_per_unit gives %.0f counts in a revolution of the needle, the drive states %.0f in one of its "
               "shaft: ratio %.4f (1 without a gear)",
               configured, stated, configured / stated),
          "", ""};
}

Finding judge_heartbeat(const DriveMeasured& drive, const stepper::StepperConfig& config, const std::string& name) {
  // Of the time-out a third is left for what was not seen while it was watched.
  const std::int64_t allowed_ns = config.drive_heartbeat_timeout_ns * 2 / 3;
  const bool ok = drive.heartbeats > 0 && drive.longest_silence_ns <= allowed_ns;
  return judged(name + " heartbeat", ok,
                text("%u in %.1f s, longest silence %.0f ms", drive.heartbeats, in_ms(BusProbe::kWatch_ns) / 1000,
                     in_ms(drive.longest_silence_ns)),
                text("silent for %.0f ms at most, of drive_heartbeat_timeout_ms = %.0f", in_ms(allowed_ns),
                     in_ms(config.drive_heartbeat_timeout_ns)),
                drive.heartbeats == 0 ? "the drive does not take 0x1017: it cannot be supervised"
                                      : "what else loads the bus or this machine; then a shorter drive_heartbeat_ms of "
                                        "[stepper]");
}

}  // namespace

Finding judge_multicast(const MulticastMeasured& measured) {
  const std::string remedy =
      "sudo ip link set lo multicast on; sudo ip route add 224.0.0.0/4 dev lo (several machines: docs/running.md)";
  const std::string allowed = text("all, each within %.0f ms", in_ms(kSlowestMulticast_ns));
  if (!measured.started) return judged("multicast", false, "LCM does not start", allowed, remedy);
  return judged("multicast", measured.heard == measured.sent && measured.longest_ns <= kSlowestMulticast_ns,
                text("%d of %d messages came back, slowest after %.2f ms", measured.heard, measured.sent,
                     in_ms(measured.longest_ns)),
                allowed, measured.heard < measured.sent ? remedy : "end what else runs on this machine");
}

Findings judge_bus(const BusMeasured& bus, const stepper::StepperConfig& config, const std::string& address,
                   const std::string& system_file) {
  Findings findings{judge_link(bus, config, address, system_file)};
  for (std::size_t i = 0; i < stepper::kAxes; ++i) {
    const std::string name = i == stepper::kInsertion ? "insertion" : "rotation";
    if (!bus.open) {
      findings.push_back({name + " drive", Verdict::not_tried, "no bus", "", ""});
      continue;
    }
    if (bus.master_id) {
      findings.push_back({name + " drive", Verdict::not_tried,
                          text("not asked: a master commands the drives (heard 0x%X)", *bus.master_id), "", ""});
    } else {
      findings.push_back(judge_identity(bus.drives.at(i), config.axes.at(i), config.mode, name, system_file));
      if (bus.drives.at(i).answered) {
        findings.push_back(judge_velocity_unit(bus.drives.at(i), config.axes.at(i), i));
        if (i == stepper::kRotation) findings.push_back(judge_rotation_scale(bus.drives.at(i), config.axes.at(i)));
      }
    }
    if (bus.master_id || bus.drives.at(i).answered) findings.push_back(judge_heartbeat(bus.drives.at(i), config, name));
  }
  return findings;
}

Finding judge_timer(std::vector<std::int64_t> lateness_ns, std::int64_t period_ns, bool realtime) {
  std::sort(lateness_ns.begin(), lateness_ns.end());
  const auto at = [&](double share) {
    const auto place = static_cast<std::size_t>(share * static_cast<double>(lateness_ns.size() - 1));
    return lateness_ns.empty() ? INT64_MAX : lateness_ns.at(place);
  };
  // The driver counts a cycle that begins half a period late as an overrun.
  const std::int64_t allowed_ns = period_ns / 2;
  return judged(
      "timer", at(0.99) <= allowed_ns,
      text("%zu cycles of %.0f ms: late by %.2f ms (median), %.2f ms (99 %%), %.2f ms (most)%s", lateness_ns.size(),
           in_ms(period_ns), in_ms(at(0.5)), in_ms(at(0.99)), in_ms(at(1.0)), realtime ? ", SCHED_FIFO" : ""),
      text("99 %% within half a period, %.1f ms", in_ms(allowed_ns)),
      realtime ? "end what else runs on this machine"
               : "system.realtime = true, and: sudo setcap cap_sys_nice,cap_ipc_lock=ep build/bin/bevel-stepper "
                 "(likewise bevel-controller, bevel-check)");
}

Findings judge_cameras(std::map<int, CameraMeasured> cameras, const std::vector<int>& expected,
                       std::int64_t listened_ns, std::int64_t allowed_silence_ns) {
  if (cameras.empty())
    return {{"camera", Verdict::not_tried,
             text("none speaks in %.1f s: start bevel-camera to have it measured", in_ms(listened_ns) / 1000), "", ""}};
  for (const int number : expected) cameras.emplace(number, CameraMeasured{0, listened_ns});
  Findings findings;
  for (const auto& [number, camera] : cameras)
    findings.push_back(judged(
        text("camera %d", number), camera.longest_silence_ns <= allowed_silence_ns,
        text("%.1f pictures a second, longest silence %.0f ms", camera.messages / (in_ms(listened_ns) / 1000),
             in_ms(camera.longest_silence_ns)),
        text("silent for %.0f ms at most (estimator.limits.measurement_silence_s)", in_ms(allowed_silence_ns)),
        "a shorter exposure or a smaller picture: v4l2-ctl --list-formats-ext; source.rate_hz of the system file"));
  return findings;
}

std::string to_text(const Findings& findings) {
  std::ostringstream out;
  for (const Finding& f : findings) {
    const char* word = f.verdict == Verdict::ok ? "ok    " : f.verdict == Verdict::failed ? "FAILED" : "--    ";
    out << word << "  " << f.name << ": " << f.measured;
    if (!f.allowed.empty()) out << "; allowed: " << f.allowed;
    out << '\n';
    if (f.verdict == Verdict::failed) out << "        to fix it: " << f.remedy << '\n';
  }
  return out.str();
}

}  // namespace bevel::drivers
