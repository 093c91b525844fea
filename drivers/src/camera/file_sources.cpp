// SPDX-License-Identifier: MIT
// Frames from files: an image folder, a video.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include <bevel/drivers/camera/frame_sources.hpp>

namespace bevel::camera {
namespace {

bool is_image(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static constexpr std::array known = {".jpg", ".jpeg", ".png", ".bmp", ".pgm", ".ppm", ".tif", ".tiff"};
  return std::find(known.begin(), known.end(), extension) != known.end();
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string_view digits_at(std::string_view text, size_t at) {
  size_t end = at;
  while (end < text.size() && is_digit(text[end])) ++end;
  return text.substr(at, end - at);
}

std::string_view without_leading_zeros(std::string_view number) {
  const size_t first = number.find_first_not_of('0');
  return first == std::string_view::npos ? std::string_view{} : number.substr(first);
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  size_t i = 0;
  size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const std::string_view run_a = digits_at(a, i);
      const std::string_view run_b = digits_at(b, j);
      // Compared as text, so that no run of digits is too long for an integer.
      const std::string_view number_a = without_leading_zeros(run_a);
      const std::string_view number_b = without_leading_zeros(run_b);
      if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      if (number_a != number_b) return number_a < number_b;
      i += run_a.size();
      j += run_b.size();
      continue;
    }
    if (a[i] != b[j]) return a[i] < b[j];
    ++i;
    ++j;
  }
  if ((i < a.size()) != (j < b.size())) return j < b.size();
  return a < b;  // equal but for leading zeros: still a strict order
}

FolderSource::FolderSource(const SourceConfig& config) : config_(config) {
  std::error_code error;
  if (!std::filesystem::is_directory(config.path, error))
    throw SourceError("source path '" + config.path + "': not a folder");
  if (std::filesystem::exists(std::filesystem::path(config.path) / kFrameIndex, error)) {
    recorded_ = read_frame_index(config.path);
    if (recorded_.empty()) throw SourceError("source path '" + config.path + "': no frame in its " + kFrameIndex);
    for (const RecordedFrame& f : recorded_) files_.push_back(std::filesystem::path(config.path) / f.file);
    return;
  }
  for (const auto& entry : std::filesystem::directory_iterator(config.path))
    if (entry.is_regular_file() && is_image(entry.path())) files_.push_back(entry.path());
  if (files_.empty()) throw SourceError("source path '" + config.path + "': no jpg, png, bmp, pgm, ppm or tif in it");
  std::sort(files_.begin(), files_.end(),
            [](const auto& a, const auto& b) { return natural_less(a.filename().string(), b.filename().string()); });
}

FrameResult FolderSource::next(std::chrono::milliseconds /*timeout*/) {
  if (next_ >= files_.size()) return EndOfFrames{};
  const std::string name = files_[next_].string();
  const DecodedImage image = read_gray(name, bits_);
  bits_ = std::max(bits_, image.bits);
  if (remark_.empty()) remark_ = orientation_remark(name, image.orientation);
  Frame frame;
  frame.gray = image.gray;
  if (frame.gray.empty()) {
    next_ = files_.size();
    return SourceFailure{"'" + name + "': not a readable image"};
  }
  frame.seq = static_cast<int64_t>(next_);
  frame.camera = config_.camera;
  frame.capture_utime = config_.start_utime + frame.seq * config_.period_us;
  if (!recorded_.empty()) {
    const RecordedFrame& was = recorded_[next_];
    frame.seq = was.seq, frame.camera = was.camera, frame.capture_utime = was.utime;
  }
  ++next_;
  return frame;
}

VideoSource::VideoSource(const SourceConfig& config) : config_(config) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(config.path, error))
    throw SourceError("source path '" + config.path + "': not a file");
  if (!capture_.open(config.path)) throw SourceError("source path '" + config.path + "': no decoder opens it as video");
  // Containers of phones state a rotation that OpenCV applies by default.
  capture_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
  if (const auto rotation_deg = std::llround(capture_.get(cv::CAP_PROP_ORIENTATION_META)); rotation_deg != 0)
    remark_ = "'" + config.path + "' states a rotation of " + std::to_string(rotation_deg) +
              " degrees; the frames are not rotated: rows and columns are those of the sensor";
  const double rate_hz = capture_.get(cv::CAP_PROP_FPS);
  if (std::isfinite(rate_hz) && rate_hz > 0.1 && rate_hz < 1e4)
    config_.period_us = static_cast<int64_t>(std::llround(1e6 / rate_hz));
}

// OpenCV's FFmpeg reader ends alike at the end of the file and at the first packet that it cannot decode; what tells
// them apart is what the container says of its length. The number of frames of some containers is their length times a
// rate that need not be even, so that fewer frames alone prove nothing.
std::optional<std::string> VideoSource::missing() const {
  const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
  if (!std::isfinite(count) || count < 1.0 || count > 1e9 || static_cast<double>(seq_) >= count) return std::nullopt;
  const double length_us = count * static_cast<double>(config_.period_us);
  if (static_cast<double>(last_us_) + 1.5 * static_cast<double>(config_.period_us) >= length_us) return std::nullopt;
  return "'" + config_.path + "': " + std::to_string(seq_) + " frames could be read, its header says " +
         std::to_string(std::llround(count)) + ": it is cut off or damaged";
}

FrameResult VideoSource::next(std::chrono::milliseconds /*timeout*/) {
  if (ended_) return EndOfFrames{};
  cv::Mat picture;
  bool got = false;
  try {
    got = capture_.read(picture) && !picture.empty();
  } catch (const cv::Exception& error) {
    ended_ = true;
    return SourceFailure{"'" + config_.path + "': " + error.what()};
  }
  if (!got) {
    ended_ = true;
    if (auto text = missing()) return SourceFailure{std::move(*text)};
    return EndOfFrames{};
  }
  Frame frame;
  if (picture.channels() == 1)
    frame.gray = picture.clone();
  else
    cv::cvtColor(picture, frame.gray, cv::COLOR_BGR2GRAY);
  // Of the last frames that a decoder held back OpenCV says 0; so do containers without times.
  const double at_ms = capture_.get(cv::CAP_PROP_POS_MSEC);
  const int64_t at_us = std::isfinite(at_ms) ? std::llround(1000.0 * at_ms) : 0;
  if (seq_ == 0)
    last_us_ = std::max<int64_t>(0, at_us);
  else
    last_us_ = at_us > last_us_ ? at_us : last_us_ + config_.period_us;
  frame.seq = seq_++;
  frame.camera = config_.camera;
  frame.capture_utime = config_.start_utime + last_us_;
  return frame;
}

}  // namespace bevel::camera
