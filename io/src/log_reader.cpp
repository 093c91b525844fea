// SPDX-License-Identifier: MIT
#include <bevel/io/log_reader.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace bevel::io {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic{0xED, 0xA1, 0xDA, 0x01};
constexpr std::size_t kHeaderSize = 28;
constexpr std::size_t kLongestChannel = 63;  // LCM_MAX_CHANNEL_NAME_LENGTH

template <class Integer>
Integer big_endian(const std::uint8_t* bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) value = (value << 8U) | bytes[i];
  return static_cast<Integer>(value);
}

bool printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

std::string LogDamage::describe() const {
  if (intact()) return "intact";
  std::string text;
  if (skipped_bytes > 0) {
    text = std::to_string(skipped_bytes) + " bytes skipped in " + std::to_string(regions) + " damaged place" +
           (regions == 1 ? "" : "s");
  }
  if (torn_tail_bytes > 0) {
    text += (text.empty() ? "" : ", ") + std::string("the last event is cut off (") + std::to_string(torn_tail_bytes) +
            " bytes)";
  }
  return text;
}

// What can stand where an event ends: the end of the file, the next event, or the remains of either. The next event's
// number is taken as well as its magic, so that damage to a magic costs the event it belongs to and not the one before.
bool LogReader::can_follow(std::size_t offset, std::int64_t number) const {
  const std::size_t left = bytes_.size() - offset;
  const std::size_t magic_bytes = std::min(left, kMagic.size());
  if (std::memcmp(bytes_.data() + offset, kMagic.data(), magic_bytes) == 0) return true;
  if (left < kMagic.size() + sizeof(number)) return true;  // too little to tell
  return number < std::numeric_limits<std::int64_t>::max() &&
         big_endian<std::int64_t>(bytes_.data() + offset + kMagic.size()) == number + 1;
}

bool LogReader::event_at(std::size_t offset, LogEvent& event, std::size_t& end) const {
  const std::size_t left = bytes_.size() - offset;
  if (left < kHeaderSize) return false;
  const std::uint8_t* header = bytes_.data() + offset;
  if (std::memcmp(header, kMagic.data(), kMagic.size()) != 0) return false;
  const auto channel_size = std::size_t{big_endian<std::uint32_t>(header + 20)};
  const auto data_size = std::size_t{big_endian<std::uint32_t>(header + 24)};  // a negative one is beyond any file
  if (channel_size == 0 || channel_size > kLongestChannel) return false;
  if (channel_size + data_size > left - kHeaderSize) return false;
  const std::string_view channel(reinterpret_cast<const char*>(header + kHeaderSize), channel_size);
  if (!printable(channel)) return false;
  event.number = big_endian<std::int64_t>(header + 4);
  event.timestamp_us = big_endian<std::int64_t>(header + 12);
  event.channel = channel;
  event.data = {header + kHeaderSize + channel_size, data_size};
  event.offset = offset;
  end = offset + kHeaderSize + channel_size + data_size;
  return can_follow(end, event.number);
}

std::optional<LogEvent> LogReader::next() {
  LogEvent event;
  std::size_t end = 0;
  const std::size_t start = at_;
  for (std::size_t offset = start; offset < bytes_.size();) {
    if (event_at(offset, event, end)) {
      if (offset > start) {
        damage_.skipped_bytes += static_cast<std::int64_t>(offset - start);
        ++damage_.regions;
      }
      at_ = end;
      return event;
    }
    const auto found = std::search(bytes_.begin() + static_cast<std::ptrdiff_t>(offset) + 1, bytes_.end(),
                                   kMagic.begin(), kMagic.end());
    offset = static_cast<std::size_t>(found - bytes_.begin());
  }
  const auto rest = static_cast<std::int64_t>(bytes_.size() - start);
  at_ = bytes_.size();
  if (rest == 0) return std::nullopt;
  // A header that is there as far as the file goes was being written when the log ended; anything else is damage.
  const std::size_t magic_bytes = std::min(static_cast<std::size_t>(rest), kMagic.size());
  if (std::memcmp(bytes_.data() + start, kMagic.data(), magic_bytes) == 0) {
    damage_.torn_tail_bytes += rest;
  } else {
    damage_.skipped_bytes += rest;
    ++damage_.regions;
  }
  return std::nullopt;
}

}  // namespace bevel::io
