// SPDX-License-Identifier: MIT
#include <bevel/nodes/fault_injector.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include <bevel/error.hpp>
#include <bevel/io/checked_decode.hpp>
#include <bevel/io/messages.hpp>

namespace bevel::nodes {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kRemembered_ns = 1'500 * kMs;

constexpr std::array<std::pair<FaultKind, const char*>, kFaultKinds> kKindNames{{
    {FaultKind::off, "off"},
    {FaultKind::stuck, "stuck"},
    {FaultKind::garbage, "garbage"},
    {FaultKind::wrong, "wrong"},
    {FaultKind::slow, "slow"},
    {FaultKind::delayed, "delayed"},
    {FaultKind::intermittent, "intermittent"},
    {FaultKind::replayed, "replayed"},
    {FaultKind::second_sender, "second_sender"},
}};
constexpr std::array<std::pair<Component, const char*>, kComponents> kComponentNames{{
    {Component::camera, "camera"},
    {Component::estimator, "estimator"},
    {Component::controller, "controller"},
    {Component::stepper, "stepper"},
    {Component::insertion_drive, "insertion_drive"},
    {Component::rotation_drive, "rotation_drive"},
}};

template <class Table, class Enum>
const char* lookup(const Table& table, Enum value) {
  for (const auto& [known, name] : table)
    if (known == value) return name;
  return "?";
}

template <class Table, class Enum>
void parse_name(const Table& table, const std::string& text, const char* what, Enum& value) {
  std::string allowed;
  for (const auto& [known, name] : table) {
    if (text == name) {
      value = known;
      return;
    }
    allowed += (allowed.empty() ? "" : ", ") + std::string(name);
  }
  throw ArgumentError("fault: no " + std::string(what) + " '" + text + "'; allowed: " + allowed);
}

// Something false that no check of a single message can see.
constexpr double kTurned_rad = 0.6;
void falsify(tip_heading_t& m) {
  // About an axis across the way in; vector and information together, or the checked decode would see it.
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(kTurned_rad, Eigen::Vector3d(1, -1, 0).normalized()).toRotationMatrix();
  Eigen::Map<Eigen::Vector3d> heading(m.heading);
  Eigen::Map<Eigen::Matrix3d> information(m.information_per_rad2);
  heading = (turn * heading).eval();
  information = (turn * information * turn.transpose()).eval();
  information = (0.5 * (information + information.transpose())).eval();
}
void falsify(tip_measurement_t& m) { m.position_mm[2] += 10, m.position_mm[m.camera == 0 ? 1 : 0] += 10; }
void falsify(needle_state_t& m) { m.position_mm[0] += 10; }
void falsify(motion_command_t& m) { m.mode = 1, m.insertion_rate_mm_s += 8, m.rotation_rate_rad_s -= 6; }
void falsify(actuator_state_t& m) { m.insertion_mm += 15, m.rotation_rad += 2; }

// Decodes, changes, encodes; what cannot be decoded stays as it is.
template <class Message, class Change>
bool altered_as(std::vector<std::uint8_t>& bytes, const Change& change) {
  auto decoded = io::checked_decode<Message>(bytes.data(), bytes.size());
  if (!decoded) return false;
  change(decoded.message);
  bytes = io::encode(decoded.message);
  return true;
}

template <class Change>
std::vector<std::uint8_t> altered(std::vector<std::uint8_t> bytes, const Change& change) {
  altered_as<tip_measurement_t>(bytes, change) || altered_as<tip_heading_t>(bytes, change) ||
      altered_as<needle_state_t>(bytes, change) || altered_as<motion_command_t>(bytes, change) ||
      altered_as<actuator_state_t>(bytes, change);
  return bytes;
}

}  // namespace

const char* name_of(FaultKind kind) { return lookup(kKindNames, kind); }
const char* name_of(Component component) { return lookup(kComponentNames, component); }

const char* channel_of(Component component) {
  switch (component) {
    case Component::camera:
      return io::channel::kTipMeasurement;
    case Component::estimator:
      return io::channel::kNeedleState;
    case Component::controller:
      return io::channel::kMotionCommand;
    case Component::stepper:
      return io::channel::kActuatorState;
    case Component::insertion_drive:
    case Component::rotation_drive:
      break;
  }
  return "";
}

std::vector<std::string> channels_of(Component component) {
  if (component == Component::camera) return {io::channel::kTipMeasurement, io::channel::kTipHeading};
  return {channel_of(component)};
}

Fault parse_fault(const std::string& text) {
  const std::size_t colon = text.find(':'), at = text.find('@');
  if (colon == std::string::npos || at == std::string::npos || at < colon || !text.ends_with('s'))
    throw ArgumentError("fault: '" + text + "' is not COMPONENT:KIND@SECONDSs, as in camera:off@5s");
  Fault fault;
  parse_name(kComponentNames, text.substr(0, colon), "component", fault.component);
  parse_name(kKindNames, text.substr(colon + 1, at - colon - 1), "kind", fault.kind);
  const char* begin = text.data() + at + 1;
  const char* end = text.data() + text.size() - 1;
  const auto [stop, error] = std::from_chars(begin, end, fault.at_s);
  if (error != std::errc{} || stop != end || !(fault.at_s >= 0 && fault.at_s <= 3600))
    throw ArgumentError("fault: time '" + std::string(begin, end) + "'; allowed: 0 to 3600 seconds");
  return fault;
}

