// SPDX-License-Identifier: MIT
#include <bevel/io/sender_watch.hpp>

#include <algorithm>

#include <bevel/model/age.hpp>

namespace bevel::io {
namespace {
// Beyond what the rate explains: stamps are not sent at even times.
constexpr double kSlackMessages = 8;
}  // namespace

const SenderWatch::Used* SenderWatch::find(std::int64_t seq) const noexcept {
  const auto found = std::find_if(used_.begin(), used_.end(), [seq](const Used& used) { return used.seq == seq; });
  return found == used_.end() ? nullptr : &*found;
}

void SenderWatch::note(std::int64_t seq, std::uint64_t digest) noexcept {
  used_.at(next_used_) = {seq, digest};
  next_used_ = (next_used_ + 1) % used_.size();
}

Standing SenderWatch::judge(std::int64_t seq, std::int64_t utime, std::uint64_t digest, std::int64_t now_utime,
                            std::int64_t now_ns) noexcept {
  using model::age_us;
  const std::int64_t age = age_us(now_utime, utime);
  const bool alive = heard_ && model::difference_saturated(now_ns, heard_ns_) <= limits_.silence_us * 1000;
  if (age < -limits_.longest_ahead_us) return alive ? Standing::foreign : Standing::ahead;

  if (alive) {
    if (const Used* before = find(seq)) return before->digest == digest ? Standing::duplicate : Standing::foreign;
    if (seq < newest_seq_) {
      const bool reordered = limits_.reorder_us > 0 && utime < newest_utime_ &&
                             age_us(newest_utime_, utime) <= limits_.reorder_us && age <= limits_.longest_age_us;
      if (!reordered) return Standing::foreign;
      note(seq, digest);
      lates_ = static_cast<std::uint8_t>(lates_ << 1U | 1U);
      return Standing::late;
    }
    if (utime < newest_utime_) return Standing::foreign;
    const double room = 1e-6 * static_cast<double>(age_us(utime, newest_utime_)) * limits_.fastest_hz + kSlackMessages;
    const std::int64_t step = model::difference_saturated(seq, newest_seq_);
    if (static_cast<double>(step) > room) return Standing::foreign;
    lost_ += step - 1;
  } else if (age > limits_.longest_age_us) {
    return Standing::old;  // not followed: what a replay begins with must not become the sender
  } else if (heard_ && seq <= newest_seq_) {
    ++restarts_;
  }
  if (!alive) used_ = {}, lates_ = 0;
  lates_ = static_cast<std::uint8_t>(lates_ << 1U);
  note(seq, digest);
  heard_ = true;
  newest_seq_ = seq;
  newest_utime_ = utime;
  heard_ns_ = now_ns;
  return age > limits_.longest_age_us ? Standing::old : Standing::fresh;
}

}  // namespace bevel::io
