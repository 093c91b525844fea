// SPDX-License-Identifier: MIT
// The simulated drive's SDO server (CiA 301 section 7.2.4; expedited transfers, and texts in segments) and its rules
// for changing PDOs.
#include <algorithm>

#include <bevel/rig/drives/simulated_drive.hpp>
#include "drives/little_endian.hpp"

namespace bevel::rig {
namespace {

constexpr std::uint32_t kPdoInvalid = 0x80000000;
constexpr unsigned kPdoBits = 64;
constexpr unsigned kExpeditedBytes = 4;
constexpr std::size_t kSegmentBytes = 7;
constexpr std::uint8_t kToggle = 0x10;
constexpr std::uint32_t kNoRtr = 0x40000000;  // bit 30 of a COB-ID

bool between(std::uint16_t index, std::uint16_t first) { return index >= first && index < first + 4; }
bool is_communication(std::uint16_t index) { return between(index, 0x1400) || between(index, 0x1800); }
bool is_mapping(std::uint16_t index) { return between(index, 0x1600) || between(index, 0x1A00); }
bool is_transmit(std::uint16_t mapping) { return mapping >= 0x1A00; }

}  // namespace

void SimulatedDrive::on_sdo(const can::Frame& frame) {
  if (nmt_ == NmtState::stopped || frame.size != 8) return;
  const std::uint8_t command = frame.data[0];
  const auto index = static_cast<std::uint16_t>(load(frame, 1, 2));
  const std::uint8_t sub = frame.data[3];
  can::Frame answer{0x580U + config_.node_id, 8, {}};
  store(answer, 1, index, 2);
  answer.data[3] = sub;

  Abort abort = Abort::none;
  switch (command >> 5) {
    case 1:  // initiate download
      if ((command & 0x02) == 0) {
        abort = Abort::unknown_command;  // segmented
      } else {
        const unsigned bytes = (command & 0x01) != 0 ? 4U - ((command >> 2) & 3U) : 4U;
        abort = write(index, sub, load(frame, 4, bytes), bytes);
        answer.data[0] = 0x60;
      }
      break;
    case 2:
      abort = begin_upload(index, sub, answer);
      break;
    case 3:
      abort = next_segment(command, answer);
      break;
    case 4:  // the client gives up
      uploading_ = false;
      return;
    default:
      abort = Abort::unknown_command;
  }
  if (abort != Abort::none) {
    uploading_ = false;
    answer.data[0] = 0x80;
    store(answer, 1, index, 2);
    answer.data[3] = sub;
    store(answer, 4, static_cast<std::uint32_t>(abort), 4);
  }
  send(answer);
}

Abort SimulatedDrive::begin_upload(std::uint16_t index, std::uint8_t sub, can::Frame& answer) {
  if (const Abort absent = od_.check_presence(index, sub); absent != Abort::none) return absent;
  update_status();
  const Object& object = *od_.find(index, sub);
  uploading_ = object.text.size() > kExpeditedBytes;
  if (uploading_) {
    upload_ = object.text;
    toggle_ = 0;
    answer.data[0] = 0x41;
    store(answer, 4, static_cast<std::uint32_t>(upload_.size()), 4);
    return Abort::none;
  }
  const auto bytes = object.text.empty() ? object.bytes : static_cast<unsigned>(object.text.size());
  answer.data[0] = static_cast<std::uint8_t>(0x43 | (kExpeditedBytes - bytes) << 2);
  if (object.text.empty()) {
    store(answer, 4, object.value, bytes);
  } else {
    std::copy(object.text.begin(), object.text.end(), answer.data.begin() + 4);
  }
  return Abort::none;
}

// Seven characters an answer; a toggle bit tells a request that came twice from the next one.
Abort SimulatedDrive::next_segment(std::uint8_t command, can::Frame& answer) {
  if (!uploading_) return Abort::unknown_command;
  if ((command & kToggle) != toggle_) return Abort::toggle;
  const std::size_t bytes = std::min(upload_.size(), kSegmentBytes);
  const bool last = bytes == upload_.size();
  answer.data = {};
  answer.data[0] = static_cast<std::uint8_t>(toggle_ | (kSegmentBytes - bytes) << 1 | (last ? 1U : 0U));
  std::copy_n(upload_.begin(), bytes, answer.data.begin() + 1);
  upload_.erase(0, bytes);
  toggle_ ^= kToggle;
  uploading_ = !last;
  return Abort::none;
}

Abort SimulatedDrive::write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) {
  Abort abort = od_.check_write(index, sub, value, bytes);
  const auto& rejects = config_.dialect.rejects;
  if (const auto found = rejects.find({index, sub}); abort == Abort::none && found != rejects.end())
    abort = found->second;
  if (abort == Abort::none && (is_communication(index) || is_mapping(index)))
    abort = check_pdo_setting(index, sub, value);
  if (abort == Abort::none) abort = check_profile_setting(index, sub, value);
  if (abort != Abort::none) return abort;
  od_.set(index, sub, value);
  written(index);
  return Abort::none;
}