bool FaultInjector::concerns(std::string_view channel) const {
  return std::ranges::find(channels_, channel) != channels_.end();
}

void FaultInjector::begin(FaultKind kind, std::int64_t start_ns, std::uint64_t seed) {
  kind_ = kind;
  start_ns_ = start_ns;
  own_seq_.assign(channels_.size(), 0);
  rng_.seed(seed);
  variant_ = (rng_() & 1U) != 0;
  shift_ns_ = static_cast<std::int64_t>(uniform(150, 500)) * kMs;
  block_until_ns_ = start_ns + static_cast<std::int64_t>(uniform(150, 400)) * kMs;
}

FaultInjector::Bytes FaultInjector::garbage(const Bytes& like) {
  Bytes bytes(variant_ ? like.size() : static_cast<std::size_t>(rng_() % 300));
  std::size_t from = 0;
  for (; variant_ && from < 8 && from < like.size(); ++from) bytes[from] = like[from];  // the type is right
  for (; from < bytes.size(); ++from) bytes[from] = static_cast<std::uint8_t>(rng_());
  return bytes;
}

const FaultInjector::Due* FaultInjector::newest_of(std::size_t channel) const {
  const auto found = std::find_if(past_.rbegin(), past_.rend(), [&](const Due& d) { return d.channel == channel; });
  return found == past_.rend() ? nullptr : &*found;
}

void FaultInjector::pass(std::string_view name, const Bytes& bytes, std::int64_t now_ns, std::int64_t now_utime) {
  const auto channel = static_cast<std::size_t>(std::ranges::find(channels_, name) - channels_.begin());
  if (channel == channels_.size())
    throw ArgumentError("fault injector: channel '" + std::string(name) + "'; allowed: of its component alone");
  if (now_ns < start_ns_) {
    past_.push_back({now_ns, channel, bytes});
    while (past_.front().at_ns < now_ns - kRemembered_ns) past_.pop_front();
    return emit_at(now_ns, channel, bytes);
  }
  switch (kind_) {
    case FaultKind::off:
      break;
    case FaultKind::stuck:
      // The bytes once more, or the old content as of now.
      if (const Due* newest = newest_of(channel); newest != nullptr && !variant_) {
        emit_at(now_ns, channel, newest->bytes);
      } else if (newest != nullptr) {
        std::int64_t seq = 0;
        altered(bytes, [&seq](auto& m) { seq = m.seq; });
        emit_at(now_ns, channel, altered(newest->bytes, [&](auto& m) { m.seq = seq, m.utime = now_utime; }));
      }
      break;
    case FaultKind::garbage:
      emit_at(now_ns, channel, garbage(bytes));
      break;
    case FaultKind::wrong:
      emit_at(now_ns, channel, altered(bytes, [](auto& m) { falsify(m); }));
      break;
    case FaultKind::slow:
      // With a position goes the heading of its frame.
      if (now_ns < block_until_ns_ && !(now_ns == slow_sent_ns_ && channel > slow_channel_)) break;
      slow_sent_ns_ = now_ns;
      slow_channel_ = channel;
      block_until_ns_ = now_ns + 250 * kMs;
      emit_at(now_ns, channel, bytes);
      break;
    case FaultKind::delayed:
      emit_at(now_ns + shift_ns_, channel, bytes);
      break;
    case FaultKind::intermittent:
      if (now_ns >= block_until_ns_ && now_ns >= pass_until_ns_) {
        pass_until_ns_ = now_ns + static_cast<std::int64_t>(uniform(30, 150)) * kMs;
        block_until_ns_ = pass_until_ns_ + static_cast<std::int64_t>(uniform(150, 400)) * kMs;
      }
      if (now_ns < pass_until_ns_) emit_at(now_ns, channel, bytes);
      break;
    case FaultKind::replayed:
      emit_at(now_ns, channel, bytes);
      if (past_.empty()) break;
      emit_at(now_ns, past_.front().channel, past_.front().bytes);
      past_.pop_front();
      break;
    case FaultKind::second_sender:
      emit_at(now_ns, channel, bytes);
      // Its numbers begin at zero, or run a little ahead of those that it heard.
      emit_at(now_ns, channel, altered(bytes, [&](auto& m) {
                falsify(m);
                m.seq = variant_ ? own_seq_[channel]++ : m.seq + 3;
                m.utime = now_utime + 1;
              }));
      break;
  }
}

void FaultInjector::flush(std::int64_t now_ns, const Emit& emit) {
  while (!due_.empty() && due_.front().at_ns <= now_ns) {
    const Due out = std::move(due_.front());
    due_.pop_front();
    emit(channels_[out.channel].c_str(), out.bytes);
  }
}

}  // namespace bevel::nodes
