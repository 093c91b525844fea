// SPDX-License-Identifier: MIT
// What the live page shows, from the messages of a running loop or of a log that is played back. Pure: time comes in,
// text goes out. Units are in the names; positions in {A}, mm.
#pragma once

#include <array>
#include <bevel/actuator_state_t.hpp>
#include <bevel/camera_picture_t.hpp>
#include <bevel/motion_command_t.hpp>
#include <bevel/needle_state_t.hpp>
#include <bevel/process_status_t.hpp>
#include <bevel/steering_target_t.hpp>
#include <bevel/tip_measurement_t.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bevel::view {

// Of one program: monotonic for ages, since the epoch to tell a live message from one that is played back.
struct Moment {
  std::int64_t ns = 0;
  std::int64_t utime = 0;
};

class LiveView {
 public:
  // Messages that passed the checked decode, in the order in which they arrive.
  void on(const tip_measurement_t& message, const Moment& now);
  void on(const actuator_state_t& message, const Moment& now);
  void on(const motion_command_t& message, const Moment& now);
  void on(const needle_state_t& message, const Moment& now);
  void on(const steering_target_t& message, const Moment& now);
  void on(const process_status_t& message, const Moment& now);
  void on(const camera_picture_t& message, const Moment& now);
  void on_truth(const needle_state_t& message, const Moment& now);  // of a simulated rig
  // CONFIG opens a log: the next message with a time begins another insertion.
  void on_config();

  // What is so now, as JSON: the newest of every kind with its age, and one row of the charts. Adds that row to the
  // history where there is something new; call it at the rate at which the charts are to run.
  std::string snapshot(const Moment& now);
  // Rows of the charts and the path since the beginning of this insertion, as JSON: what a page that is opened late
  // starts from.
  std::string history() const;
  // A camera's picture of that count, as JPEG; "" unless it is the newest: what a snapshot says of one belongs to no
  // other.
  std::string picture(std::int32_t camera, std::int64_t count) const;

 private:
  // The newest message of a channel, or of one camera or process on it.
  template <class Message>
  struct Newest {
    Message message;
    Moment arrived;
    std::int64_t count = 0;
  };
  template <class Message>
  static void take(std::optional<Newest<Message>>& newest, const Message& message, const Moment& now);
  template <class Key, class Message>
  static void take(std::map<Key, Newest<Message>>& newest, const Key& key, const Message& message, const Moment& now);

  // One row of the charts; what is not known is NaN.
  struct Row {
    double t_s;
    std::array<double, 10> values;
  };
  Row row_now() const;
  enum class Source : std::uint8_t { tip, axes, command, needle, truth, target };
  // Another insertion begins with a message that is far from those before it, or is the first one after CONFIG.
  void begin_anew_if(std::int64_t utime, Source source, std::int32_t camera = 0);
  void extend_path(const needle_state_t& state);

  std::map<std::int32_t, Newest<tip_measurement_t>> tips_;     // by camera
  std::map<std::int32_t, Newest<camera_picture_t>> pictures_;  // by camera
  std::map<std::int32_t, double> test_ratio_;                  // by camera, of its newest position that was used
  std::map<std::string, Newest<process_status_t>> processes_;
  std::optional<Newest<actuator_state_t>> axes_;
  std::optional<Newest<motion_command_t>> command_;
  std::optional<Newest<needle_state_t>> needle_, truth_;
  std::optional<Newest<steering_target_t>> target_;
  std::vector<Row> rows_;
  std::vector<std::array<double, 3>> path_;
  double path_step_mm_ = 0.2;
  std::int64_t first_utime_ = 0, newest_utime_ = 0;                    // of the data
  std::map<std::pair<Source, std::int32_t>, std::int64_t> newest_of_;  // utime by source and camera
  bool is_new_config_ = false;
  std::int64_t beginnings_ = 0;  // counts insertions, so that a page knows when to begin anew
  bool new_row_ = false;
};

}  // namespace bevel::view
