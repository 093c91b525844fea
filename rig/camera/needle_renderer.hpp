#pragma once
// A picture of a needle whose tip is known: what the trackers of drivers/camera are measured against. The silhouette is
// that of a cylinder cut by a plane (the bevel), supersampled; then bubbles, glare, blur, gain and noise in the order
// in which light meets them. Not here: refraction, lens distortion, rolling shutter.
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "drivers/camera/planar_view.hpp"

namespace bevel::rig {

struct Spot {
  cv::Point2d centre_px;
  double radius_px = 5.0;
  double strength_gray = 60.0;  ///< glare: added light at the middle; bubble: darkness of the rim
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
  uint64_t seed = 1;  ///< of the noise
};

struct NeedlePicture {
  cv::Mat gray;
  cv::Point2d tip_px;      ///< on the shaft's axis, at the depth of the foremost point of the bevel
  cv::Vec2d direction_px;  ///< unit vector of the shaft at the tip
};

class NeedleRenderer {
 public:
  /// Throws std::invalid_argument naming the key, the value and what is allowed.
  NeedleRenderer(const SceneConfig& scene, const camera::PlanarView& view);

  /// `path_mm`: axis of the shaft in {A} from the entry point to the tip, at least two points; the shaft outside
  /// continues straight backward from the first segment. `roll_rad`: 0 the bevel faces the camera, pi/2 it is seen from
  /// the side. Fewer than two points: a picture without a needle (tip_px is then NaN).
  NeedlePicture render(const std::vector<camera::Vector3>& path_mm, double roll_rad);

  void set_gain(double gain) { scene_.gain = gain; }
  const cv::Mat& background() const { return background_; }

 private:
  void add_needle(cv::Mat& light, const std::vector<cv::Point2d>& axis_px, double roll_rad) const;

  SceneConfig scene_;
  camera::PlanarView view_;
  cv::Mat background_;  // CV_32F
  cv::Mat noise_;
  cv::RNG random_;
};

}  // namespace bevel::rig
