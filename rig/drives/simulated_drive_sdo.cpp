// The simulated drive's SDO server (CiA 301 section 7.2.4, expedited transfers) and its rules for changing PDOs.
#include "rig/drives/little_endian.hpp"
#include "rig/drives/simulated_drive.hpp"

namespace bevel::rig {
namespace {

constexpr std::uint32_t kPdoInvalid = 0x80000000;
constexpr unsigned kPdoBits = 64;

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
    case 2:  // initiate upload
      abort = od_.check_presence(index, sub);
      if (abort == Abort::none) {
        update_status();
        const Object& object = *od_.find(index, sub);
        answer.data[0] = static_cast<std::uint8_t>(0x43 | (4 - object.bytes) << 2);
        store(answer, 4, object.value, object.bytes);
      }
      break;
    case 4:
      return;  // the client gives up
    default:
      abort = Abort::unknown_command;
  }
  if (abort != Abort::none) {
    answer.data[0] = 0x80;
    store(answer, 4, static_cast<std::uint32_t>(abort), 4);
  }
  send(answer);
}

Abort SimulatedDrive::write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) {
  Abort abort = od_.check_write(index, sub, value, bytes);
  if (abort == Abort::none && (is_communication(index) || is_mapping(index)))
    abort = check_pdo_setting(index, sub, value);
  if (abort != Abort::none) return abort;
  od_.set(index, sub, value);
  written(index);
  return Abort::none;
}

Abort SimulatedDrive::check_pdo_setting(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const {
  if (nmt_ != NmtState::pre_operational) return Abort::wrong_state;
  if (is_communication(index)) {
    // While a PDO is valid its identifier stays: only bit 31 may be set.
    const std::uint32_t now = od_.get(index, 1);
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
