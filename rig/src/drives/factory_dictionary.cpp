// SPDX-License-Identifier: MIT
// What the simulated drive's objects are as it leaves the factory: CiA 301 from 0x1000, CiA 402 from 0x6000. The same
// list for other people's software is bevel_drive.eds beside this file; tests/drives/eds_test.cpp compares the two.
#include <bevel/rig/drives/object_dictionary.hpp>

namespace bevel::rig {
namespace {

constexpr std::uint32_t kPdoInvalid = 0x80000000;
constexpr std::int64_t kPositive = INT64_C(0x7FFFFFFF);

Object constant(std::uint8_t bytes, std::uint32_t value) { return {bytes, value, Access::read_only}; }
Object setting(std::uint8_t bytes, std::uint32_t value) { return {bytes, value}; }
Object ranged(std::uint8_t bytes, std::uint32_t value, std::int64_t low, std::int64_t high, bool is_signed = true) {
  return {bytes, value, Access::read_write, Mapping::none, low, high, is_signed};
}
// A number above zero: ramps, speeds, terms of a fraction.
Object positive(std::uint32_t value) { return ranged(4, value, 1, kPositive, false); }
Object text(const std::string& words) {
  return {0, 0, Access::read_only, Mapping::none, INT64_MIN, INT64_MAX, false, words};
}
Object actual(std::uint8_t bytes, bool is_signed) {
  return {bytes, 0, Access::read_only, Mapping::transmit, INT64_MIN, INT64_MAX, is_signed};
}

void add_communication(ObjectDictionary& od, std::uint8_t node, const Identity& identity) {
  od.add(0x1000, 0, constant(4, 0x00040192));  // stepper drive (4), profile 402
  od.add(0x1001, 0, constant(1, 0));
  od.add(0x1008, 0, text(identity.device_name));
  od.add(0x1009, 0, text(identity.hardware_version));
  od.add(0x100A, 0, text(identity.software_version));
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

void add_fraction(ObjectDictionary& od, std::uint16_t index, std::uint32_t numerator) {
  od.add(index, 0, constant(1, 2));
  od.add(index, 1, positive(numerator));
  od.add(index, 2, positive(1));
}

void add_profile(ObjectDictionary& od) {
  constexpr std::uint32_t kIncrementsPerRevolution = 51200;  // 200 full steps, each in 256
  od.add(0x6007, 0, ranged(2, 1, 0, 3));
  od.add(0x603F, 0, actual(2, false));
  od.add(0x6040, 0, {2, 0, Access::read_write, Mapping::both});
  od.add(0x6041, 0, actual(2, false));
  od.add(0x605A, 0, ranged(2, 2, 0, 6));
  od.add(0x605E, 0, ranged(2, 2, 0, 2));
  od.add(0x6060, 0, {1, 0, Access::read_write, Mapping::both, 0, 9, true});
  od.add(0x6061, 0, actual(1, true));
  od.add(0x6064, 0, actual(4, true));
  od.add(0x6065, 0, setting(4, 2000));
  od.add(0x6066, 0, setting(2, 50));
  od.add(0x606C, 0, actual(4, true));
  od.add(0x607C, 0, {4, 0, Access::read_write, Mapping::none, INT64_MIN, INT64_MAX, true});
  od.add(0x607D, 0, constant(1, 2));
  od.add(0x607D, 1, {4, 0x80000000, Access::read_write, Mapping::none, INT64_MIN, INT64_MAX, true});
  od.add(0x607D, 2, {4, 0x7FFFFFFF, Access::read_write, Mapping::none, INT64_MIN, INT64_MAX, true});
  od.add(0x607F, 0, ranged(4, 0x7FFFFFFF, 0, kPositive, false));
  od.add(0x6083, 0, positive(10000));
  od.add(0x6084, 0, positive(10000));
  // From 40000/s, the insertion axis' fastest, in 40 ms: a drive that nobody has configured stops in time as well.
  od.add(0x6085, 0, positive(1'000'000));
  add_fraction(od, 0x608F, kIncrementsPerRevolution);
  add_fraction(od, 0x6091, 1);
  add_fraction(od, 0x6092, kIncrementsPerRevolution);
  add_fraction(od, 0x6096, 1);
  od.add(0x6098, 0, ranged(1, 37, 0, 37));
  od.add(0x6099, 0, constant(1, 2));
  od.add(0x6099, 1, positive(4000));
  od.add(0x6099, 2, positive(400));
  od.add(0x609A, 0, positive(20000));
  od.add(0x60C2, 0, constant(1, 2));
  od.add(0x60C2, 1, ranged(1, 10, 1, 255, false));
  od.add(0x60C2, 2, ranged(1, 0xFD, -6, 0));  // ms
  od.add(0x60F4, 0, actual(4, true));
  od.add(0x60FD, 0, actual(4, false));
  od.add(0x60FF, 0, {4, 0, Access::read_write, Mapping::both, INT64_MIN, INT64_MAX, true});
  od.add(0x6502, 0, constant(4, 1U << 2 | 1U << 5 | 1U << 8));  // pv, hm, csv
}

}  // namespace

ObjectDictionary factory_dictionary(std::uint8_t node, const Identity& identity) {
  ObjectDictionary od;
  add_communication(od, node, identity);
  add_profile(od);
  return od;
}

}  // namespace bevel::rig
