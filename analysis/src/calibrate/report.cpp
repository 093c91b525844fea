// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include <bevel/analysis/calibrate/calibrate_tool.hpp>
#include <bevel/io/result_file.hpp>
#include <bevel/report/numbers.hpp>
#include <bevel/report/page.hpp>

namespace bevel::analysis {
namespace {

using camera::Calibrated;
using camera::Residual;
using report::format_significant;
using report::Page;

constexpr int kCellsAcross = 8, kCellsDown = 6, kCells = kCellsAcross * kCellsDown;
constexpr double kGood_px = 0.3, kFair_px = 1.0;
constexpr double kSeenShare = 0.5;  // of the cells
// Standard error of the lens relative to its focal length: 0.3 mm and 1 mm over a needle path of 100 mm.
constexpr double kGoodLens = 0.003, kFairLens = 0.01;
// Orientations of the board. Without skew two determine a camera matrix, with one more they are checked (Zhang 2000).
constexpr int kFairTilts = 2, kGoodTilts = 3;

struct Cell {
  cv::Point2d sum_px, place_px;
  double squares_px2 = 0;
  int count = 0;
};

std::vector<Cell> cells_of(const Calibrated& got, size_t camera) {
  const cv::Size size = got.rig.lenses[camera].picture_px;
  std::vector<Cell> cells(kCells);
  for (const Residual& r : got.residuals) {
    if (r.camera != camera) continue;
    const int col = std::clamp(static_cast<int>(r.at_px.x * kCellsAcross / size.width), 0, kCellsAcross - 1);
    const int row = std::clamp(static_cast<int>(r.at_px.y * kCellsDown / size.height), 0, kCellsDown - 1);
    Cell& cell = cells.at(static_cast<size_t>(row) * kCellsAcross + static_cast<size_t>(col));
    cell.sum_px += r.seen_less_fitted_px;
    cell.place_px += r.at_px;
    cell.squares_px2 += r.seen_less_fitted_px.dot(r.seen_less_fitted_px);
    ++cell.count;
  }
  return cells;
}

int covered(const std::vector<Cell>& cells) {
  return static_cast<int>(std::ranges::count_if(cells, [](const Cell& c) { return c.count > 0; }));
}

// Every corner with its residual, thin, and their mean over each cell, thick; both enlarged.
std::string residual_map(const Calibrated& got, size_t camera) {
  const cv::Size size = got.rig.lenses[camera].picture_px;
  const double rms_px = std::max(1e-6, got.calibration.cameras[camera].fit.rms_px);
  const double scale = 0.015 * size.width / rms_px;
  std::ostringstream svg;
  svg.precision(5);
  const double unit = size.width / 640.0;
  svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"" << -6 * unit << ' ' << -6 * unit << ' '
      << size.width + 12 * unit << ' ' << size.height + 30 * unit << "\" font-family=\"sans-serif\" font-size=\""
      << 12 * unit << "\">\n<rect width=\"" << size.width << "\" height=\"" << size.height
      << "\" fill=\"var(--panel)\" stroke=\"var(--faint)\" stroke-width=\"" << unit << "\"/>\n";
  for (int i = 1; i < kCellsAcross; ++i)
    svg << "<path d=\"M" << 1.0 * i * size.width / kCellsAcross << " 0V" << size.height
        << "\" stroke=\"var(--grid)\" stroke-width=\"" << unit << "\"/>";
  for (int i = 1; i < kCellsDown; ++i)
    svg << "<path d=\"M0 " << 1.0 * i * size.height / kCellsDown << 'H' << size.width
        << "\" stroke=\"var(--grid)\" stroke-width=\"" << unit << "\"/>";
  for (const bool immersed : {false, true}) {
    svg << "\n<path fill=\"none\" stroke=\"" << (immersed ? "var(--ochre)" : "var(--likely)") << "\" stroke-width=\""
        << 0.8 * unit << "\" d=\"";
    for (const Residual& r : got.residuals)
      if (r.camera == camera && got.shots[r.shot].immersed == immersed)
        svg << 'M' << r.at_px.x << ' ' << r.at_px.y << 'l' << scale * r.seen_less_fitted_px.x << ' '
            << scale * r.seen_less_fitted_px.y;
    svg << "\"/>";
  }
  svg << "\n<path fill=\"none\" stroke=\"var(--red)\" stroke-width=\"" << 3 * unit << "\" d=\"";
  std::ostringstream dots;
  for (const Cell& cell : cells_of(got, camera)) {
    if (cell.count < 3) continue;
    const cv::Point2d at = cell.place_px / cell.count, mean = cell.sum_px / cell.count;
    svg << 'M' << at.x << ' ' << at.y << 'l' << scale * mean.x << ' ' << scale * mean.y;
    dots << "<circle cx=\"" << at.x << "\" cy=\"" << at.y << "\" r=\"" << 2.2 * unit << "\" fill=\"var(--red)\"/>";
  }
  svg << "\"/>\n"
      << dots.str() << "\n<path d=\"M0 " << size.height + 14 * unit << 'h' << scale * rms_px
      << "\" stroke=\"var(--ink)\" stroke-width=\"" << 2 * unit << "\"/><text fill=\"var(--ink)\" x=\""
      << scale * rms_px + 6 * unit << "\" y=\"" << size.height + 18 * unit << "\">" << format_significant(rms_px, 2)
      << " px; in air blue, immersed ochre, mean of each cell red</text>\n</svg>";
  return svg.str();
}

std::string with_sd(double value, double sd, const std::string& unit) {
  std::ostringstream out;
  out.precision(6);
  out << value << (unit.empty() ? "" : " " + unit);
  if (sd > 0) out << " (sd " << format_significant(sd, 2) << ")";
  return out.str();
}

void tell_parameters(const Calibrated& got, Page& page) {
  std::vector<std::string> header{"parameter"};
  for (const int number : got.numbers) header.push_back("camera " + std::to_string(number));
  static constexpr const char* names[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < camera::kLensParameters; ++i) {
    rows.push_back({names[i]});
    for (const auto& c : got.calibration.cameras)
      rows.back().push_back(with_sd(c.model.lens.parameters.at(i), c.fit.lens_sd.at(i), i < camera::kK1 ? "px" : ""));
  }
  const bool walls =
      std::ranges::any_of(got.calibration.cameras, [](const auto& c) { return c.model.wall.has_value(); });
  static constexpr std::pair<const char*, const char*> wall_names[] = {{"wall: normal, to the right", ""},
                                                                       {"wall: normal, down", ""},
                                                                       {"wall: distance", "mm"},
                                                                       {"index behind it", ""}};
  if (walls)
    for (size_t i = 0; i < camera::kWallParameters; ++i) {
      rows.push_back({wall_names[i].first});
      for (const auto& c : got.calibration.cameras)
        rows.back().push_back(
            c.model.wall ? with_sd(c.model.wall->parameters.at(i), c.fit.wall_sd.at(i), wall_names[i].second) : "none");
    }
  page.table(header, rows, "Standard deviations by the residuals' scatter; without one: held, not fitted.");
}

void tell_pictures(const Calibrated& got, Page& page) {
  std::vector<std::vector<std::string>> rows;
  for (const camera::PictureFigures& p : got.pictures)
    rows.push_back({p.name, std::to_string(got.numbers[p.camera]), std::to_string(p.corners),
                    format_significant(p.rms_px), p.held_out_rms_px >= 0 ? format_significant(p.held_out_rms_px) : ""});
  page.table({"picture", "camera", "corners", "RMS (px)", "held out (px)"}, rows,
             "RMS: of the distance of corners from the fit of all pictures. Held out: of every fourth, by cameras "
             "fitted without it.");
}

double worst_held_out_px(const Calibrated& got) {
  double worst = 0;
  for (const auto& c : got.calibration.cameras) worst = std::max(worst, c.fit.held_out_rms_px);
  return worst;
}

}  // namespace

double lens_error(const Calibrated& got, std::size_t camera) {
  const auto& c = got.calibration.cameras[camera];
  const auto& sd = c.fit.lens_sd;
  const double largest_px = std::max({sd[camera::kFx], sd[camera::kFy], sd[camera::kCx], sd[camera::kCy]});
  return largest_px / c.model.lens.parameters[camera::kFx];
}

CalibrationVerdict verdict_of(const Calibrated& got) {
  const double held_out_px = worst_held_out_px(got);
  double ratio = 0, seen = 1, error = 0;
  int tilts = std::numeric_limits<int>::max();
  for (size_t c = 0; c < got.numbers.size(); ++c) {
    ratio = std::max(ratio, systematic_ratio(got, c));
    seen = std::min(seen, 1.0 * covered(cells_of(got, c)) / kCells);
    error = std::max(error, lens_error(got, c));
    tilts = std::min(tilts, got.tilts[c]);
  }
  const std::string turn = "turn the board by 20 to 40 degrees to all sides and take more pictures.";
  const std::string error_text = "The standard error of focal length or principal point is " +
                                 format_significant(100 * error, 2) + " % of the focal length, allowed: ";
  const std::string tilts_text = "The board has " + std::to_string(tilts) + " orientation" + (tilts == 1 ? "" : "s") +
                                 " that differ by " + format_significant(camera::kDistinctTilt_deg) +
                                 " degrees or more, allowed: " + std::to_string(kGoodTilts) + " or more; " + turn;
  using enum CalibrationVerdict::Tone;
  if (held_out_px > kFair_px)
    return {bad, "Do not use it",
            "The error on pictures that were held out is " + format_significant(held_out_px) +
                " px, allowed: " + format_significant(kFair_px) +
                " px. Check that the board is flat, that --square-mm is the measured "
                "side of a square, and that focus and zoom did not change between pictures."};
  if (error > kFairLens)
    return {bad, "Do not use it", error_text + format_significant(100 * kFairLens) + " %; " + turn};
  if (tilts < kFairTilts) return {bad, "Do not use it", tilts_text};
  if (held_out_px > kGood_px)
    return {warning, "To be improved",
            "The error on pictures that were held out is " + format_significant(held_out_px) + " px, allowed: " +
                format_significant(kGood_px) + " px. Take more and sharper pictures of a flatter board."};
  if (error > kGoodLens)
    return {warning, "To be improved", error_text + format_significant(100 * kGoodLens) + " %; " + turn};
  if (tilts < kGoodTilts) return {warning, "To be improved", tilts_text};
  if (ratio > 3)
    return {warning, "To be improved",
            "The mean residuals in parts of the image (red lines below) are " + format_significant(ratio, 2) +
                " times what chance leaves, allowed: 3. The board is not flat, or the lens needs --k3."};
  if (seen < kSeenShare)
    return {
        warning, "Good where the board was",
        "The corners of the board cover " + format_significant(100 * seen, 2) +
            " % of the image. If the needle goes where the maps below are empty, take pictures of the board there."};
  return {
      good, "Good",
      "Pictures that were held out are predicted to the precision of the corners, and the lens is determined to " +
          format_significant(100 * error, 2) + " % of the focal length."};
}

double systematic_ratio(const Calibrated& got, std::size_t camera) {
  double means = 0, squares = 0;
  int cells = 0, count = 0;
  for (const Cell& cell : cells_of(got, camera)) {
    squares += cell.squares_px2;
    count += cell.count;
    if (cell.count < 3) continue;
    means += cell.sum_px.dot(cell.sum_px) / cell.count;
    ++cells;
  }
  return cells == 0 || squares == 0 ? 1.0 : std::sqrt(means / cells / (squares / count));
}

void write_report(const Calibrated& got, const BoardSettings& told, const std::string& folder) {
  Page page("Calibration of " + std::string(got.numbers.size() > 1 ? "two cameras" : "one camera"));
  std::vector<report::Fact> facts;
  for (size_t c = 0; c < got.numbers.size(); ++c) {
    const auto& fit = got.calibration.cameras[c].fit;
    facts.push_back({"camera " + std::to_string(got.numbers[c]) + ", held out",
                     format_significant(fit.held_out_rms_px) + " px",
                     "RMS of what was fitted: " + format_significant(fit.rms_px) + " px; lens to " +
                         format_significant(100 * lens_error(got, c), 2) + " % of its focal length, " +
                         std::to_string(got.tilts[c]) + " orientations of the board"});
  }
  for (const auto& t : got.triangulation)
    facts.push_back({t.immersed ? "corners in the gel" : "corners in air", format_significant(t.shape_rms_mm) + " mm",
                     "from the board's shape, held out, by both cameras"});
  for (const auto& t : got.triangulation)
    if (t.immersed)
      facts.push_back({"if refraction were ignored", format_significant(t.misplaced_without_wall_mm) + " mm",
                       "beside where they are"});
  const CalibrationVerdict verdict = verdict_of(got);
  page.verdict(verdict.tone == CalibrationVerdict::Tone::good      ? report::Tone::good
               : verdict.tone == CalibrationVerdict::Tone::warning ? report::Tone::warning
                                                                   : report::Tone::bad,
               verdict.title, verdict.reason, facts);
  page.paragraph("Board: " + told.board + ". Made " + got.calibration.made_utc + ".");
  page.heading("The frame {A}").paragraph(told.frame);

  page.heading("Residuals over the picture");
  page.paragraph(
      "Seen less fitted, enlarged. Thin lines should point anywhere; where the thick ones are as long as the thin, the "
      "model "
      "does not fit there. Where there are no lines nothing was seen, and the lens is a guess.");
  for (size_t c = 0; c < got.numbers.size(); ++c)
    page.picture(residual_map(got, c), "Camera " + std::to_string(got.numbers[c]) + ": corners in " +
                                           std::to_string(covered(cells_of(got, c))) + " of " + std::to_string(kCells) +
                                           " cells; means " + format_significant(systematic_ratio(got, c), 2) +
                                           " times what chance leaves.");
  page.heading("What was fitted");
  tell_parameters(got, page);
  page.heading("What was left out");
  if (told.left_out.empty() && got.corners_left_out == 0) page.paragraph("Nothing.");
  if (!told.left_out.empty()) {
    std::vector<std::vector<std::string>> rows;
    for (const auto& left : told.left_out) rows.push_back({left.name, left.why});
    page.table({"what", "why"}, rows);
  }
  if (got.corners_left_out > 0)
    page.paragraph(std::to_string(got.corners_left_out) +
                   " single corners, more than six robust standard deviations beside the fit. They "
                   "were left out before pictures were held out, so that no held-out figure counts them.");
  page.heading("Use it").paragraph("In the system file, in place of px_per_mm and the axes:");
  std::string tables;
  for (const std::string& table : told.tables) tables += (tables.empty() ? "" : "\n\n") + table;
  page.code(tables);
  page.paragraph(
      "Then look at what the cameras say: bevel-check, and bevel-camera --config SYSTEM.toml. Pictures of another "
      "size "
      "are refused, "
      "and so is the file if a byte of it has changed.");
  page.heading("Pictures");
  tell_pictures(got, page);
  page.save((std::filesystem::path(folder) / "report.html").string());
}

void write_figures(const Calibrated& got, const std::string& folder) {
  nlohmann::json cameras = nlohmann::json::array(), boards = nlohmann::json::array();
  for (size_t c = 0; c < got.numbers.size(); ++c) {
    const auto& fit = got.calibration.cameras[c].fit;
    cameras.push_back({{"camera", got.numbers[c]},
                       {"pictures", fit.pictures},
                       {"corners", fit.corners},
                       {"rms_px", fit.rms_px},
                       {"held_out_rms_px", fit.held_out_rms_px},
                       {"systematic_ratio", systematic_ratio(got, c)},
                       {"cells_covered", covered(cells_of(got, c))},
                       {"cells", kCells},
                       {"lens_standard_error", lens_error(got, c)},
                       {"orientations", got.tilts[c]}});
  }
  for (const auto& t : got.triangulation)
    boards.push_back({{"immersed", t.immersed},
                      {"corners", t.corners},
                      {"shape_rms_mm", t.shape_rms_mm},
                      {"misplaced_without_wall_mm", t.misplaced_without_wall_mm},
                      {"shape_without_wall_rms_mm", t.shape_without_wall_rms_mm}});
  const std::string path = (std::filesystem::path(folder) / "figures.json").string();
  io::write_result_file(path, nlohmann::json{{"verdict", verdict_of(got).title},
                                             {"cameras", cameras},
                                             {"held_out_boards", boards},
                                             {"corners_left_out", got.corners_left_out}}
                                      .dump(2) +
                                  "\n");
}

}  // namespace bevel::analysis
