// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Recorder of frames to a folder, in a separate thread: lossless PNG files named by capture time, camera and number,
/// and frames.csv with one line per frame, which makes the folder a source with its own time stamps. The tracker never
/// waits for the disk: frames that exceed the queue are dropped and counted.
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

/// One line of frames.csv.
struct RecordedFrame {
  int64_t utime = 0;   ///< capture time minus latency, us since the epoch
  int64_t seq = 0;     ///< number of the frame
  int32_t camera = 0;  ///< camera number
  int32_t status = 0;  ///< status of the tip, as in TipStatus
  cv::Point2d tip_px;  ///< tip, pixel (u, v); valid only if the status is ok
  std::string file;    ///< name of the image in the same folder
};

/// Name of the index in a recorded folder.
inline constexpr const char* kFrameIndex = "frames.csv";

/// Reads the frames.csv of a folder. An incomplete last line is ignored, because its frame was being written.
/// @param folder folder
/// @return frames in the order of the file
/// @throws SourceError naming file, line and what is wrong
std::vector<RecordedFrame> read_frame_index(const std::filesystem::path& folder);

/// Records frames.
class FrameRecorder {
 public:
  /// Creates the folder if it does not exist, and starts the thread.
  /// @param folder       folder
  /// @param queue_frames capacity of the queue, frames
  /// @throws IoError if the folder cannot be created, or if it contains frames already
  explicit FrameRecorder(const std::filesystem::path& folder, size_t queue_frames = 32);
  /// Writes the queued frames.
  ~FrameRecorder();
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;

  /// Queues a frame. If the queue is full, the frame is dropped.
  /// @param gray  image; kept without a copy, so that it must not be changed afterwards
  /// @param frame its line in frames.csv; `file` is set by the recorder
  void offer(const cv::Mat& gray, const RecordedFrame& frame);

  /// Numbers of frames.
  struct Counts {
    int64_t written = 0;  ///< frames written
    int64_t dropped = 0;  ///< frames dropped because the disk is slower than the camera
    std::string failure;  ///< why the recorder no longer writes; empty while it does
  };
  /// @return numbers so far
  Counts counts() const;
  /// Waits until all queued frames are written.
  void finish();

 private:
  struct Entry {
    cv::Mat gray;
    RecordedFrame frame;
  };
  void work();
  std::string write(const Entry& entry);  // error; empty on success

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
