// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/calibration/calibration_file.hpp>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/core/persistence.hpp>
#include <set>

#include <bevel/error.hpp>
#include "camera/calibration/number_text.hpp"

namespace bevel::camera {
namespace {

constexpr const char* kSchema = "bevel-calibration";
constexpr const char* kChecksum = "checksum: \"fnv1a-";
constexpr std::uintmax_t kLargestFile_bytes = 1 << 20;
constexpr std::string_view kFrames[] = {"none", "fiducial", "insertion"};

std::string fnv1a(std::string_view text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  char out[24];
  std::snprintf(out, sizeof out, "%016llx", static_cast<unsigned long long>(hash));
  return out;
}

// Reads nodes by their full name, which every message gives.
class Reader {
 public:
  Reader(const cv::FileNode& node, std::string path, const std::string& file)
      : node_(node), path_(std::move(path)), file_(file) {}

  [[noreturn]] void refuse(const std::string& key, const std::string& what) const {
    throw CalibrationError(file_ + ": " + path_ + key + " " + what);
  }
  cv::FileNode need(const std::string& key) const {
    if (!node_.isMap() || node_[key].empty()) refuse(key, "is missing and is required");
    return node_[key];
  }
  Reader in(const std::string& key) const {
    const cv::FileNode node = need(key);
    if (!node.isMap()) refuse(key, "is not a table; allowed: a table of keys");
    return {node, path_ + key + ".", file_};
  }
  double number(const std::string& key) const {
    const cv::FileNode node = need(key);
    if (!node.isInt() && !node.isReal()) refuse(key, "is not a number; allowed: a finite number");
    const double value = node.real();
    if (!std::isfinite(value)) refuse(key, "is " + number_text(value) + ", allowed: a finite number");
    return value;
  }
  int integer(const std::string& key) const {
    const cv::FileNode node = need(key);
    if (!node.isInt()) refuse(key, "is not a whole number; allowed: a whole number");
    return static_cast<int>(node);
  }
  std::string text(const std::string& key) const {
    const cv::FileNode node = need(key);
    if (!node.isString()) refuse(key, "is not text; allowed: text");
    return node.string();
  }
  cv::Mat matrix(const std::string& key, int rows, int cols) const {
    const cv::FileNode node = need(key);
    const std::string size = std::to_string(rows) + " x " + std::to_string(cols) + " matrix of finite numbers";
    // Asked before OpenCV makes room for as many as a damaged file may say.
    const bool sized = node.isMap() && node["rows"].isInt() && node["cols"].isInt() && node["dt"].isString();
    if (!sized || static_cast<int>(node["rows"]) != rows || static_cast<int>(node["cols"]) != cols ||
        node["dt"].string() != "d")
      refuse(key, "is no matrix of that kind, allowed: a " + size);
    cv::Mat out;
    try {
      out = node.mat();
    } catch (const cv::Exception&) {
      out.release();
    }
    if (out.type() != CV_64F || out.rows != rows || out.cols != cols) refuse(key, "cannot be read, allowed: a " + size);
    for (int i = 0; i < rows * cols; ++i)
      if (!std::isfinite(out.at<double>(i / cols, i % cols)))
        refuse(key, "has " + number_text(out.at<double>(i / cols, i % cols)) + ", allowed: a " + size);
    return out;
  }
  bool has(const std::string& key) const { return !node_[key].empty(); }

