// SPDX-License-Identifier: MIT
#include <cmath>

#include <bevel/drivers/camera/frame_sources.hpp>

namespace bevel::camera {
namespace {

void require(bool good, const std::string& key, const std::string& value, const char* allowed) {
  if (!good) throw SourceError("source " + key + " is " + value + ", allowed: " + allowed);
}

void check(const SourceConfig& c) {
  require(!c.path.empty(), "path", "empty", "a folder, file, device or socket");
  require(c.camera >= 0, "camera", std::to_string(c.camera), "0 or more");
  require(c.start_utime >= 0, "start_utime", std::to_string(c.start_utime), "0 or more microseconds");
  require(c.period_us > 0, "period_us", std::to_string(c.period_us), "more than 0 microseconds");
  require(c.width_px > 0 && c.width_px <= 8192, "width_px", std::to_string(c.width_px), "1 to 8192");
  require(c.height_px > 0 && c.height_px <= 8192, "height_px", std::to_string(c.height_px), "1 to 8192");
  require(std::isfinite(c.rate_hz) && c.rate_hz > 0.0 && c.rate_hz <= 1000.0, "rate_hz", std::to_string(c.rate_hz),
          "above 0, up to 1000");
  require(c.fourcc.size() == 4, "fourcc", "'" + c.fourcc + "'", "four characters such as YUYV or MJPG");
  require(c.connect_timeout_ms >= 0, "connect_timeout_ms", std::to_string(c.connect_timeout_ms), "0 or more");
}

}  // namespace

SourceKind source_kind_from(std::string_view name) {
  if (name == "folder") return SourceKind::folder;
  if (name == "video") return SourceKind::video;
  if (name == "device") return SourceKind::device;
  if (name == "stream") return SourceKind::stream;
  throw SourceError("source kind is '" + std::string(name) + "', allowed: folder, video, device, stream");
}

std::unique_ptr<FrameSource> make_frame_source(const SourceConfig& config) {
  check(config);
  switch (config.kind) {
    case SourceKind::folder:
      return std::make_unique<FolderSource>(config);
    case SourceKind::video:
      return std::make_unique<VideoSource>(config);
    case SourceKind::device:
      return std::make_unique<DeviceSource>(config);
    case SourceKind::stream:
      return std::make_unique<StreamSource>(config);
  }
  throw SourceError("source kind: not one of folder, video, device, stream");
}

}  // namespace bevel::camera
