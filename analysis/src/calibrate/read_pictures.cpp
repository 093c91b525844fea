// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <set>

#include <bevel/analysis/calibrate/calibrate_tool.hpp>
#include <bevel/drivers/camera/decode.hpp>
#include <bevel/drivers/camera/frame_source.hpp>
#include <bevel/error.hpp>

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;

std::string text_of(const cv::Size& size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height) + " px";
}

bool is_picture(const fs::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static constexpr std::array known = {".jpg", ".jpeg", ".png", ".bmp", ".pgm", ".ppm", ".tif", ".tiff"};
  return std::ranges::find(known, extension) != known.end();
}

std::vector<fs::path> pictures_in(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw ArgumentError("'" + folder + "' is not a folder; allowed: a folder of pictures");
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && is_picture(entry.path())) files.push_back(entry.path());
  if (files.empty()) throw ArgumentError("'" + folder + "' has no picture; allowed: jpg, png, bmp, pgm, ppm, tif");
  std::ranges::sort(files, [](const fs::path& a, const fs::path& b) {
    return camera::natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

// With the same pictures twice, two cameras would have one pose, or a board would be in air and in the gel at once.
void require_different_folders(const CalibrateOptions& options) {
  std::map<fs::path, std::string> options_by_folder;
  for (const auto& [option, folders] : {std::pair("--air", &options.air), {"--immersed", &options.immersed}})
    for (const std::string& folder : *folders) {
      std::error_code error;
      const fs::path path = fs::canonical(folder, error);
      if (error) continue;  // pictures_in() reports it
      const auto [at, is_new] = options_by_folder.emplace(path, option);
      if (!is_new)
        throw ArgumentError(std::string(option) + " '" + folder + "' is the same folder as one of " + at->second +
                            "; allowed: different folders for all cameras and media");
    }
}

class Reader {
 public:
  Reader(const camera::Board& board, size_t cameras, BoardPictures& out) : board_(board), first_(cameras), out_(out) {
    out.input.sizes_px.resize(cameras);
  }

  // Corners in one picture; none, with the reason noted, where there is no board.
  camera::Sighting read(const fs::path& file, size_t camera) {
    const camera::DecodedImage image = camera::read_gray(file);
    const cv::Mat& gray = image.gray;
    if (gray.empty()) {
      ++out_.unreadable;
      out_.left_out.push_back({file.string(), "not a readable picture"});
      return {};
    }
    note_format(file, image);
    cv::Size& size = out_.input.sizes_px[camera];
    if (first_[camera].empty()) first_[camera] = file.string(), size = gray.size();
    if (gray.size() != size)
      throw ArgumentError("'" + file.string() + "' is " + text_of(gray.size()) + ", allowed: " + text_of(size) +
                          " as '" + first_[camera] + "', the first of this camera; a calibration holds for one size");
    camera::Sighting seen = board_.find(gray);
    if (seen.ids.empty()) {
      const std::string none = "no board of " + std::to_string(board_.spec().columns) + " x " +
                               std::to_string(board_.spec().rows) + " squares found in it";
      out_.left_out.push_back({file.string(), seen.rejected.empty() ? none : none + ": " + seen.rejected});
      return seen;
    }
    note_pattern(file, seen);
    return seen;
  }

 private:
  // All pictures are of one board.
  void note_pattern(const fs::path& file, const camera::Sighting& seen) {
    if (!board_.has_two_patterns() || seen.ids.size() < static_cast<size_t>(camera::kFewestCorners)) return;
    if (!out_.pattern) out_.pattern = seen.pattern, patterned_ = file.string();
    if (*out_.pattern != seen.pattern)
      throw ArgumentError("'" + file.string() + "' shows a board with the " + name_of(seen.pattern) +
                          " ChArUco pattern, '" + patterned_ + "' one with the " + name_of(*out_.pattern) +
                          "; allowed: one board in all pictures");
  }

  // One remark per folder: the images of a camera have the same format.
  void note_format(const fs::path& file, const camera::DecodedImage& image) {
    const std::string folder = file.parent_path().string();
    if (image.orientation != 1 && oriented_.insert(folder).second)
      out_.remarks.push_back(camera::orientation_remark(file.string(), image.orientation));
    if (image.bits != 8 && image.bits != 16 && scaled_.insert(folder).second)
      out_.remarks.push_back("'" + file.string() + "' uses " + std::to_string(image.bits) +
                             " of its 16 bits per sample; they are scaled to 8 bits");
  }

  const camera::Board& board_;
  std::string patterned_;                    // the picture that gave out_.pattern
  std::set<std::string> oriented_, scaled_;  // folders that have a remark
  std::vector<std::string> first_;
  BoardPictures& out_;
};

}  // namespace

std::string name_of(camera::CharucoPattern pattern) {
  return pattern == camera::CharucoPattern::legacy ? "legacy" : "current";
}

BoardPictures read_pictures(const camera::Board& board, const CalibrateOptions& options) {
  const size_t cameras = options.air.size();
  if (cameras > 2)
    throw ArgumentError("--air has " + std::to_string(cameras) + " folders, allowed: 1 or 2, one per camera");
  for (const auto& [what, given] :
       {std::pair("--immersed", options.immersed.size()), {"--fiducial", options.fiducial.size()}})
    if (given != 0 && given != cameras)
      throw ArgumentError(std::string(what) + " has " + std::to_string(given) +
                          " values, allowed: " + std::to_string(cameras) + ", one per folder of --air, or none");
  if (options.numbers.size() < cameras)
    throw ArgumentError("--numbers has " + std::to_string(options.numbers.size()) +
                        " values, allowed: " + std::to_string(cameras) + " or more");
  require_different_folders(options);
  BoardPictures out;
  out.input.options = options.fit;
  for (size_t c = 0; c < cameras; ++c) out.input.numbers.push_back(static_cast<int>(options.numbers[c]));
  Reader reader(board, cameras, out);
  for (const bool immersed : {false, true}) {
    const std::vector<std::string>& folders = immersed ? options.immersed : options.air;
    std::map<std::string, size_t> by_name;
    for (size_t c = 0; c < folders.size(); ++c)
      for (const fs::path& file : pictures_in(folders[c])) {
        const std::string name = (immersed ? "immersed " : "air ") + file.filename().string();
        const auto [at, is_new] = by_name.emplace(name, out.input.shots.size());
        if (is_new) out.input.shots.push_back({name, immersed, std::vector<camera::Sighting>(cameras)});
        out.input.shots[at->second].seen[c] = reader.read(file, c);
      }
  }
  out.fiducial = {"fiducial", options.fiducial_immersed, {}};
  for (size_t c = 0; c < options.fiducial.size(); ++c) {
    if (!fs::is_regular_file(options.fiducial[c]))
      throw ArgumentError("--fiducial '" + options.fiducial[c] + "' is not a file; allowed: a picture");
    out.fiducial.seen.push_back(reader.read(options.fiducial[c], c));
  }
  return out;
}

}  // namespace bevel::analysis
