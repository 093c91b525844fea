// SPDX-License-Identifier: MIT
// A general camera behind the port of views: rays, their information, and two cameras' answer against the truth.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cstdio>
#include <random>

#include <bevel/drivers/camera/calibrated_view.hpp>
#include <bevel/drivers/camera/calibration/calibration_file.hpp>
#include <bevel/drivers/camera/pipeline.hpp>
#include <bevel/drivers/camera/planar_view.hpp>
#include <bevel/error.hpp>
#include <bevel/estimator/needle_filter.hpp>
#include "tests/calibration/true_optics.hpp"

namespace bevel::camera {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d to_eigen(const Matrix3& m) { return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.data()); }
Vector3d to_eigen(const Vector3& v) { return Eigen::Map<const Vector3d>(v.data()); }

// Two cameras before their walls, {A} in the gel: its z is the box's vertical, turned a little; entry 40 mm above the
// middle.
struct Rigged {
  std::vector<test::TrueCamera> cameras = test::two_cameras();
  Rigged() {
    // World from {A}: z of {A} along y of the world (down in the pictures).
    const cv::Matx33d R = test::turned(0.03, 0, 0.02) * cv::Matx33d(1, 0, 0, 0, 0, 1, 0, -1, 0);
    const cv::Vec3d t = test::kBox_mm + cv::Vec3d(0, -40, 0);
    for (auto& camera : cameras) {
      camera.t_mm += camera.R * t;
      camera.R = camera.R * R;
    }
  }
  CalibratedView view(size_t c) const { return CalibratedView(cameras[c].model(static_cast<int>(c))); }
};

TEST(CalibratedView, APixelIsAPointOnItsRayInTheNeedlePlane) {
  const Rigged rig;
  for (size_t c = 0; c < 2; ++c) {
    const CalibratedView view = rig.view(c);
    for (const cv::Vec3d& p : {cv::Vec3d(0, 0, 0), {4, -3, 30}, {-10, 8, 60}}) {
      const cv::Point2d px = rig.cameras[c].pixel(p, true);
      EXPECT_LT(cv::norm(view.pixel({p[0], p[1], p[2]}) - px), 1e-6);
      const Vector3 at = view.position_mm(px);
      EXPECT_NEAR(view.plane_normal()[0] * at[0] + view.plane_normal()[1] * at[1], 0.0, 1e-9)
          << "z of {A} lies in the plane";
      EXPECT_LT(cv::norm(view.pixel(at) - px), 1e-6) << "seen at the same pixel";
      // On the line through the truth, along what the information does not know.
      const Matrix3d W = to_eigen(view.information_per_mm2(px, cv::Matx22d(0.04, 0, 0, 0.04)));
      const Vector3d off = to_eigen(at) - Vector3d(p[0], p[1], p[2]);
      EXPECT_LT(off.dot(W * off), 1e-9);
    }
    const cv::Vec3d behind = rig.cameras[c].in_world({0, 0, -50});
    EXPECT_TRUE(std::isnan(view.pixel({behind[0], behind[1], behind[2]}).x));
  }
}

// The covariance that a pixel's noise has across the ray, drawn.
TEST(CalibratedView, InformationIsThatOfThePixelAndNothingAlongTheRay) {
  const Rigged rig;
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (size_t c = 0; c < 2; ++c) {
    const CalibratedView view = rig.view(c);
    const cv::Point2d px = view.pixel({3, -2, 45});
    const cv::Matx22d covariance(0.09, 0.03, 0.03, 0.05);
    const Matrix3d W = to_eigen(view.information_per_mm2(px, covariance));
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(W);
    EXPECT_LT(std::abs(eigen.eigenvalues()[0]), 1e-11 * eigen.eigenvalues()[2]) << "rank 2, as the filter asks: 1e-9";
    const auto ray = rig.cameras[c].model(0).ray(px);
    ASSERT_TRUE(ray);
    const Vector3d along(ray->direction.val);
    EXPECT_LT((W * along).norm(), 1e-9 * eigen.eigenvalues()[2]);
    Matrix3d scatter = Matrix3d::Zero();
    const double a = 0.3, b = 0.1, d = std::sqrt(0.05 - 0.01);  // Cholesky factor of the covariance
    constexpr int kDraws = 20000;
    for (int i = 0; i < kDraws; ++i) {
      const double u = normal(random), v = normal(random);
      Vector3d off =
          to_eigen(view.position_mm(px + cv::Point2d(a * u, b * u + d * v))) - to_eigen(view.position_mm(px));
      off -= off.dot(along) * along;
      scatter += off * off.transpose() / kDraws;
    }
    const Matrix3d& basis = eigen.eigenvectors();
    const Eigen::Matrix2d product = (basis.transpose() * W * basis).bottomRightCorner<2, 2>() *
                                    (basis.transpose() * scatter * basis).bottomRightCorner<2, 2>();
    EXPECT_LT((product - Eigen::Matrix2d::Identity()).norm(), 0.06) << product;
    EXPECT_NEAR(
        view.px_per_mm(),
        std::sqrt(std::sqrt(eigen.eigenvalues()[1] * eigen.eigenvalues()[2]) * std::sqrt(cv::determinant(covariance))),
        0.15 * view.px_per_mm());
  }
}

