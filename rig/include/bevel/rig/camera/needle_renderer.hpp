// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Renderer of images of a needle with known tip, as reference for the trackers of drivers/src/camera. The silhouette
/// is that of a cylinder cut by a plane (the bevel), supersampled. Bubbles, occluders, uneven light, glare, blur, gain
/// and noise follow in the order in which they act on light. Lens and refraction move the background and the points of
/// the axis (optics.hpp), not the needle's width. Each disturbance is off or has the stated small default unless it is
/// configured.
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include <bevel/drivers/camera/planar_view.hpp>
#include <bevel/rig/camera/optics.hpp>

namespace bevel::rig {

/// A bubble or a glare spot.
struct Spot {
  cv::Point2d centre_px;        ///< centre, px
  double radius_px = 5.0;       ///< radius, px
  double strength_gray = 60.0;  ///< glare: added light at the middle; bubble: darkness of the rim
};

/// Object in front of the gel: a clamp, a cable, a finger.
struct Occluder {
  cv::Rect2d area_px;   ///< area, px
  double gray = 120.0;  ///< brightness, grey levels
};

/// Exposure of the rows one after the other, the first at the frame's time stamp, while the needle moves.
struct RollingShutter {
  /// Motion of the needle during the readout of the whole image, px.
  cv::Vec2d motion_px{0.0, 0.0};
};

/// Settings of the rendered scene.
struct SceneConfig {
  cv::Size size_px{640, 480};        ///< size of the image, px
  double background_gray = 170.0;    ///< brightness of the background, grey levels
  double vignette_gray = 15.0;       ///< reduction of the brightness in the corners, grey levels
  double grid_mm = 10.0;             ///< spacing of a grid printed behind the gel, mm; 0: none
  double grid_gray = 10.0;           ///< darkness of the grid lines, grey levels
  double needle_gray = 60.0;         ///< brightness of the needle, grey levels
  double needle_diameter_mm = 1.27;  ///< diameter of the needle, mm
  double bevel_length_mm = 3.49;     ///< length of the bevel, mm: diameter / tan(20 degrees)
  double blur_px = 0.8;              ///< standard deviation of the blur of the lens, px
  double noise_gray = 2.0;           ///< standard deviation of the noise of the sensor, grey levels
  double gain = 1.0;                 ///< factor of the illumination
  std::vector<Spot> bubbles;         ///< bubbles in the gel
  std::vector<Spot> glare;           ///< reflections
  std::vector<Occluder> occluders;   ///< objects in front of the gel
  /// Relative increase of the brightness from the middle to the right and to the bottom.
  cv::Vec2d light_gradient{0.0, 0.0};
  double face_gray = -1.0;  ///< brightness of the bevel's face towards the camera, grey levels; negative: as the needle
  LensDistortion lens;      ///< lens distortion
  FlatRefraction refraction;  ///< refraction at the wall of the gel
  RollingShutter shutter;     ///< rolling shutter
  uint64_t seed = 1;          ///< seed of the noise
};

/// Rendered image with the true tip.
struct NeedlePicture {
  cv::Mat gray;  ///< image, CV_8UC1
  /// Apparent position, px, of the point on the shaft's axis at the depth of the foremost point of the bevel; NaN
  /// without a needle.
  cv::Point2d tip_px;
  cv::Vec2d direction_px;  ///< unit vector of the shaft at the tip
};

/// Renders images of one scene.
class NeedleRenderer {
 public:
  /// Creates a renderer for a planar view.
  /// @param scene settings
  /// @param view  view of the camera
  /// @throws ArgumentError naming the key, the value and what is allowed
  NeedleRenderer(const SceneConfig& scene, const camera::PlanarView& view);
  /// Creates a renderer for any view, with its own lens and wall. The axis is drawn at its apparent position; the width
  /// is that at the middle of the image.
  /// @param scene settings
  /// @param view  view of the camera
  /// @throws ArgumentError naming the key, the value and what is allowed
  NeedleRenderer(const SceneConfig& scene, std::shared_ptr<const camera::View> view);

  /// Renders an image.
  /// @param path_mm  axis of the shaft in {A}, mm, from the entry point to the tip, at least two points; the shaft
  /// outside
  ///   continues straight backward from the first segment
  /// @param roll_rad roll of the bevel, rad: 0 with the bevel towards the camera, pi/2 seen from the side
  /// @return image; without a needle if there are fewer than two points, or one that the view cannot see
  NeedlePicture render(const std::vector<camera::Vector3>& path_mm, double roll_rad);

  /// Computes the roll of a bevel as this camera sees it, for an image that is not mirrored.
  /// @param tip_mm       tip in {A}, mm
  /// @param heading      unit vector of the shaft at the tip, in {A}
  /// @param pointed_side unit vector from the shaft's axis towards the foremost point of the bevel, in {A},
  /// perpendicular to
  ///   the heading
  /// @return roll for render(), rad
  double roll_seen_rad(const camera::Vector3& tip_mm, const camera::Vector3& heading,
                       const camera::Vector3& pointed_side) const;

  /// Sets the factor of the illumination.
  /// @param gain factor
  void set_gain(double gain) { scene_.gain = gain; }
  /// @return image without a needle and without noise
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
