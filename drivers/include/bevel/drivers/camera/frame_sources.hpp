// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Adapters behind make_frame_source(). Only tests include this file; programs include frame_source.hpp.
#include <filesystem>
#include <functional>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>
#include <vector>

#include <bevel/drivers/camera/capture_device.hpp>
#include <bevel/drivers/camera/decode.hpp>
#include <bevel/drivers/camera/frame_recorder.hpp>
#include <bevel/drivers/camera/frame_source.hpp>

namespace bevel::camera {

/// Reads the images of a folder in natural order: all files with a readable image extension. In a recorded folder,
/// frames.csv (frame_recorder.hpp) determines order, time stamps, numbers and cameras.
class FolderSource : public FrameSource {
 public:
  /// Opens a folder.
  /// @param config settings
  /// @throws SourceError if the folder cannot be read or has no images
  explicit FolderSource(const SourceConfig& config);
  FrameResult next(std::chrono::milliseconds timeout) override;
  std::string remark() const override { return remark_; }
  /// @return images in the order in which they are read
  const std::vector<std::filesystem::path>& files() const { return files_; }

 private:
  SourceConfig config_;
  std::vector<std::filesystem::path> files_;
  std::vector<RecordedFrame> recorded_;  // of the files, or empty
  size_t next_ = 0;
  int bits_ = 8;  // per sample, at least, of the files so far: one brightness scale for all of them
  std::string remark_;
};

/// Reads a video file, with the container's own times from its first frame on. A file that ends before the length that
/// it states is a failure after its last good frame.
class VideoSource : public FrameSource {
 public:
  /// Opens a video file.
  /// @param config settings
  /// @throws SourceError if the file cannot be read
  explicit VideoSource(const SourceConfig& config);
  FrameResult next(std::chrono::milliseconds timeout) override;
  std::string remark() const override { return remark_; }

 private:
  std::optional<std::string> missing() const;

  SourceConfig config_;
  cv::VideoCapture capture_;
  int64_t seq_ = 0;
  int64_t last_us_ = 0;  // of the last frame, in the file's time
  bool ended_ = false;
  std::string remark_;
};

/// Reads a Video4Linux device: the newest frame that the driver reports as complete, with the driver's number and
/// capture time.
class DeviceSource : public FrameSource {
 public:
  /// Opens a device.
  /// @param config settings
  /// @throws SourceError if the device cannot be opened
  explicit DeviceSource(const SourceConfig& config);
  /// Uses an open device, for tests.
  /// @param config settings
  /// @param device device
  /// @param clocks function that reads both clocks
  DeviceSource(const SourceConfig& config, std::unique_ptr<CaptureDevice> device, std::function<ClockPair()> clocks);
  FrameResult next(std::chrono::milliseconds timeout) override;
  std::string remark() const override { return orientation_remark(config_.path, orientation_); }

 private:
  std::optional<FrameResult> newest();

  SourceConfig config_;
  std::unique_ptr<CaptureDevice> device_;
  std::function<ClockPair()> clocks_;
  BufferCount count_;
  int orientation_ = 1;  // of the first MJPEG frame that carries another
  bool failed_ = false;
};

/// Reads the raw frames of frame_stream.hpp from a UNIX socket.
class StreamSource : public FrameSource {
 public:
  /// Connects to the server.
  /// @param config settings
  /// @throws SourceError if the server does not appear in time
  explicit StreamSource(const SourceConfig& config);
  ~StreamSource() override;
  FrameResult next(std::chrono::milliseconds timeout) override;

 private:
  FrameResult fail(const std::string& text);

  std::string path_;
  int socket_ = -1;
  std::vector<unsigned char> head_;  // bytes of the header received so far
  Frame frame_;                      // being filled
  size_t body_received_ = 0;
  bool failed_ = false;
};

}  // namespace bevel::camera
