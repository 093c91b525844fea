// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/calibration/calibrate.hpp>

#include <algorithm>
#include <set>

#include <bevel/error.hpp>
#include "camera/calibration/number_text.hpp"

namespace bevel::camera {
namespace {

constexpr double kFarOut = 6.0;          // robust standard deviations at which a corner is left out
constexpr double kFarOutLeast_px = 0.3;  // and never nearer than this
constexpr double kWorsePicture = 3.0;    // times the median RMS at which a picture is
constexpr double kWorseLeast_px = 0.5;
constexpr double kFocalShare = 0.05;  // of the focal length, its standard deviation at most

void require_pictures(const Board& board, const CalibrationInput& in) {
  if (in.numbers.empty() || in.numbers.size() > 2 || in.sizes_px.size() != in.numbers.size())
    throw ArgumentError("cameras are " + std::to_string(in.numbers.size()) + ", allowed: 1 or 2");
  if (in.numbers.size() == 2 && in.numbers[0] == in.numbers[1])
    throw ArgumentError("both cameras have the number " + std::to_string(in.numbers[0]) + ", allowed: two numbers");
  if (in.numbers.size() == 2 && !board.oriented())
    throw ArgumentError(
        "the chessboard has " + std::to_string(board.spec().columns) + " x " + std::to_string(board.spec().rows) +
        " squares and looks the same upside down; allowed with two cameras: an even number one way and an "
        "odd one the other, or ChArUco");
  for (const Shot& shot : in.shots)
    if (shot.seen.size() != in.numbers.size())
      throw ArgumentError("'" + shot.name + "' has " + std::to_string(shot.seen.size()) +
                          " sightings, allowed: " + std::to_string(in.numbers.size()));
}

// After all that is left out: whether what is left is enough.
void require_enough(const CalibrationInput& in, const std::vector<Shot>& shots, const Copies& copies) {
  const auto repeated = [&copies](size_t camera, bool immersed) -> std::string {
    const int number = copies[camera][immersed ? 1 : 0];
    if (number == 0) return {};
    return "; " + std::to_string(number) +
           " more repeat the view of another picture: turn the board by 20 to 40 degrees and move it between pictures";
  };
  const auto count = [&](auto&& of) { return static_cast<int>(std::ranges::count_if(shots, of)); };
  for (size_t c = 0; c < in.numbers.size(); ++c) {
    const int in_air = count([&](const Shot& s) { return !s.immersed && !s.seen[c].ids.empty(); });
    if (in_air < kFewestPictures)
      throw ArgumentError("camera " + std::to_string(in.numbers[c]) + ": pictures in air with a board are " +
                          std::to_string(in_air) + ", allowed: " + std::to_string(kFewestPictures) +
                          " or more, better 15 to 30" + repeated(c, false));
    const int immersed = count([&](const Shot& s) { return s.immersed && !s.seen[c].ids.empty(); });
    const bool any = count([](const Shot& s) { return s.immersed; }) > 0;
    if (any && immersed < 3)
      throw ArgumentError("camera " + std::to_string(in.numbers[c]) + ": immersed pictures with a board are " +
                          std::to_string(immersed) + ", allowed: none of any camera, or 3 or more, better 8" +
                          repeated(c, true));
  }
  if (in.numbers.size() < 2) return;
  const int together = count([](const Shot& s) { return !s.seen[0].ids.empty() && !s.seen[1].ids.empty(); });
  if (together < 3)
    throw ArgumentError("shots in which both cameras found the board are " + std::to_string(together) +
                        ", allowed: 3 or more; pictures of one moment have one name in both folders");
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

double length(const Residual& r) { return cv::norm(r.seen_less_fitted_px); }

// Pictures much worse than the others, whole: the board moved, or it is another board.
void leave_out_pictures(const CalibrationInput& in, const Rig& rig, const Board& board, Calibrated& out) {
  struct Picture {
    size_t camera, shot;
    double rms_px;
  };
  std::vector<Picture> pictures;
  std::vector<double> all;
  const auto residuals = residuals_of(board, out.shots, rig);
  for (size_t c = 0; c < in.numbers.size(); ++c)
    for (size_t s = 0; s < out.shots.size(); ++s) {
      std::vector<double> lengths;
      for (const Residual& r : residuals)
        if (r.camera == c && r.shot == s) lengths.push_back(length(r));
      if (lengths.empty()) continue;
      pictures.push_back({c, s, median(lengths)});  // a few wrong corners are no wrong picture
      all.push_back(pictures.back().rms_px);
    }
  const double allowed_px = std::max(kWorseLeast_px, kWorsePicture * median(all));
  for (const Picture& p : pictures) {
    if (p.rms_px <= allowed_px) continue;
    out.left_out.push_back({out.shots[p.shot].name + " (camera " + std::to_string(in.numbers[p.camera]) + ")",
                            "its corners lie " + number_text(p.rms_px) + " px beside the fit, allowed: " +
                                number_text(allowed_px) + "; the board moved, or is bent"});
    out.shots[p.shot].seen[p.camera] = {};
  }
}

void leave_out_corners(const Rig& rig, const Board& board, Calibrated& out) {
  const auto residuals = residuals_of(board, out.shots, rig);
  std::vector<double> lengths;
  for (const Residual& r : residuals) lengths.push_back(length(r));
  // The length of a two-dimensional Gaussian has the median 1.1774 sigma.
  const double allowed_px = std::max(kFarOutLeast_px, kFarOut * median(lengths) / 1.1774);
  for (auto r = residuals.rbegin(); r != residuals.rend(); ++r) {
    if (length(*r) <= allowed_px) continue;
    Sighting& seen = out.shots[r->shot].seen[r->camera];
    const auto at = static_cast<std::ptrdiff_t>(r->corner);
    seen.ids.erase(seen.ids.begin() + at);
    seen.px.erase(seen.px.begin() + at);
    ++out.corners_left_out;
  }
}

// Empties sightings of too few corners, and takes away shots that nobody sees, with their boards.
void drop_empty(const CalibrationInput& in, Calibrated& out, Rig* rig) {
  for (size_t s = out.shots.size(); s-- > 0;) {
    bool seen = false;
    for (size_t c = 0; c < in.numbers.size(); ++c) {
      Sighting& one = out.shots[s].seen[c];
      if (!one.ids.empty() && one.ids.size() < kFewestCorners) {
        out.left_out.push_back(
            {out.shots[s].name + " (camera " + std::to_string(in.numbers[c]) + ")",
             std::to_string(one.ids.size()) + " corners, allowed: " + std::to_string(kFewestCorners) + " or more"});
        one = {};
      }
      seen = seen || !one.ids.empty();
    }
    if (seen) continue;
    out.shots.erase(out.shots.begin() + static_cast<std::ptrdiff_t>(s));
    if (rig) rig->boards.erase(rig->boards.begin() + static_cast<std::ptrdiff_t>(s));
  }
}

void fill_figures(const CalibrationInput& in, const Board& board, Calibrated& out) {
  out.residuals = residuals_of(board, out.shots, out.rig);
  for (size_t c = 0; c < in.numbers.size(); ++c) {
    CalibratedCamera camera;
    camera.model = camera_in(out.rig, c, true);
    camera.model.number = in.numbers[c];
    camera.fit.lens_sd = out.sd.lens[c];
    camera.fit.wall_sd = out.sd.wall[c];
    std::vector<Residual> of_camera;
    for (size_t s = 0; s < out.shots.size(); ++s) {
      std::vector<Residual> of_picture;
      for (const Residual& r : out.residuals)
        if (r.camera == c && r.shot == s) of_picture.push_back(r);
      if (of_picture.empty()) continue;
      out.pictures.push_back(
          {out.shots[s].name, c, out.shots[s].immersed, static_cast<int>(of_picture.size()), rms(of_picture), -1.0});
      of_camera.insert(of_camera.end(), of_picture.begin(), of_picture.end());
      ++camera.fit.pictures;
    }
    camera.fit.corners = static_cast<int>(of_camera.size());
    camera.fit.rms_px = rms(of_camera);
    const double fx = camera.model.lens.parameters[kFx], sd = camera.fit.lens_sd[kFx];
    if (!(sd < kFocalShare * fx))
      throw DomainError("camera " + std::to_string(in.numbers[c]) + ": the standard deviation of fx is " +
                        number_text(sd) + " px of " + number_text(fx) +
                        ", allowed: 5 %; turn the board by 20 to 40 degrees to all sides");
    check(camera.model);
    out.calibration.cameras.push_back(camera);
  }
}

// Until {A} is known: as if the needle went down in the first camera's picture, in the middle of where the boards were.
// Views need a needle's plane to put their points on; what they know, across the ray, does not depend on it.
void set_provisional_frame(const Board& board, Calibrated& out) {
  const bool any_immersed = std::ranges::any_of(out.shots, &Shot::immersed);
  const BoardSpec& spec = board.spec();
  const cv::Vec3d middle_B(0.5 * spec.columns * spec.square_mm, 0.5 * spec.rows * spec.square_mm, 0.0);
  cv::Vec3d sum;
  int count = 0;
  for (size_t s = 0; s < out.shots.size(); ++s) {
    if (out.shots[s].immersed != any_immersed) continue;
    sum += out.rig.boards[s](middle_B);
    ++count;
  }
  // Columns: x ahead, y to the right, z down, in {C0}.
  move_frame({0, 1, 0, 0, 0, 1, 1, 0, 0}, sum * (1.0 / count), out.calibration);
}

}  // namespace

Calibrated calibrate(const Board& board, const CalibrationInput& input) {
  require_pictures(board, input);
  Calibrated out;
  out.numbers = input.numbers;
  out.shots = input.shots;
  const Copies copies = leave_out_copies(input, out.shots, out.left_out);
  drop_empty(input, out, nullptr);
  require_enough(input, out.shots, copies);
  Rig rig = start_rig(board, out.shots, input.sizes_px, input.options);
  fit_rig(board, out.shots, input.options, 1.0, rig);
  leave_out_pictures(input, rig, board, out);
  drop_empty(input, out, &rig);
  require_enough(input, out.shots, copies);
  fit_rig(board, out.shots, input.options, 1.0, rig);
  leave_out_corners(rig, board, out);
  drop_empty(input, out, &rig);
  require_enough(input, out.shots, copies);
  fit_rig(board, out.shots, input.options, 0.0, rig);
  out.sd = deviations(board, out.shots, input.options, rig);
  out.rig = std::move(rig);
  for (size_t c = 0; c < input.numbers.size(); ++c) out.tilts.push_back(distinct_tilts(out.shots, out.rig, c));
  fill_figures(input, board, out);
  set_provisional_frame(board, out);
  hold_out(board, input, out);
  return out;
}

}  // namespace bevel::camera
