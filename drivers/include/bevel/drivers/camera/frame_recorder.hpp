// SPDX-License-Identifier: MIT
#pragma once
// Frames to a folder while they are tracked, by a thread of its own: PNG, so that nothing is lost, named by capture
// time, camera and number, and frames.csv, one line a frame, which makes the folder a source with its own stamps. The
// tracker never waits for the disk: what does not fit into the queue is dropped and counted.
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <opencv2/core.hpp>
#include <string>
#include <thread>
#include <vector>

namespace bevel::camera {

/// A line of frames.csv.
struct RecordedFrame {
  int64_t utime = 0;  ///< capture, microseconds since the epoch, latency taken off
  int64_t seq = 0;
  int32_t camera = 0;
  int32_t status = 0;  ///< of the tip, as in TipStatus
  cv::Point2d tip_px;  ///< only if ok
  std::string file;    ///< beside frames.csv
};

inline constexpr const char* kFrameIndex = "frames.csv";

/// The lines of a folder's frames.csv. A last line that was cut off is left out: its frame was being written. Throws
/// SourceError naming file, line and what is wrong.
std::vector<RecordedFrame> read_frame_index(const std::filesystem::path& folder);

class FrameRecorder {
 public:
  /// Makes the folder if it is not there. Throws IoError if it cannot, or if there are frames in it already.
  explicit FrameRecorder(const std::filesystem::path& folder, size_t queue_frames = 32);
  /// Writes what is queued.
  ~FrameRecorder();
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;

  /// `gray` must not be written to afterwards: it is kept, not copied.
  void offer(const cv::Mat& gray, const RecordedFrame& frame);

  struct Counts {
    int64_t written = 0;
    int64_t dropped = 0;  ///< because the disk is slower than the camera
    std::string failure;  ///< why it writes no more; empty while it does
  };
  Counts counts() const;
  /// Waits until all that was offered is written.
  void finish();

 private:
  struct Entry {
    cv::Mat gray;
    RecordedFrame frame;
  };
  void work();
  std::string write(const Entry& entry);  // why not, or empty

  std::filesystem::path folder_;
  size_t queue_frames_;
  std::ofstream index_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> queue_;
  bool ending_ = false;
  Counts counts_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace bevel::camera