// A camera far away and square to an axis is a planar view.
TEST(CalibratedView, FromFarAwayItIsThePlanarView) {
  PlanarViewConfig planar;  // looks along -x: y to the right, z down
  planar.px_per_mm = 5;
  planar.origin_px = {320, 40};
  const PlanarView flat(planar);
  const double focal_px = 64000;  // the longest that is allowed
  CameraModel model;
  model.lens.picture_px = {640, 480};
  model.lens.parameters = {focal_px, focal_px, 320, 40};
  model.R_CA = {0, 1, 0, 0, 0, 1, 1, 0, 0};  // x_C = y_A, y_C = z_A, z_C = x_A
  model.p_CA_mm = {0, 0, focal_px / planar.px_per_mm};
  const CalibratedView view(model);
  const cv::Matx22d covariance(0.04, 0.01, 0.01, 0.09);
  for (const cv::Point2d px : {cv::Point2d(320, 40), cv::Point2d(250, 300)}) {
    EXPECT_LT((to_eigen(view.position_mm(px)) - to_eigen(flat.position_mm(px))).norm(), 1e-3);
    const Matrix3d a = to_eigen(view.information_per_mm2(px, covariance)),
                   b = to_eigen(flat.information_per_mm2(px, covariance));
    EXPECT_LT((a - b).norm(), 0.01 * b.norm());
    const cv::Vec2d along = cv::normalize(cv::Vec2d(0.3, 1));
    const SeenDirection s = view.direction(px, along, 0.01), t = flat.direction(px, along, 0.01);
    EXPECT_LT((to_eigen(s.direction) - to_eigen(t.direction)).norm(), 0.01);
    EXPECT_LT((to_eigen(s.information_per_rad2) - to_eigen(t.information_per_rad2)).norm(), 1.5);
  }
  EXPECT_NEAR(view.px_per_mm(), planar.px_per_mm, 1e-3);
}

// A straight needle through two points is seen as the pixels of both: its direction has no part along the normal that
// is measured, and an angle of the picture counts as the angle that it is.
TEST(CalibratedView, ADirectionConstrainsTheTangentByOneAngle) {
  const Rigged rig;
  for (size_t c = 0; c < 2; ++c) {
    const CalibratedView view = rig.view(c);
    const Vector3d tip(2, -3, 50), heading = Vector3d(0.15, -0.2, 1).normalized();
    const auto pixel = [&](const Vector3d& p) { return view.pixel({p.x(), p.y(), p.z()}); };
    const cv::Point2d behind = pixel(tip - 0.01 * heading), ahead = pixel(tip + 0.01 * heading);
    const cv::Vec2d along(ahead.x - behind.x, ahead.y - behind.y);
    const SeenDirection seen = view.direction(pixel(tip), along, 0.01);
    const Matrix3d W = to_eigen(seen.information_per_rad2);
    const Vector3d direction = to_eigen(seen.direction);
    EXPECT_NEAR(direction.norm(), 1, 1e-12);
    EXPECT_LT((W * direction).norm(), 1e-9 * W.trace());
    EXPECT_LT(heading.dot(W * heading), 1e-5 * W.trace()) << "the true heading is allowed";
    EXPECT_GT(direction.dot(heading), 0.9);
    // Turned by a small angle in the picture.
    const double turn = 1e-4;
    const cv::Vec2d other(along[0] - turn * along[1], along[1] + turn * along[0]);
    const Vector3d off = to_eigen(view.direction(pixel(tip), other, 0.01).direction) - direction;
    EXPECT_NEAR(std::sqrt(off.dot(W * off)) * 0.1 / turn, 1.0, 1e-3);
  }
}

