// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Object dictionary of the simulated drive: each object with its size, access, range and PDO mapping.

#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace bevel::rig {

/// SDO abort codes (CiA 301, table 22); none: no abort.
enum class Abort : std::uint32_t {
  none = 0,                      ///< no abort
  toggle = 0x05030000,           ///< toggle bit not alternated
  time_out = 0x05040000,         ///< SDO protocol timed out
  unknown_command = 0x05040001,  ///< command specifier not valid or unknown
  write_only = 0x06010001,       ///< attempt to read a write-only object
  read_only = 0x06010002,        ///< attempt to write a read-only object
  no_object = 0x06020000,        ///< object does not exist
  not_mappable = 0x06040041,     ///< object cannot be mapped to a PDO
  pdo_too_long = 0x06040042,     ///< mapped objects exceed the length of a PDO
  length_too_high = 0x06070012,  ///< value is longer than the object
  length_too_low = 0x06070013,   ///< value is shorter than the object
  no_sub_index = 0x06090011,     ///< sub-index does not exist
  value_range = 0x06090030,      ///< value out of range
  wrong_state = 0x08000022,      ///< not possible in the present state of the device
};

/// Access by SDO.
enum class Access : std::uint8_t {
  read_only,  ///< read only
  read_write  ///< read and write
};
/// PDOs that may contain the object.
enum class Mapping : std::uint8_t {
  none,      ///< no PDO
  transmit,  ///< PDOs that the drive transmits
  receive,   ///< PDOs that the drive receives
  both       ///< PDOs of both directions
};

/// One entry of the dictionary.
struct Object {
  std::uint8_t bytes = 4;              ///< size: 1, 2 or 4 bytes; not used for a text
  std::uint32_t value = 0;             ///< present value
  Access access = Access::read_write;  ///< access by SDO
  Mapping mapping = Mapping::none;     ///< PDOs that may contain the object
  std::int64_t low = INT64_MIN;        ///< smallest allowed value, signed if is_signed
  std::int64_t high = INT64_MAX;       ///< largest allowed value, signed if is_signed
  bool is_signed = false;              ///< the value is signed
  std::string text{};                  ///< constant text of a VISIBLE_STRING, which has no value
};

/// Stores the entries of the dictionary.
class ObjectDictionary {
 public:
  /// Index and sub-index of an entry.
  using Key = std::pair<std::uint16_t, std::uint8_t>;

  /// Adds or replaces an entry.
  /// @param index  index
  /// @param sub    sub-index
  /// @param object entry
  void add(std::uint16_t index, std::uint8_t sub, const Object& object) { objects_[{index, sub}] = object; }

  /// Removes an entry, if it exists.
  /// @param key index and sub-index
  void remove(const Key& key) { objects_.erase(key); }

  /// Finds an entry.
  /// @param index index
  /// @param sub   sub-index
  /// @return entry; null if it does not exist
  const Object* find(std::uint16_t index, std::uint8_t sub) const;
  /// Returns the value of an entry.
  /// @param index index
  /// @param sub   sub-index
  /// @return value
  /// @throws std::out_of_range if the entry does not exist
  std::uint32_t get(std::uint16_t index, std::uint8_t sub = 0) const;
  /// Returns the sign-extended value of an entry.
  /// @param index index
  /// @param sub   sub-index
  /// @return value
  /// @throws std::out_of_range if the entry does not exist
  std::int32_t get_signed(std::uint16_t index, std::uint8_t sub = 0) const;
  /// Sets a value as the drive itself does, without a check of the access.
  /// @param index index
  /// @param sub   sub-index
  /// @param value value
  /// @throws std::out_of_range if the entry does not exist
  void set(std::uint16_t index, std::uint8_t sub, std::uint32_t value);

  /// Restores the values of all entries in a range of indices.
  /// @param source dictionary with the values; must have these entries
  /// @param first  first index
  /// @param last   last index
  /// @throws std::out_of_range if `source` lacks an entry
  void restore(const ObjectDictionary& source, std::uint16_t first, std::uint16_t last);

  /// @return all entries
  const std::map<Key, Object>& all() const { return objects_; }

  /// Checks whether an entry exists.
  /// @param index index
  /// @param sub   sub-index
  /// @return Abort::none, no_object or no_sub_index
  Abort check_presence(std::uint16_t index, std::uint8_t sub) const;
  /// Checks whether the master may write a value.
  /// @param index index
  /// @param sub   sub-index
  /// @param value value
  /// @param bytes size of the value, bytes
  /// @return Abort::none, or the reason to reject it: presence, access, length, range
  Abort check_write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) const;

 private:
  std::map<Key, Object> objects_;
};

/// Sign-extends a value.
/// @param value value
/// @param bytes size of the value: 1, 2 or 4 bytes
/// @return signed value
std::int32_t sign_extended(std::uint32_t value, unsigned bytes);

/// Identity of the simulated drive.
struct Identity {
  std::uint32_t vendor = 0x00000BEE;                          ///< object 0x1018:1
  std::uint32_t product = 402;                                ///< object 0x1018:2
  std::uint32_t revision = 1;                                 ///< object 0x1018:3
  std::uint32_t serial = 1;                                   ///< object 0x1018:4
  std::string device_name = "Bevel simulated stepper drive";  ///< object 0x1008
  std::string hardware_version = "simulated";                 ///< object 0x1009
  std::string software_version = "2.0";                       ///< object 0x100A
};
/// Creates the dictionary of a stepper drive with factory settings.
/// @param node     node id, 1..127
/// @param identity identity of the drive
/// @return dictionary
ObjectDictionary factory_dictionary(std::uint8_t node, const Identity& identity);

}  // namespace bevel::rig
