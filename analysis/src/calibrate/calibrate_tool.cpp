// SPDX-License-Identifier: MIT
#include <bevel/analysis/calibrate/calibrate_tool.hpp>

#include <chrono>
#include <filesystem>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <ostream>
#include <sstream>

#include <bevel/cli/exit_status.hpp>
#include <bevel/error.hpp>
#include <bevel/io/recording.hpp>
#include <bevel/io/result_file.hpp>
#include <bevel/report/numbers.hpp>

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;
using report::format_significant;

std::string utc_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::ostringstream out;
  out << std::put_time(&utc, "%Y-%m-%dT%H:%M:%SZ");
  return out.str();
}

std::string in_words(const CalibrateOptions& o) {
  std::ostringstream out;
  out << o.pattern << ", " << o.board.columns << " x " << o.board.rows << " squares of " << o.board.square_mm << " mm";
  if (o.pattern == "charuco") out << ", markers of " << o.board.marker_mm << " mm";
  return out.str();
}

void print_board(const camera::Board& board, const std::string& path, std::ostream& out) {
  const std::string extension = fs::path(path).extension().string();
  if (extension == ".svg") {
    io::write_result_file(path, board.drawing_svg());
  } else if (extension == ".png") {
    std::vector<unsigned char> picture;
    if (!cv::imencode(extension, board.drawing(140), picture))
      throw IoError("--board '" + path + "': the picture cannot be encoded");
    io::write_result_file(path, {reinterpret_cast<const char*>(picture.data()), picture.size()});
  } else {
    throw ArgumentError("--board '" + path + "' ends in '" + extension + "', allowed: .svg, .png");
  }
  out << path
      << (extension == ".svg" ? ": print it at 100 %, without fitting it to the page"
                              : ": print it so that a square has the side you will give")
      << "; then measure the squares and give that as --square-mm\n";
  if (!board.oriented())
    out << "it looks the same upside down, good for one lens: for two cameras or as a fiducial take an even number of "
           "squares one way and an odd one the other\n";
}

// What a system file says of each camera.
std::vector<std::string> tables_of(const camera::Calibration& calibration, const std::string& yaml) {
  std::vector<std::string> tables;
  for (const auto& c : calibration.cameras)
    tables.push_back("[[camera]]\ncamera = " + std::to_string(c.model.number) + "\ncalibration = \"" + yaml + "\"" +
                     (calibration.frame == camera::FrameKind::none
                          ? "\nprovisional_frame = true   # only to record the insertion that gives the frame"
                          : ""));
  return tables;
}

int fit_pictures(const camera::Board& board, const CalibrateOptions& o, std::ostream& out, std::ostream& err) {
  if (o.gel_index != 0 && !(o.gel_index >= 1))
    throw ArgumentError("--gel-index is " + format_significant(o.gel_index) + ", allowed: 1 to 2.5, or 0");
  const BoardPictures pictures = read_pictures(board, o);
  const auto say_left_out = [&err](const std::vector<camera::LeftOut>& all) {
    for (const auto& left : all) err << "left out: " << left.name << ": " << left.why << '\n';
  };
  for (const std::string& remark : pictures.remarks) err << remark << '\n';
  say_left_out(pictures.left_out);  // also if too little is left
  camera::Calibrated got = camera::calibrate(board, pictures.input);
  got.calibration.made_utc = utc_now();
  BoardSettings told;
  told.board = in_words(o);
  if (pictures.pattern) {
    told.board += pictures.pattern == camera::CharucoPattern::legacy
                      ? ", legacy pattern (marker 0 in the first square: OpenCV up to 4.5.5, calib.io)"
                      : ", current pattern (first square black)";
    out << "board: " << told.board << '\n';
  }
  told.left_out = pictures.left_out;
  told.left_out.insert(told.left_out.end(), got.left_out.begin(), got.left_out.end());
  if (!pictures.fiducial.seen.empty()) {
    const auto& at = o.fiducial_origin_mm;
    const camera::FiducialPlace place{camera::rotation_of_axes(o.fiducial_x, o.fiducial_y), {at[0], at[1], at[2]}};
    const auto figures = camera::set_frame_by_fiducial(board, pictures.fiducial, place, got.rig, got.calibration);
    told.frame = "From the board at its known place, " + std::to_string(figures.readings) + " corners, RMS " +
                 format_significant(figures.rms_px) + " px.";
  } else {
    told.frame =
        "Not known yet: the cameras know each other and a provisional frame (z down in the first one's picture). "
        "Record a straight "
        "insertion with it, then: bevel-calibrate --calibration cameras.yaml --insertion LOG.";
  }
  if (o.gel_index != 0) {
    for (auto& c : got.calibration.cameras)
      if (c.model.wall) c.model.wall->parameters[camera::kIndex] = o.gel_index;
    told.frame += " Behind the walls the index is that of the gel, " + format_significant(o.gel_index, 5) +
                  ", and not that of the pictures.";
  }
  fs::create_directories(o.out_folder);
  told.yaml_path = fs::absolute(fs::path(o.out_folder) / "cameras.yaml").lexically_normal().string();
  told.tables = tables_of(got.calibration, told.yaml_path);
  camera::save_calibration(got.calibration, told.yaml_path);
  write_figures(got, o.out_folder);
  write_report(got, told, o.out_folder);
  for (size_t c = 0; c < got.calibration.cameras.size(); ++c) {
    const auto& fit = got.calibration.cameras[c].fit;
    out << "camera " << got.numbers[c] << ": " << fit.pictures << " pictures, " << fit.corners << " corners, RMS "
        << format_significant(fit.rms_px) << " px, held out " << format_significant(fit.held_out_rms_px) << " px\n";
  }
  const CalibrationVerdict verdict = verdict_of(got);
  out << verdict.title << ": " << verdict.reason << '\n';
  for (const auto& t : got.triangulation)
    out << (t.immersed ? "immersed" : "in air") << ": corners of boards held out, by both cameras, "
        << format_significant(t.shape_rms_mm) << " mm from the board's shape"
        << (t.immersed
                ? "; misplaced by " + format_significant(t.misplaced_without_wall_mm) + " mm if refraction were ignored"
                : "")
        << '\n';
  out << "frame {A}: " << told.frame << '\n' << told.yaml_path << ", " << o.out_folder << "/report.html\n";
  say_left_out(got.left_out);
  if (verdict.tone == CalibrationVerdict::Tone::bad) return cli::kFailed;
  return pictures.unreadable > 0 ? cli::kDamagedInput : cli::kOk;
}

