// SPDX-License-Identifier: MIT
#include <bevel/rig/drives/object_dictionary.hpp>

namespace bevel::rig {

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

}  // namespace bevel::rig