TEST(CalibratedView, TwoCamerasTriangulateTheTipAndKnowHowWell) {
  const Rigged rig;
  const CalibratedView views[2] = {rig.view(0), rig.view(1)};
  std::mt19937_64 random(12);
  std::normal_distribution<double> noise(0, 0.2);
  std::uniform_real_distribution<double> any(-1, 1);
  double squares = 0, mm2 = 0, worst_mm = 0;
  constexpr int kTips = 2000;
  for (int i = 0; i < kTips; ++i) {
    const cv::Vec3d truth(6 * any(random), 6 * any(random), 40 + 40 * any(random));
    Matrix3d sum = Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    for (size_t c = 0; c < 2; ++c) {
      const cv::Point2d px = rig.cameras[c].pixel(truth, true) + cv::Point2d(noise(random), noise(random));
      const Matrix3d W = to_eigen(views[c].information_per_mm2(px, cv::Matx22d(0.04, 0, 0, 0.04)));
      sum += W;
      right += W * to_eigen(views[c].position_mm(px));
    }
    const Vector3d off = sum.ldlt().solve(right) - Vector3d(truth.val);
    squares += off.dot(sum * off) / 3;
    mm2 += off.squaredNorm();
    worst_mm = std::max(worst_mm, off.norm());
  }
  std::printf("seed 12, 0.2 px each way: RMS %.4f mm, largest %.3f mm, normalised squared error / 3: %.3f\n",
              std::sqrt(mm2 / kTips), worst_mm, squares / kTips);
  EXPECT_NEAR(squares / kTips, 1.0, 0.1);
  EXPECT_LT(std::sqrt(mm2 / kTips), 0.12);
}

// What the estimator does with it: the part along the ray means nothing, whatever number stands there.
TEST(CalibratedView, TheFilterTakesNothingAlongTheRay) {
  const Rigged rig;
  const CalibratedView view = rig.view(1);
  const cv::Point2d px = rig.cameras[1].pixel({0.3, -0.2, 0.1}, true);
  model::TipMeasurement m;
  m.utime = 1'000'000;
  m.camera = 1;
  m.position_mm = to_eigen(view.position_mm(px));
  m.information_per_mm2 = to_eigen(view.information_per_mm2(px, cv::Matx22d(0.04, 0, 0, 0.04)));
  estimator::EstimatorConfig config;
  const estimator::NeedleFilter filter(config);
  estimator::FilterState a = filter.initial(), b = a;
  const auto first = filter.update(a, m);
  EXPECT_EQ(first.rank, 2);
  EXPECT_TRUE(first.accepted);
  const auto ray = rig.cameras[1].model(1).ray(px);
  m.position_mm += 7.0 * Vector3d(ray->direction.val);
  filter.update(b, m);
  EXPECT_LT((a.pose.p_mm - b.pose.p_mm).norm(), 1e-6);
}

TEST(CalibratedView, ACameraThatLooksAlongTheNeedleIsRefused) {
  CameraModel model;
  model.lens.picture_px = {640, 480};
  model.lens.parameters = {900, 900, 320, 240};
  model.p_CA_mm = {0, 0, 200};
  try {
    const CalibratedView view(model);
    ADD_FAILURE() << "accepted";
  } catch (const ArgumentError& error) {
    EXPECT_NE(std::string(error.what()).find("allowed: 20"), std::string::npos) << error.what();
  }
}

// Frames of another size end the run with a message, and are never tracked.
TEST(CalibratedView, APictureOfAnotherSizeIsRefused) {
  class OneFrame : public FrameSource {
    FrameResult next(std::chrono::milliseconds) override {
      Frame frame;
      frame.camera = 0;
      frame.capture_utime = 1;
      frame.gray = cv::Mat(240, 320, CV_8UC1, cv::Scalar(200));
      return frame;
    }
  };
  const Rigged rig;
  CameraPipeline pipeline(std::make_unique<OneFrame>(), {{0, std::make_shared<CalibratedView>(rig.view(0)), {}, {}}});
  const auto got = pipeline.next(std::chrono::milliseconds(0));
  const auto* failure = std::get_if<SourceFailure>(&got);
  ASSERT_NE(failure, nullptr);
  EXPECT_NE(failure->text.find("320 x 240 px, allowed: 640 x 480 px"), std::string::npos) << failure->text;
  EXPECT_EQ(pipeline.counters().frames, 0);
}

}  // namespace
}  // namespace bevel::camera
