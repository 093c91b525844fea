// SPDX-License-Identifier: MIT
// rig/src/drives/bevel_drive.eds against the drive: every object of the file is asked for and written to over SDO, and
// the drive has none that the file lacks.
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <set>
#include <string>

#include "tests/drives/raw_drive.hpp"

namespace bevel::test {
namespace {

using Section = std::map<std::string, std::string>;

std::map<std::string, Section> read_eds() {
  std::ifstream file(BEVEL_SOURCE_DIR "/rig/src/drives/bevel_drive.eds");
  EXPECT_TRUE(file.good());
  std::map<std::string, Section> sections;
  std::string line, name;
  while (std::getline(file, line)) {
    if (line.empty() || line.front() == ';') continue;
    if (line.front() == '[') {
      name = line.substr(1, line.find(']') - 1);
    } else {
      const auto equals = line.find('=');
      EXPECT_TRUE(sections[name].emplace(line.substr(0, equals), line.substr(equals + 1)).second) << line;
    }
  }
  return sections;
}

struct Described {
  unsigned bytes;  // 0: a text
  bool is_signed;
};
const std::map<int, Described> kTypes{{2, {1, true}},  {3, {2, true}},  {4, {4, true}}, {5, {1, false}},
                                      {6, {2, false}}, {7, {4, false}}, {9, {0, false}}};

std::int64_t number(const std::string& text) {
  const std::string node = "$NODEID+";
  if (text.starts_with(node)) return 1 + std::stoll(text.substr(node.size()), nullptr, 0);
  return std::stoll(text, nullptr, 0);
}

class Eds : public RawDrive {
 protected:
  // Index and sub-index of a section "6064" or "1018sub2"; nothing for others and for the heads of records.
  std::map<rig::ObjectDictionary::Key, Section> objects() {
    std::map<rig::ObjectDictionary::Key, Section> found;
    for (const auto& [name, section] : read_eds()) {
      if (!section.contains("DataType")) continue;
      const auto sub = name.size() > 4 ? std::stoi(name.substr(7), nullptr, 16) : 0;
      found[{static_cast<std::uint16_t>(std::stoi(name.substr(0, 4), nullptr, 16)), static_cast<std::uint8_t>(sub)}] =
          section;
    }
    return found;
  }
  static std::uint8_t download_command(unsigned bytes) { return static_cast<std::uint8_t>(0x23 | (4 - bytes) << 2); }
};

TEST_F(Eds, NamesTheObjectsOfTheDriveAndNoOthers) {
  std::set<rig::ObjectDictionary::Key> described, there;
  for (const auto& [key, section] : objects()) described.insert(key);
  for (const auto& [key, object] : drive->objects().all()) there.insert(key);
  EXPECT_EQ(described, there);
}

TEST_F(Eds, ItsListsAndCountsAgreeWithItsSections) {
  auto sections = read_eds();
  std::set<std::string> listed;
  for (const std::string list : {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"}) {
    const auto count = std::stoul(sections[list].at("SupportedObjects"));
    EXPECT_EQ(sections[list].size(), count + 1) << list;
    for (std::size_t i = 1; i <= count; ++i) listed.insert(sections[list].at(std::to_string(i)).substr(2));
  }
  std::set<std::string> present;
  std::map<std::string, std::size_t> subs;
  for (const auto& [name, section] : sections) {
    if (!section.contains("ParameterName")) continue;
    present.insert(name.substr(0, 4));
    if (name.size() > 4) ++subs[name.substr(0, 4)];
  }
  EXPECT_EQ(listed, present);
  for (const auto& [index, count] : subs) EXPECT_EQ(std::stoul(sections[index].at("SubNumber")), count) << index;
}

TEST_F(Eds, DefaultsAndTypesAreWhatTheDriveAnswers) {
  for (const auto& [key, section] : objects()) {
    SCOPED_TRACE(testing::Message() << std::hex << key.first << " sub " << int{key.second});
    const Described type = kTypes.at(std::stoi(section.at("DataType"), nullptr, 0));
    if (type.bytes == 0) {
      EXPECT_EQ(get_text(key.first), section.at("DefaultValue"));
      continue;
    }
    const auto answer = answer_to(write(0x40, key.first, key.second, 0));
    ASSERT_TRUE(answer.has_value());
    EXPECT_EQ(answer->data[0], 0x43 | (4 - type.bytes) << 2) << "size";
    EXPECT_EQ(drive->objects().find(key.first, key.second)->is_signed, type.is_signed);
    const std::uint32_t raw = stepper::cia301::get_u32(*answer, 4);
    const std::int64_t value = type.is_signed ? rig::sign_extended(raw, type.bytes) : std::int64_t{raw};
    EXPECT_EQ(value, number(section.at("DefaultValue")));
  }
}

TEST_F(Eds, AccessLimitsAndMappingAreWhatTheDriveAllows) {
  constexpr std::uint32_t kReadOnly = 0x06010002, kOutOfRange = 0x06090030, kNotMappable = 0x06040041;
  for (const auto& object : objects()) {
    const auto& key = object.first;
    const Section& section = object.second;
    SCOPED_TRACE(testing::Message() << std::hex << key.first << " sub " << int{key.second});
    const Described type = kTypes.at(std::stoi(section.at("DataType"), nullptr, 0));
    const unsigned bytes = type.bytes == 0 ? 4 : type.bytes;
    const auto set_to = [&](std::int64_t value) {
      return abort_of(write(download_command(bytes), key.first, key.second, static_cast<std::uint32_t>(value)));
    };
    const bool writable = section.at("AccessType") == "rw";
    if (!writable) {
      EXPECT_EQ(set_to(0), kReadOnly);
    } else {
      EXPECT_EQ(set_to(number(section.at("DefaultValue"))), 0U) << "its default";
    }
    if (writable && section.contains("HighLimit")) {
      const std::int64_t low = number(section.at("LowLimit")), high = number(section.at("HighLimit"));
      const auto holds = [&](std::int64_t value) {
        return value >= (type.is_signed ? -(INT64_C(1) << (8 * bytes - 1)) : 0) &&
               value < INT64_C(1) << (8 * bytes - (type.is_signed ? 1 : 0));
      };
      EXPECT_EQ(set_to(low), 0U);
      EXPECT_THAT(set_to(high), key.first >> 8 == 0x16 || key.first >> 8 == 0x1A
                                    ? testing::Eq(0x06020000U)  // nothing is mapped there yet
                                    : testing::Eq(0U));
      for (const std::int64_t beyond : {low - 1, high + 1}) {
        if (holds(beyond)) {
          EXPECT_EQ(set_to(beyond), kOutOfRange) << beyond;
        }
      }
      EXPECT_EQ(set_to(number(section.at("DefaultValue"))), 0U);
    }
    // Into a TPDO go all that may be mapped, into an RPDO those that may be written as well.
    const std::uint32_t entry =
        static_cast<std::uint32_t>(key.first) << 16 | std::uint32_t{key.second} << 8 | 8 * bytes;
    const bool mappable = section.at("PDOMapping") == "1";
    if (type.bytes == 0) continue;
    EXPECT_EQ(abort_of(write(0x23, 0x1A03, 1, entry)), mappable ? 0U : kNotMappable);
    EXPECT_EQ(abort_of(write(0x23, 0x1603, 1, entry)), mappable && writable ? 0U : kNotMappable);
  }
}

}  // namespace
}  // namespace bevel::test
