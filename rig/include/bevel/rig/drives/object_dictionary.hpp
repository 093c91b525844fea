// SPDX-License-Identifier: MIT
// The object dictionary of the simulated drive: every object with its size, access, range and whether a PDO may carry
// it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace bevel::rig {

// SDO abort codes of CiA 301, table 22. none is not one of them.
enum class Abort : std::uint32_t {
  none = 0,
  toggle = 0x05030000,
  time_out = 0x05040000,
  unknown_command = 0x05040001,
  write_only = 0x06010001,
  read_only = 0x06010002,
  no_object = 0x06020000,
  not_mappable = 0x06040041,
  pdo_too_long = 0x06040042,
  length_too_high = 0x06070012,
  length_too_low = 0x06070013,
  no_sub_index = 0x06090011,
  value_range = 0x06090030,
  wrong_state = 0x08000022,
};

enum class Access : std::uint8_t { read_only, read_write };
enum class Mapping : std::uint8_t { none, transmit, receive, both };

struct Object {
  std::uint8_t bytes = 4;  // 1, 2 or 4; of a text none
  std::uint32_t value = 0;
  Access access = Access::read_write;
  Mapping mapping = Mapping::none;
  std::int64_t low = INT64_MIN;  // allowed values; of the signed value where is_signed
  std::int64_t high = INT64_MAX;
  bool is_signed = false;
  std::string text{};  // of a VISIBLE_STRING, which has no value; constant
};

class ObjectDictionary {
 public:
  using Key = std::pair<std::uint16_t, std::uint8_t>;

  void add(std::uint16_t index, std::uint8_t sub, const Object& object) { objects_[{index, sub}] = object; }

  void remove(const Key& key) { objects_.erase(key); }

  const Object* find(std::uint16_t index, std::uint8_t sub) const;
  std::uint32_t get(std::uint16_t index, std::uint8_t sub = 0) const;  // throws DomainError
  std::int32_t get_signed(std::uint16_t index, std::uint8_t sub = 0) const;
  void set(std::uint16_t index, std::uint8_t sub, std::uint32_t value);  // by the drive itself: no access check

  // Every object from index `first` to `last` has its value in `source` again.
  void restore(const ObjectDictionary& source, std::uint16_t first, std::uint16_t last);

  const std::map<Key, Object>& all() const { return objects_; }

  Abort check_presence(std::uint16_t index, std::uint8_t sub) const;
  Abort check_write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) const;

 private:
  std::map<Key, Object> objects_;
};

// Sign-extends a value of 1, 2 or 4 bytes.
std::int32_t sign_extended(std::uint32_t value, unsigned bytes);

// The dictionary of a stepper drive as it leaves the factory.
struct Identity {
  std::uint32_t vendor = 0x00000BEE;
  std::uint32_t product = 402;
  std::uint32_t revision = 1;
  std::uint32_t serial = 1;
  std::string device_name = "Bevel simulated stepper drive";  // 1008
  std::string hardware_version = "simulated";                 // 1009
  std::string software_version = "2.0";                       // 100A
};
ObjectDictionary factory_dictionary(std::uint8_t node, const Identity& identity);

}  // namespace bevel::rig
