// SPDX-License-Identifier: MIT
// The adapter of capture_device.hpp to a /dev/videoN: single-planar capture, streaming by mapped buffers.
// Source: Linux media API, "Streaming I/O (Memory Mapping)".
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <vector>

#include <bevel/drivers/camera/capture_device.hpp>

namespace bevel::camera {
namespace {

// One is filled while one is looked at; two more, so that a tracker that is late loses none at once.
constexpr uint32_t kBuffers = 4;

int request(int file, unsigned long what, void* argument) {
  int status = 0;
  do status = ioctl(file, what, argument);
  while (status < 0 && errno == EINTR);
  return status;
}

class Video4Linux final : public CaptureDevice {
 public:
  explicit Video4Linux(const SourceConfig& config) : path_(config.path) {
    try {
      open_device();
      choose_format(config);
      choose_rate(config.rate_hz);
      start();
    } catch (...) {
      release();
      throw;
    }
  }
  ~Video4Linux() override { release(); }

  const PixelLayout& layout() const override { return layout_; }

  bool wait(std::chrono::milliseconds timeout) override {
    pollfd one{file_, POLLIN, 0};
    return poll(&one, 1, static_cast<int>(timeout.count())) > 0;
  }

  std::variant<CapturedBuffer, NothingYet, DeviceGone> take() override {
    v4l2_buffer buffer = blank();
    if (request(file_, VIDIOC_DQBUF, &buffer) < 0) {
      if (errno == EAGAIN) return NothingYet{};
      return DeviceGone{"'" + path_ + "': " + std::strerror(errno) + " (unplugged?)"};
    }
    const Mapping& m = mappings_.at(buffer.index);
    const size_t used = std::min<size_t>(buffer.bytesused, m.bytes);
    return CapturedBuffer{buffer.index,
                          buffer.flags,
                          buffer.sequence,
                          int64_t{buffer.timestamp.tv_sec} * 1'000'000 + buffer.timestamp.tv_usec,
                          {static_cast<const uint8_t*>(m.start), used}};
  }

  void give_back(uint32_t index) override {
    v4l2_buffer buffer = blank();
    buffer.index = index;
    request(file_, VIDIOC_QBUF, &buffer);  // a device that is gone says so at the next take()
  }

 private:
  struct Mapping {
    void* start;
    size_t bytes;
  };

  static v4l2_buffer blank() {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    return buffer;
  }
  [[noreturn]] void fail(const std::string& what) const { throw SourceError("source path '" + path_ + "': " + what); }
  [[noreturn]] void fail_errno(const std::string& what) const { fail(what + ": " + std::strerror(errno)); }

  void open_device() {
    file_ = open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (file_ < 0) fail_errno("cannot be opened");
    v4l2_capability able{};
    if (request(file_, VIDIOC_QUERYCAP, &able) < 0) fail("not a Video4Linux device");
    const uint32_t can = (able.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? able.device_caps : able.capabilities;
    if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0)
      fail("captures no video by streaming; a camera may have several devices, of which another one does");
  }

  void choose_format(const SourceConfig& config) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<uint32_t>(config.width_px);
    format.fmt.pix.height = static_cast<uint32_t>(config.height_px);
    format.fmt.pix.pixelformat = fourcc_from(config.fourcc);
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (request(file_, VIDIOC_S_FMT, &format) < 0) fail_errno("takes no format (in use?)");
    const v4l2_pix_format& got = format.fmt.pix;
    // A calibration belongs to one picture size, so a driver that chose another is not accepted in silence.
    if (static_cast<int>(got.width) != config.width_px || static_cast<int>(got.height) != config.height_px)
      fail("source size " + std::to_string(config.width_px) + "x" + std::to_string(config.height_px) + ": offers " +
           std::to_string(got.width) + "x" + std::to_string(got.height));
    if (got.pixelformat != fourcc_from(config.fourcc))
      fail("source fourcc '" + config.fourcc + "': offers " + name_of_fourcc(got.pixelformat));
    layout_ = {got.pixelformat, config.width_px, config.height_px, got.bytesperline};
  }

  void choose_rate(double rate_hz) {
    v4l2_streamparm rate{};
    rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    rate.parm.capture.timeperframe = {1000, static_cast<uint32_t>(std::lround(1000 * rate_hz))};
    request(file_, VIDIOC_S_PARM, &rate);  // a camera of one rate refuses; frames carry their own times
  }

  void start() {
    v4l2_requestbuffers wanted{};
    wanted.count = kBuffers;
    wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    wanted.memory = V4L2_MEMORY_MMAP;
    if (request(file_, VIDIOC_REQBUFS, &wanted) < 0) fail_errno("gives no buffers (in use?)");
    if (wanted.count < 2) errno = ENOMEM, fail_errno("gives fewer than two buffers");
    for (uint32_t i = 0; i < wanted.count; ++i) {
      v4l2_buffer buffer = blank();
      buffer.index = i;
      if (request(file_, VIDIOC_QUERYBUF, &buffer) < 0) fail_errno("buffer cannot be asked for");
      void* at = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, file_, buffer.m.offset);
      if (at == MAP_FAILED) fail_errno("buffer cannot be mapped");
      mappings_.push_back({at, buffer.length});
      if (request(file_, VIDIOC_QBUF, &buffer) < 0) fail_errno("buffer cannot be queued");
    }
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (request(file_, VIDIOC_STREAMON, &type) < 0) fail_errno("does not start (in use?)");
  }

  void release() {
    if (file_ < 0) return;
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request(file_, VIDIOC_STREAMOFF, &type);
    for (const Mapping& m : mappings_) munmap(m.start, m.bytes);
    close(file_);
  }

  std::string path_;
  int file_ = -1;
  PixelLayout layout_;
  std::vector<Mapping> mappings_;
};

}  // namespace

std::unique_ptr<CaptureDevice> open_video4linux(const SourceConfig& config) {
  if (!is_readable(fourcc_from(config.fourcc)))
    throw SourceError("source fourcc is '" + config.fourcc + "', allowed: YUYV, UYVY, GREY, NV12, YU12, MJPG");
  return std::make_unique<Video4Linux>(config);
}

}  // namespace bevel::camera
