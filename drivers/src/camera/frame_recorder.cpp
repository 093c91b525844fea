// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/frame_recorder.hpp>

#include <array>
#include <charconv>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include <bevel/drivers/camera/frame_source.hpp>
#include <bevel/error.hpp>

namespace bevel::camera {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeading = "utime,seq,camera,status,u_px,v_px,file";
constexpr size_t kFields = 7;

std::string line_of(const RecordedFrame& f) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%lld,%lld,%d,%d,%.3f,%.3f,", static_cast<long long>(f.utime),
                static_cast<long long>(f.seq), f.camera, f.status, f.tip_px.x, f.tip_px.y);
  return text.data() + f.file + "\n";
}

template <class Number>
bool read(const std::string& text, Number& value) {
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && at == end;
}

// Why the line is none, or empty.
std::string parse(const std::string& line, RecordedFrame& f) {
  std::array<std::string, kFields> field;
  size_t begin = 0;
  for (size_t i = 0; i < kFields; ++i) {
    const size_t comma = i + 1 < kFields ? line.find(',', begin) : line.size();
    if (comma == std::string::npos) return std::to_string(kFields) + " fields wanted: " + kHeading;
    field.at(i) = line.substr(begin, comma - begin);
    begin = comma + 1;
  }
  if (!read(field[0], f.utime) || f.utime < 0) return "utime is '" + field[0] + "', allowed: 0 or more microseconds";
  if (!read(field[1], f.seq) || f.seq < 0) return "seq is '" + field[1] + "', allowed: 0 or more";
  if (!read(field[2], f.camera) || f.camera < 0) return "camera is '" + field[2] + "', allowed: 0 or more";
  if (!read(field[3], f.status)) return "status is '" + field[3] + "', allowed: a whole number";
  if (!read(field[4], f.tip_px.x) || !read(field[5], f.tip_px.y)) return "u_px, v_px: two numbers wanted";
  f.file = field[6];
  if (f.file.empty() || f.file.find('/') != std::string::npos)
    return "file is '" + f.file + "', allowed: a name in the same folder";
  return "";
}

}  // namespace

std::vector<RecordedFrame> read_frame_index(const fs::path& folder) {
  const fs::path path = folder / kFrameIndex;
  std::ifstream file(path, std::ios::binary);
  std::vector<RecordedFrame> frames;
  std::string line;
  int number = 0;
  const auto fail = [&](const std::string& why) {
    throw SourceError(path.string() + ":" + std::to_string(number) + ": " + why);
  };
  while (std::getline(file, line)) {
    ++number;
    if (file.eof()) break;  // without its end: cut off
    if (number == 1) {
      if (line != kHeading) fail(std::string("its heading is not ") + kHeading);
      continue;
    }
    RecordedFrame f;
    if (const std::string why = parse(line, f); !why.empty()) fail(why);
    frames.push_back(std::move(f));
  }
  if (number == 0) fail("empty or unreadable");
  return frames;
}

FrameRecorder::FrameRecorder(const fs::path& folder, size_t queue_frames)
    : folder_(folder), queue_frames_(queue_frames) {
  const auto fail = [&](const std::string& why) {
    throw IoError("frames cannot be recorded into '" + folder.string() + "': " + why);
  };
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail(error.message());
  if (fs::exists(folder / kFrameIndex, error)) fail(std::string("there is a ") + kFrameIndex + " already");
  index_.open(folder / kFrameIndex, std::ios::binary);
  index_ << kHeading << '\n' << std::flush;
  if (!index_) fail(std::string(kFrameIndex) + " cannot be written");
  thread_ = std::thread([this] { work(); });
}

FrameRecorder::~FrameRecorder() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void FrameRecorder::offer(const cv::Mat& gray, const RecordedFrame& frame) {
  {
    const std::lock_guard lock(mutex_);
    if (!counts_.failure.empty() || queue_.size() >= queue_frames_) {
      ++counts_.dropped;
      return;
    }
    queue_.push_back({gray, frame});
  }
  changed_.notify_all();
}

FrameRecorder::Counts FrameRecorder::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void FrameRecorder::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return queue_.empty(); });
}

void FrameRecorder::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const Entry entry = queue_.front();  // it stays in the queue while it is written: finish() waits for it
    lock.unlock();
    const std::string failure = write(entry);
    lock.lock();
    queue_.pop_front();
    if (failure.empty()) {
      ++counts_.written;
    } else {  // a full disk does not mend itself frame by frame, and an index with holes is none
      counts_.failure = failure;
      counts_.dropped += 1 + static_cast<int64_t>(queue_.size());
      queue_.clear();
    }
    changed_.notify_all();
  }
}

std::string FrameRecorder::write(const Entry& entry) {
  RecordedFrame frame = entry.frame;
  // With its number: a camera that hangs gives one time twice.
  frame.file =
      std::to_string(frame.utime) + "-" + std::to_string(frame.camera) + "-" + std::to_string(frame.seq) + ".png";
  const std::string path = (folder_ / frame.file).string();
  std::vector<unsigned char> picture;
  bool good = false;
  try {
    good = cv::imencode(".png", entry.gray, picture, {cv::IMWRITE_PNG_COMPRESSION, 1});  // higher saves a tenth
  } catch (const cv::Exception&) {
    good = false;
  }
  if (!good) return "'" + path + "' cannot be encoded";
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(picture.data()), static_cast<std::streamsize>(picture.size()));
  file.close();
  if (!file) {
    std::error_code ignored;
    fs::remove(path, ignored);
    return "'" + path + "' cannot be written; is the disk full?";
  }
  index_ << line_of(frame) << std::flush;
  return index_ ? "" : "'" + (folder_ / kFrameIndex).string() + "' cannot be written";
}

}  // namespace bevel::camera
