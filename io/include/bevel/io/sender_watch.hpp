// SPDX-License-Identifier: MIT
/// \file
/// Identification of the sender of a channel by `seq` and `utime`. LCM itself does not report senders.
///
/// A sender increases `seq` with each message and does not decrease `utime`. A message that does not continue the
/// stream of an active sender comes from another sender, or is an old message that is sent again. Both clocks are
/// arguments; the functions have no other input.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace bevel::io {

/// Limits of a channel.
struct SenderLimits {
  std::int64_t longest_age_us = 100'000;   ///< age from which on a message is not used, us
  std::int64_t longest_ahead_us = 30'000;  ///< largest time stamp in the future, us: clock difference between machines
  double fastest_hz = 1000;                ///< largest message rate of the channel, Hz; it limits jumps of `seq`
  std::int64_t silence_us = 100'000;       ///< time without messages after which a sender may have been restarted, us
  std::int64_t reorder_us = 0;             ///< largest delay of a message relative to the newest, us; for cameras
};

/// Result of SenderWatch::judge().
enum class Standing {
  fresh,      ///< newer than all messages before, or the first of a sender after silence
  late,       ///< older than the newest message, within SenderLimits::reorder_us
  duplicate,  ///< one of the last 16 messages again, with the same bytes: networks may duplicate messages
  old,        ///< continues the stream but is older than SenderLimits::longest_age_us; or the first, and too old
  ahead,      ///< the first message, with a time stamp in the future
  foreign,    ///< does not continue the stream of an active sender
};
/// Returns whether a message may be used.
/// @param standing  result of SenderWatch::judge()
/// @return true for Standing::fresh and Standing::late
constexpr bool usable(Standing standing) { return standing == Standing::fresh || standing == Standing::late; }

/// Tracks the sender of one channel.
class SenderWatch {
 public:
  /// Starts without a sender.
  /// @param limits  limits of the channel
  explicit SenderWatch(const SenderLimits& limits = {}) : limits_(limits) {}

  /// Classifies a message and updates the state of the sender.
  /// @param seq  number of the message
  /// @param utime  time stamp of the message, us since the epoch
  /// @param digest  hash of the bytes of the message, to distinguish a duplicate from another message of equal number
  /// @param now_utime  current time, us since the epoch, for the age of the message
  /// @param now_ns  current time of a steady clock, ns, for the silence of the sender
  /// @return the class of the message; usable() tells whether it may be used
  Standing judge(std::int64_t seq, std::int64_t utime, std::uint64_t digest, std::int64_t now_utime,
                 std::int64_t now_ns) noexcept;
  /// Forgets the sender: after a command of the operator or a step of the clock the next message may come from any
  /// sender.
  void restart() noexcept { heard_ = false; }

  /// Returns whether more than one of the last eight messages was late. A network swaps two messages occasionally; two
  /// senders do so continuously.
  /// @return true if two senders are likely
  bool out_of_order() const { return std::popcount(lates_) > 1; }
  /// Returns the number of missing messages.
  /// @return sum of the gaps of `seq`
  std::int64_t lost() const { return lost_; }
  /// Returns the number of senders that restarted after silence.
  /// @return number of restarts since construction
  std::int64_t restarts() const { return restarts_; }

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
  // The last messages: a number that occurs again with other content is from another sender.
  std::array<Used, 16> used_{};
  std::size_t next_used_ = 0;
  std::uint8_t lates_ = 0;     // the last eight messages, one bit each
  std::int64_t heard_ns_ = 0;  // time of the last message of the stream
  std::int64_t lost_ = 0;
  std::int64_t restarts_ = 0;
};

}  // namespace bevel::io
