// SPDX-License-Identifier: MIT
#pragma once
// The cameras' noise: coloured, with heavy tails, wild values, lost and late frames.
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "proof/random.hpp"

namespace bevel::proof {

inline constexpr double kFramePeriod_s = 1.0 / 30.0;

struct CameraNoise {
  double sigma_mm = 0.15;      // x and y; z has 1.3 times as much
  double ar1 = 0.0;            // correlation of neighbouring frames
  double ar2 = 0.0;            // second coefficient, 0 for AR(1): n_i = a1 n_(i-1) + ar2 n_(i-2) + e
  int tail_degrees = 0;        // Student's t; 0 normal
  double outlier_share = 0.0;  // <= 0.02
  double dropout_share = 0.0;
  double late_share = 0.0;   // arrives 30-150 ms after its due time; its stamp is right
  double claim_ratio = 1.0;  // sigma that the messages claim, over the true one

  Eigen::Vector3d sigmas_mm() const { return sigma_mm * Eigen::Vector3d(1, 1, 1.3); }
  // Correlation of frames `lag` apart.
  std::vector<double> correlations(std::size_t count) const;
};

CameraNoise draw_camera_noise(Random& random);

struct Frames {
  std::vector<double> times_s;        // of capture
  std::vector<double> arrivals_s;     // in the computer
  std::vector<Eigen::Index> numbers;  // of the camera's own clock: gaps are lost frames
  Eigen::Matrix3Xd noise_mm;
  std::size_t size() const { return times_s.size(); }
};
Frames draw_frames(const CameraNoise& noise, double duration_s, Random& random);

// Turns differences of paths into standard deviations of the noise: W' W = inverse covariance over all its frames.
class Whitener {
 public:
  Whitener(const CameraNoise& noise, const Frames& frames);
  Eigen::VectorXd operator()(const Eigen::Matrix3Xd& difference_mm) const;  // 3 n values

 private:
  Eigen::LLT<Eigen::MatrixXd> correlation_;
  Eigen::Vector3d sigmas_mm_;
};

}  // namespace bevel::proof
