// SPDX-License-Identifier: MIT
#pragma once
// A picture of a needle whose tip is known: what the trackers of drivers/src/camera are measured against. The
// silhouette is that of a cylinder cut by a plane (the bevel), supersampled; then bubbles, what stands before it,
// uneven light, glare, blur, gain and noise in the order in which light meets them. Lens and refraction move the
// background and the axis's points (optics.hpp), not the needle's width. Each disturbance is off, or has
// the stated small default, unless it is configured.
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include <bevel/drivers/camera/planar_view.hpp>
#include <bevel/rig/camera/optics.hpp>

namespace bevel::rig {

struct Spot {
  cv::Point2d centre_px;
  double radius_px = 5.0;
  double strength_gray = 60.0;  ///< glare: added light at the middle; bubble: darkness of the rim
};

/// Stands before the gel: a clamp, a cable, a finger.
struct Occluder {
  cv::Rect2d area_px;
  double gray = 120.0;
};

/// Rows are exposed one after the other, the first at the frame's stamp, while the needle moves.
struct RollingShutter {
  cv::Vec2d motion_px{0.0, 0.0};  ///< of the needle while the whole picture is read out
};

struct SceneConfig {
  cv::Size size_px{640, 480};
  double background_gray = 170.0;
  double vignette_gray = 15.0;  ///< darker by this in the corners
  double grid_mm = 10.0;        ///< spacing of printed paper behind the gel; 0 for none
  double grid_gray = 10.0;      ///< darkness of its lines
  double needle_gray = 60.0;
  double needle_diameter_mm = 1.27;
  double bevel_length_mm = 3.49;  ///< diameter / tan(20 degrees)
  double blur_px = 0.8;           ///< of the lens; standard deviation
  double noise_gray = 2.0;        ///< of the sensor; standard deviation
  double gain = 1.0;              ///< of the light
  std::vector<Spot> bubbles;
  std::vector<Spot> glare;
  std::vector<Occluder> occluders;
  cv::Vec2d light_gradient{0.0, 0.0};  ///< brighter by this share at the right (below) than in the middle
  double face_gray = -1.0;  ///< of the bevel's face where it is turned to the camera; negative: as the needle
  LensDistortion lens;
  FlatRefraction refraction;
  RollingShutter shutter;
  uint64_t seed = 1;  ///< of the noise
};

struct NeedlePicture {
  cv::Mat gray;
  cv::Point2d tip_px;      ///< on the shaft's axis, at the depth of the foremost point of the bevel; where it is seen
  cv::Vec2d direction_px;  ///< unit vector of the shaft at the tip
};

class NeedleRenderer {
 public:
  /// Throws ArgumentError naming the key, the value and what is allowed.
  NeedleRenderer(const SceneConfig& scene, const camera::PlanarView& view);
  /// Of any view, with its own lens and wall: the axis lies where it is seen, the width is that at the picture's
  /// middle.
  NeedleRenderer(const SceneConfig& scene, std::shared_ptr<const camera::View> view);

  /// `path_mm`: axis of the shaft in {A} from the entry point to the tip, at least two points; the shaft outside
  /// continues straight backward from the first segment. `roll_rad`: 0 the bevel faces the camera, pi/2 it is seen from
  /// the side. Fewer than two points, or one that the view cannot see: a picture without a needle (tip_px is then NaN).
  NeedlePicture render(const std::vector<camera::Vector3>& path_mm, double roll_rad);

  /// That roll as this camera sees it, of a bevel whose foremost point lies from the shaft's axis toward the unit
  /// vector `pointed_side` in {A}, square to the unit vector `heading` of the shaft at the tip. Of a picture that is
  /// not mirrored.
  double roll_seen_rad(const camera::Vector3& tip_mm, const camera::Vector3& heading,
                       const camera::Vector3& pointed_side) const;

  void set_gain(double gain) { scene_.gain = gain; }
  const cv::Mat& background() const { return background_; }

 private:
  void add_needle(cv::Mat& light, const std::vector<cv::Point2d>& axis_px, double roll_rad) const;
  void add_what_is_before(cv::Mat& light) const;
  cv::Point2d while_read_out(const cv::Point2d& p) const;

  SceneConfig scene_;
  Optics optics_;
  std::shared_ptr<const camera::View> view_;
  cv::Mat background_;  // CV_32F
  cv::Mat noise_;
  cv::RNG random_;
};

}  // namespace bevel::rig