// Depth of the needle at a time, on the line between two readings of the axes; nothing outside them.
std::optional<double> insertion_at(const std::vector<model::ActuatorState>& axes, std::int64_t utime) {
  const auto after = std::ranges::lower_bound(axes, utime, {}, &model::ActuatorState::utime);
  if (after == axes.end() || (after == axes.begin() && after->utime != utime)) return {};
  if (after->utime == utime) return after->insertion_mm;
  const auto before = after - 1;
  const double share = static_cast<double>(utime - before->utime) / static_cast<double>(after->utime - before->utime);
  return before->insertion_mm + share * (after->insertion_mm - before->insertion_mm);
}

int fit_insertion(const CalibrateOptions& o, std::ostream& out, std::ostream& err) {
  camera::Calibration calibration = camera::load_calibration(o.calibration);
  const io::Recording recording = io::read_recording(o.insertion);
  io::require_usable(o.insertion, recording);
  err << recording.remarks(o.insertion);
  std::vector<model::ActuatorState> axes = recording.actuators;
  std::ranges::sort(axes, {}, &model::ActuatorState::utime);
  std::vector<camera::InsertedTip> tips;
  for (const model::TipMeasurement& m : recording.tips) {
    if (m.status != 0) continue;
    camera::camera_of(calibration, m.camera, o.calibration);  // of no other camera
    const auto depth_mm = insertion_at(axes, m.utime);
    if (!depth_mm || *depth_mm <= 0) continue;
    camera::InsertedTip tip;
    for (int r = 0; r < 3; ++r) {
      tip.position_mm[r] = m.position_mm[r];
      for (int c = 0; c < 3; ++c) tip.information_per_mm2(r, c) = m.information_per_mm2(r, c);
    }
    tip.insertion_mm = *depth_mm;
    tips.push_back(tip);
  }
  const auto figures = camera::set_frame_by_insertion(tips, o.roll_deg * CV_PI / 180.0, calibration);
  calibration.made_utc = utc_now();
  fs::create_directories(o.out_folder);
  const std::string yaml = fs::absolute(fs::path(o.out_folder) / "cameras.yaml").lexically_normal().string();
  camera::save_calibration(calibration, yaml);
  out << figures.readings << " readings, " << format_significant(figures.rms_mm) << " mm RMS beside the line; "
      << format_significant(figures.scale, 5) << " mm seen per mm inserted (sd "
      << format_significant(figures.scale_sd, 2) << "); z known to " << format_significant(figures.tilt_sd_rad, 2)
      << " rad\n"
      << yaml << '\n';
  for (const std::string& table : tables_of(calibration, yaml)) out << '\n' << table << '\n';
  return recording.intact() ? cli::kOk : cli::kDamagedInput;
}

}  // namespace

int run(const CalibrateOptions& options, std::ostream& out, std::ostream& err) {
  if (!options.latency.empty()) return fit_latency(options, out, err);
  if (!options.insertion.empty()) return fit_insertion(options, out, err);
  CalibrateOptions o = options;
  o.board.kind = o.pattern == "chessboard" ? camera::BoardKind::chessboard : camera::BoardKind::charuco;
  const camera::Board board(o.board);
  if (!o.print_board.empty()) {
    print_board(board, o.print_board, out);
    return cli::kOk;
  }
  return fit_pictures(board, o, out, err);
}

}  // namespace bevel::analysis
