#include "rig/drives/object_dictionary.hpp"

namespace bevel::rig {
namespace {

constexpr std::uint32_t kPdoInvalid = 0x80000000;

Object constant(std::uint8_t bytes, std::uint32_t value) { return {bytes, value, Access::read_only}; }
Object setting(std::uint8_t bytes, std::uint32_t value) { return {bytes, value}; }
Object ranged(std::uint8_t bytes, std::uint32_t value, std::int64_t low, std::int64_t high, bool is_signed = true) {
  return {bytes, value, Access::read_write, Mapping::none, low, high, is_signed};
}

void add_communication(ObjectDictionary& od, std::uint8_t node, const Identity& identity) {
  od.add(0x1000, 0, constant(4, 0x00040192));  // stepper drive (4), profile 402
  od.add(0x1001, 0, constant(1, 0));
  od.add(0x1016, 0, constant(1, 1));
  od.add(0x1016, 1, setting(4, 0));
  od.add(0x1017, 0, setting(2, 0));
  od.add(0x1018, 0, constant(1, 4));
  od.add(0x1018, 1, constant(4, identity.vendor));
  od.add(0x1018, 2, constant(4, identity.product));
  od.add(0x1018, 3, constant(4, identity.revision));
  od.add(0x1018, 4, constant(4, identity.serial));
  od.add(0x1029, 0, constant(1, 1));
  od.add(0x1029, 1, ranged(1, 0, 0, 2, false));
  constexpr std::uint16_t kPdos = 4;
  for (std::uint16_t n = 0; n < kPdos; ++n) {
    for (const bool transmit : {false, true}) {
      const auto communication = static_cast<std::uint16_t>((transmit ? 0x1800 : 0x1400) + n);
      const auto mapping = static_cast<std::uint16_t>((transmit ? 0x1A00 : 0x1600) + n);
      const std::uint32_t cob_id = (transmit ? 0x180U : 0x200U) + 0x100U * n + node;
      od.add(communication, 0, constant(1, 5));
      od.add(communication, 1, setting(4, cob_id | kPdoInvalid));
      od.add(communication, 2, setting(1, 255));
      od.add(communication, 5, setting(2, 0));
      od.add(mapping, 0, ranged(1, 0, 0, 8, false));
      for (std::uint8_t sub = 1; sub <= 8; ++sub) od.add(mapping, sub, setting(4, 0));
    }
  }
}

void add_profile(ObjectDictionary& od) {
  constexpr std::int64_t kPositive = INT64_C(0x7FFFFFFF);
  const auto transmitted = [](std::uint8_t bytes, bool is_signed) {
    return Object{bytes, 0, Access::read_only, Mapping::transmit, INT64_MIN, INT64_MAX, is_signed};
  };
  od.add(0x6007, 0, ranged(2, 1, 0, 3));
  od.add(0x603F, 0, transmitted(2, false));
  od.add(0x6040, 0, {2, 0, Access::read_write, Mapping::both});
  od.add(0x6041, 0, transmitted(2, false));
  od.add(0x605A, 0, ranged(2, 2, 0, 7));
  od.add(0x605E, 0, ranged(2, 2, 0, 2));
  od.add(0x6060, 0, {1, 0, Access::read_write, Mapping::both, -128, 127, true});
  od.add(0x6061, 0, transmitted(1, true));
  od.add(0x6064, 0, transmitted(4, true));
  od.add(0x6065, 0, setting(4, 2000));
  od.add(0x6066, 0, setting(2, 50));
  od.add(0x606C, 0, transmitted(4, true));
  od.add(0x607F, 0, ranged(4, 0x7FFFFFFF, 0, kPositive, false));
  od.add(0x6083, 0, ranged(4, 10000, 1, kPositive, false));
  od.add(0x6084, 0, ranged(4, 10000, 1, kPositive, false));
  od.add(0x6085, 0, ranged(4, 50000, 1, kPositive, false));
  od.add(0x60FF, 0, {4, 0, Access::read_write, Mapping::both, INT64_MIN, INT64_MAX, true});
  od.add(0x6502, 0, constant(4, 1U << 2));  // profile velocity only
}

}  // namespace

std::int32_t sign_extended(std::uint32_t value, unsigned bytes) {
  if (bytes == 1) return static_cast<std::int8_t>(value);
  if (bytes == 2) return static_cast<std::int16_t>(value);
  return static_cast<std::int32_t>(value);
}

const Object* ObjectDictionary::find(std::uint16_t index, std::uint8_t sub) const {
  const auto found = objects_.find({index, sub});
  return found == objects_.end() ? nullptr : &found->second;
}

std::uint32_t ObjectDictionary::get(std::uint16_t index, std::uint8_t sub) const {
  return objects_.at({index, sub}).value;
}

std::int32_t ObjectDictionary::get_signed(std::uint16_t index, std::uint8_t sub) const {
  const Object& object = objects_.at({index, sub});
  return sign_extended(object.value, object.bytes);
}

void ObjectDictionary::set(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
  objects_.at({index, sub}).value = value;
}

void ObjectDictionary::restore(const ObjectDictionary& source, std::uint16_t first, std::uint16_t last) {
  for (auto& [key, object] : objects_)
    if (key.first >= first && key.first <= last) object.value = source.objects_.at(key).value;
}

Abort ObjectDictionary::check_presence(std::uint16_t index, std::uint8_t sub) const {
  if (objects_.contains({index, sub})) return Abort::none;
  const auto next = objects_.lower_bound({index, std::uint8_t{0}});
  return next != objects_.end() && next->first.first == index ? Abort::no_sub_index : Abort::no_object;
}

Abort ObjectDictionary::check_write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) const {
  if (const Abort absent = check_presence(index, sub); absent != Abort::none) return absent;
  const Object& object = objects_.at({index, sub});
  if (object.access == Access::read_only) return Abort::read_only;
  if (bytes > object.bytes) return Abort::length_too_high;
  if (bytes < object.bytes) return Abort::length_too_low;
  const std::int64_t number = object.is_signed ? std::int64_t{sign_extended(value, bytes)} : std::int64_t{value};
  return number < object.low || number > object.high ? Abort::value_range : Abort::none;
}

ObjectDictionary factory_dictionary(std::uint8_t node, const Identity& identity) {
  ObjectDictionary od;
  add_communication(od, node, identity);
  add_profile(od);
  return od;
}

}  // namespace bevel::rig