 private:
  cv::FileNode node_;
  std::string path_;
  const std::string& file_;
};

cv::Mat matrix(const double* values, int rows, int cols) {
  cv::Mat out(rows, cols, CV_64F);
  std::copy(values, values + static_cast<std::ptrdiff_t>(rows) * cols, out.begin<double>());
  return out;
}

void write(cv::FileStorage& out, const CalibratedCamera& camera) {
  const CameraModel& m = camera.model;
  const auto& lens = m.lens.parameters;
  const cv::Matx33d K(lens[kFx], 0, lens[kCx], 0, lens[kFy], lens[kCy], 0, 0, 1);
  out << "{"
      << "camera" << m.number << "image_width" << m.lens.picture_px.width << "image_height" << m.lens.picture_px.height
      << "camera_matrix" << matrix(K.val, 3, 3) << "distortion_coefficients" << matrix(&lens[kK1], 1, 5)
      << "rotation_camera_from_A" << matrix(m.R_CA.val, 3, 3) << "translation_camera_from_A_mm"
      << matrix(m.p_CA_mm.val, 3, 1);
  if (m.wall) {
    const auto& wall = m.wall->parameters;
    const double nz = std::sqrt(1.0 - wall[kNormalX] * wall[kNormalX] - wall[kNormalY] * wall[kNormalY]);
    const double normal[3] = {wall[kNormalX], wall[kNormalY], nz};
    out << "wall"
        << "{"
        << "normal_in_camera" << matrix(normal, 3, 1) << "distance_mm" << wall[kDistance] << "index" << wall[kIndex]
        << "pane_mm" << m.wall->pane.thickness_mm << "pane_index" << m.wall->pane.index << "}";
  }
  const FitFigures& fit = camera.fit;
  out << "fit"
      << "{"
      << "pictures" << fit.pictures << "corners" << fit.corners << "rms_px" << fit.rms_px << "held_out_rms_px"
      << fit.held_out_rms_px << "lens_sd" << matrix(fit.lens_sd.data(), 1, kLensParameters) << "wall_sd"
      << matrix(fit.wall_sd.data(), 1, kWallParameters) << "}"
      << "}";
}

CalibratedCamera read_camera(const Reader& in) {
  CalibratedCamera camera;
  CameraModel& m = camera.model;
  m.number = in.integer("camera");
  m.lens.picture_px = {in.integer("image_width"), in.integer("image_height")};
  const cv::Mat K = in.matrix("camera_matrix", 3, 3);
  auto& lens = m.lens.parameters;
  lens[kFx] = K.at<double>(0, 0), lens[kFy] = K.at<double>(1, 1);
  lens[kCx] = K.at<double>(0, 2), lens[kCy] = K.at<double>(1, 2);
  if (cv::norm(K, cv::Mat(cv::Matx33d(lens[kFx], 0, lens[kCx], 0, lens[kFy], lens[kCy], 0, 0, 1)), cv::NORM_INF) > 0)
    in.refuse("camera_matrix", "has a skew or a last row that is not 0 0 1, allowed: fx 0 cx, 0 fy cy, 0 0 1");
  const cv::Mat distortion = in.matrix("distortion_coefficients", 1, 5);
  std::copy(distortion.begin<double>(), distortion.end<double>(), &lens[kK1]);
  in.matrix("rotation_camera_from_A", 3, 3).copyTo(cv::Mat(3, 3, CV_64F, m.R_CA.val));
  in.matrix("translation_camera_from_A_mm", 3, 1).copyTo(cv::Mat(3, 1, CV_64F, m.p_CA_mm.val));
  if (in.has("wall")) {
    const Reader w = in.in("wall");
    FlatWall wall;
    const cv::Mat normal = w.matrix("normal_in_camera", 3, 1);
    if (std::abs(cv::norm(normal) - 1.0) > 1e-6 || !(normal.at<double>(2) > 0.0))
      w.refuse("normal_in_camera", "has the length " + number_text(cv::norm(normal)) + " and z " +
                                       number_text(normal.at<double>(2)) + ", allowed: length 1, z above 0");
    wall.parameters = {normal.at<double>(0), normal.at<double>(1), w.number("distance_mm"), w.number("index")};
    wall.pane = {w.number("pane_mm"), w.number("pane_index")};
    m.wall = wall;
  }
  const Reader f = in.in("fit");
  camera.fit.pictures = f.integer("pictures");
  camera.fit.corners = f.integer("corners");
  camera.fit.rms_px = f.number("rms_px");
  camera.fit.held_out_rms_px = f.number("held_out_rms_px");
  const cv::Mat lens_sd = f.matrix("lens_sd", 1, kLensParameters), wall_sd = f.matrix("wall_sd", 1, kWallParameters);
  std::copy(lens_sd.begin<double>(), lens_sd.end<double>(), camera.fit.lens_sd.begin());
  std::copy(wall_sd.begin<double>(), wall_sd.end<double>(), camera.fit.wall_sd.begin());
  return camera;
}

Calibration read_all(const cv::FileStorage& storage, const std::string& name) {
  const Reader root(storage.root(), "", name);
  Calibration out;
  out.made_utc = root.text("made_utc");
  const std::string frame = root.text("frame");
  const auto* kind = std::find(std::begin(kFrames), std::end(kFrames), frame);
  if (kind == std::end(kFrames)) root.refuse("frame", "is '" + frame + "', allowed: none, fiducial, insertion");
  out.frame = static_cast<FrameKind>(kind - std::begin(kFrames));
  const cv::FileNode cameras = root.need("cameras");
  if (!cameras.isSeq() || cameras.begin() == cameras.end() || cameras.size() > 16)
    root.refuse("cameras",
                "are " + std::to_string(cameras.isSeq() ? cameras.size() : 0) + ", allowed: a list of 1 to 16");
  std::set<int> numbers;
  for (const cv::FileNode& node : cameras) {
    out.cameras.push_back(read_camera(Reader(node, "cameras[" + std::to_string(out.cameras.size()) + "].", name)));
    const int number = out.cameras.back().model.number;
    if (!numbers.insert(number).second)
      root.refuse("cameras", "have the number " + std::to_string(number) + " twice, allowed: once each");
    try {
      check(out.cameras.back().model);
    } catch (const ArgumentError& error) {
      throw CalibrationError(name + ": " + error.what());
    }
  }
  return out;
}

}  // namespace

std::string_view name_of(FrameKind kind) { return kFrames[static_cast<size_t>(kind)]; }

void move_frame(const cv::Matx33d& R, const cv::Vec3d& t_mm, Calibration& calibration) {
  for (CalibratedCamera& camera : calibration.cameras) {
    camera.model.p_CA_mm += camera.model.R_CA * t_mm;
    camera.model.R_CA = camera.model.R_CA * R;
  }
}

std::string with_checksum(const std::string& body) { return body + kChecksum + fnv1a(body) + "\"\n"; }

std::string to_yaml(const Calibration& calibration) {
  cv::FileStorage out(".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  out << "schema" << kSchema << "schema_version" << kCalibrationVersion << "made_utc" << calibration.made_utc << "frame"
      << std::string(name_of(calibration.frame)) << "cameras"
      << "[";
  for (const CalibratedCamera& camera : calibration.cameras) write(out, camera);
  out << "]";
  std::string body = out.releaseAndGetString();
  // Some versions end a document, and a key after that would belong to the next.
  if (const auto end = body.rfind("\n...\n"); end != std::string::npos) body.resize(end + 1);
  return with_checksum(body);
}

Calibration from_yaml(const std::string& text, const std::string& name) {
  if (text.find(kSchema) == std::string::npos)
    throw CalibrationError(name + ": schema is missing, allowed: " + kSchema + "; this is no file of bevel-calibrate");
  // Version before checksum: a later version may end otherwise.
  if (const auto at = text.find("schema_version:"); at != std::string::npos) {
    const std::string version = text.substr(at + 15, text.find('\n', at) - at - 15);
    if (std::atoi(version.c_str()) != kCalibrationVersion)
      throw CalibrationError(name + ": schema_version is" + version +
                             ", allowed: " + std::to_string(kCalibrationVersion) +
                             "; make the calibration anew with this bevel-calibrate");
  } else {
    throw CalibrationError(name + ": schema_version is missing and is required");
  }
  const auto at = text.rfind(kChecksum);
  if (at == std::string::npos)
    throw CalibrationError(name + ": its last line, checksum, is missing: the file was cut at " +
                           std::to_string(text.size()) + " bytes; allowed: a whole file of bevel-calibrate");
  const std::string body = text.substr(0, at);
  if (text != with_checksum(body))
    throw CalibrationError(name + ": checksum is " + text.substr(at + 18, 16) + ", its text has " + fnv1a(body) +
                           "; the file was damaged or changed by hand; allowed: as bevel-calibrate wrote it");
  try {
    const cv::FileStorage storage(text, cv::FileStorage::READ | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
    if (!storage.isOpened()) throw CalibrationError(name + ": not YAML");
    return read_all(storage, name);
  } catch (const CalibrationError&) {
    throw;
  } catch (const cv::Exception& error) {
    throw CalibrationError(name + ": not YAML that OpenCV reads: " + error.err);
  } catch (const std::exception& error) {  // its parser lets some of the library's own through
    throw CalibrationError(name + ": not YAML that OpenCV reads: " + error.what());
  }
}

Calibration load_calibration(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) throw CalibrationError(path + ": not a file");
  const auto bytes = std::filesystem::file_size(path, error);
  if (error || bytes > kLargestFile_bytes)
    throw CalibrationError(path + ": has " + std::to_string(bytes) + " bytes, allowed: up to " +
                           std::to_string(kLargestFile_bytes));
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in.good() && !in.eof()) throw CalibrationError(path + ": cannot be read");
  return from_yaml(text, path);
}

void save_calibration(const Calibration& calibration, const std::string& path) {
  const std::string unfinished = path + ".part";
  std::error_code error;
  {
    std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
    out << to_yaml(calibration);
    out.close();
    if (!out) {
      std::filesystem::remove(unfinished, error);
      throw CalibrationError(path + ": cannot be written; is the disk full, or the folder write-protected?");
    }
  }
  std::filesystem::rename(unfinished, path, error);
  if (error) throw CalibrationError(path + ": cannot be written: " + error.message());
}

const CalibratedCamera& camera_of(const Calibration& calibration, int number, const std::string& name) {
  std::string known;
  for (const CalibratedCamera& camera : calibration.cameras) {
    if (camera.model.number == number) return camera;
    known += (known.empty() ? "" : ", ") + std::to_string(camera.model.number);
  }
  throw CalibrationError(name + ": camera " + std::to_string(number) + " is not in it, allowed: " + known);
}

}  // namespace bevel::camera