// What a range cannot say.
Abort SimulatedDrive::check_profile_setting(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const {
  const auto number = static_cast<std::int32_t>(value);
  bool allowed = true;
  switch (index) {
    case 0x605A:  // braking by the current limit or the voltage is not there to be simulated
      allowed = number != 3 && number != 4;
      break;
    case 0x6060:
      allowed = number == 0 || number == 3 || number == 6 || number == 9;
      break;
    case 0x607D:
      allowed = sub == 1 ? number < od_.get_signed(0x607D, 2) : number > od_.get_signed(0x607D, 1);
      break;
    case 0x6098:
      allowed = number == 0 || Homing::knows(number);
      break;
    default:
      break;
  }
  return allowed ? Abort::none : Abort::value_range;
}

Abort SimulatedDrive::check_pdo_setting(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const {
  if (nmt_ != NmtState::pre_operational) return Abort::wrong_state;
  if (is_communication(index)) {
    // While a PDO is valid its identifier stays: only bit 31 may be set.
    const std::uint32_t now = od_.get(index, 1);
    const bool bit_30 = (value & kNoRtr) != 0;
    const bool is_tpdo = index >= 0x1800;
    if (sub == 1 &&
        ((config_.dialect.needs_bit_30 && is_tpdo && !bit_30) || (config_.dialect.rejects_bit_30 && bit_30)))
      return Abort::value_range;
    const bool keeps_id = (value & ~kPdoInvalid) == (now & ~kPdoInvalid);
    return sub == 1 && (now & kPdoInvalid) == 0 && !keeps_id ? Abort::wrong_state : Abort::none;
  }
  const auto communication = static_cast<std::uint16_t>(index - 0x200);
  if ((od_.get(communication, 1) & kPdoInvalid) == 0) return Abort::wrong_state;
  if (sub == 0) return check_mapping_length(index, value);
  if (od_.get(index, 0) != 0) return Abort::wrong_state;
  return check_mapping(index, value);
}

Abort SimulatedDrive::check_mapping(std::uint16_t index, std::uint32_t entry) const {
  if (entry == 0) return Abort::none;  // taken out again; check_mapping_length() lets it not be counted
  const auto target = static_cast<std::uint16_t>(entry >> 16);
  const auto target_sub = static_cast<std::uint8_t>(entry >> 8);
  if (const Abort absent = od_.check_presence(target, target_sub); absent != Abort::none) return absent;
  const Object& object = *od_.find(target, target_sub);
  const Mapping wanted = is_transmit(index) ? Mapping::transmit : Mapping::receive;
  const bool allowed = object.mapping == wanted || object.mapping == Mapping::both;
  return allowed && (entry & 0xFF) == object.bytes * 8U ? Abort::none : Abort::not_mappable;
}

Abort SimulatedDrive::check_mapping_length(std::uint16_t mapping, std::uint32_t count) const {
  unsigned bits = 0;
  for (std::uint32_t n = 1; n <= count; ++n) {
    const std::uint32_t entry = od_.get(mapping, static_cast<std::uint8_t>(n));
    if (entry == 0) return Abort::no_object;
    bits += entry & 0xFF;
  }
  return bits > kPdoBits ? Abort::pdo_too_long : Abort::none;
}

}  // namespace bevel::rig
