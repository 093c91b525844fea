// SPDX-License-Identifier: MIT
// Who sends on a channel, told by seq and utime: LCM itself does not say. A sender counts its messages up and stamps
// them ever later; what does not continue its stream while it is alive comes from somebody else, or is an old message
// sent again. Pure: both clocks come in as arguments.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace bevel::io {

struct SenderLimits {
  std::int64_t longest_age_us = 100'000;   // an older message is not used
  std::int64_t longest_ahead_us = 30'000;  // stamped later than now: clocks of several machines agree to this
  double fastest_hz = 1000;                // no sender of the channel is faster, which bounds the jumps of seq
  std::int64_t silence_us = 100'000;       // a sender not heard for so long may have been started anew
  std::int64_t reorder_us = 0;             // cameras: how much older than the newest a message may come
};

enum class Standing {
  fresh,      // newer than all before, or the first of a sender after silence
  late,       // older than the newest, within reorder_us
  duplicate,  // one of the last once more, byte for byte: a network may do that
  old,        // continues its sender's stream, but beyond longest_age_us; or the first, too old
  ahead,      // the first, and stamped in the future
  foreign,    // does not continue the stream of a sender that is alive
};
constexpr bool usable(Standing standing) { return standing == Standing::fresh || standing == Standing::late; }

class SenderWatch {
 public:
  explicit SenderWatch(const SenderLimits& limits = {}) : limits_(limits) {}

  // digest: of the message's bytes, to tell a duplicate from another message with the same number. now_utime is for
  // ages, now_ns (steady) for the sender's silence.
  Standing judge(std::int64_t seq, std::int64_t utime, std::uint64_t digest, std::int64_t now_utime,
                 std::int64_t now_ns) noexcept;
  // The next message may be anybody's: after the operator's word, or a step of the clock.
  void restart() noexcept { heard_ = false; }

  // More than one of the last eight came late: a network swaps two now and then, two senders do it all the time.
  bool out_of_order() const { return std::popcount(lates_) > 1; }
  std::int64_t lost() const { return lost_; }          // missing numbers
  std::int64_t restarts() const { return restarts_; }  // senders that began anew after silence

 private:
  struct Used {
    std::int64_t seq = -1;
    std::uint64_t digest = 0;
  };
  const Used* find(std::int64_t seq) const noexcept;
  void note(std::int64_t seq, std::uint64_t digest) noexcept;

  SenderLimits limits_;
  bool heard_ = false;
  std::int64_t newest_seq_ = 0;
  std::int64_t newest_utime_ = 0;
  // The last ones: a number that comes again with other content is somebody else's.
  std::array<Used, 16> used_{};
  std::size_t next_used_ = 0;
  std::uint8_t lates_ = 0;     // of the last eight, a bit each
  std::int64_t heard_ns_ = 0;  // when its stream was last continued
  std::int64_t lost_ = 0;
  std::int64_t restarts_ = 0;
};

}  // namespace bevel::io
