// SPDX-License-Identifier: MIT
// The YAML: read back as written, by OpenCV too; what is damaged, stale or impossible is refused by name.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <opencv2/core/persistence.hpp>
#include <random>

#include <bevel/drivers/camera/calibration/calibration_file.hpp>
#include "tests/calibration/true_optics.hpp"

namespace bevel::camera {
namespace {

Calibration example() {
  Calibration c;
  c.made_utc = "2026-07-14T09:30:00Z";
  c.frame = FrameKind::fiducial;
  const auto cameras = test::two_cameras();
  for (int n : {0, 3}) {
    CalibratedCamera camera;
    camera.model = cameras[n == 0 ? 0 : 1].model(n);
    camera.fit = {24, 1680, 0.14, 0.15, {1.5, 1.5, 1.2, 1.1, 0.01, 0.1, 4e-4, 4e-4, 0}, {1e-3, 1e-3, 0.2, 0}};
    c.cameras.push_back(camera);
  }
  c.cameras[1].model.wall.reset();
  return c;
}

std::string body_of(const std::string& yaml) { return yaml.substr(0, yaml.rfind("checksum:")); }

void expect_refused(const std::string& text, const std::vector<std::string>& words) {
  try {
    from_yaml(text, "rig.yaml");
    ADD_FAILURE() << words.front() << ": was accepted";
  } catch (const CalibrationError& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.rfind("rig.yaml", 0), 0U) << what;
    for (const std::string& word : words)
      EXPECT_NE(what.find(word), std::string::npos) << word << " is not in: " << what;
  }
}

TEST(CalibrationFile, ReadsBackWhatWasWritten) {
  const Calibration before = example();
  const Calibration after = from_yaml(to_yaml(before), "rig.yaml");
  EXPECT_EQ(after.made_utc, before.made_utc);
  EXPECT_EQ(after.frame, FrameKind::fiducial);
  ASSERT_EQ(after.cameras.size(), 2U);
  EXPECT_EQ(after.cameras[1].model.number, 3);
  EXPECT_EQ(after.cameras[0].model.lens.picture_px, cv::Size(640, 480));
  for (size_t i = 0; i < kLensParameters; ++i)
    EXPECT_NEAR(after.cameras[0].model.lens.parameters.at(i), before.cameras[0].model.lens.parameters.at(i), 1e-12);
  EXPECT_LT(cv::norm(after.cameras[1].model.R_CA, before.cameras[1].model.R_CA), 1e-12);
  EXPECT_LT(cv::norm(after.cameras[1].model.p_CA_mm - before.cameras[1].model.p_CA_mm), 1e-9);
  ASSERT_TRUE(after.cameras[0].model.wall);
  EXPECT_FALSE(after.cameras[1].model.wall);
  for (size_t i = 0; i < kWallParameters; ++i)
    EXPECT_NEAR(after.cameras[0].model.wall->parameters.at(i), before.cameras[0].model.wall->parameters.at(i), 1e-12);
  EXPECT_EQ(after.cameras[0].fit.corners, 1680);
  EXPECT_EQ(after.cameras[0].fit.lens_sd[kFx], 1.5);
}

TEST(CalibrationFile, OpenCvReadsItByItsOwnNames) {
  const auto path = std::filesystem::path(testing::TempDir()) / "calibration_opencv.yaml";
  save_calibration(example(), path.string());
  const cv::FileStorage in(path.string(), cv::FileStorage::READ);
  ASSERT_TRUE(in.isOpened());
  const cv::FileNode camera = in["cameras"][0];
  cv::Mat K, distortion;
  camera["camera_matrix"] >> K;
  camera["distortion_coefficients"] >> distortion;
  EXPECT_EQ(static_cast<int>(camera["image_width"]), 640);
  EXPECT_EQ(K.at<double>(0, 0), 900);
  EXPECT_EQ(distortion.at<double>(0), -0.12);
  EXPECT_EQ(load_calibration(path.string()).cameras.size(), 2U);
  std::filesystem::remove(path);
}

// Cut anywhere, even where what is left is good YAML with a shorter number in it.
TEST(CalibrationFile, ATruncatedFileIsRefusedWhereverItIsCut) {
  const std::string whole = to_yaml(example());
  for (size_t n = 0; n + 1 < whole.size(); n += 7)
    EXPECT_THROW(from_yaml(whole.substr(0, n), "rig.yaml"), CalibrationError) << n;
  expect_refused(whole.substr(0, whole.size() / 2), {"cut", "bytes", "allowed"});
  EXPECT_THROW(from_yaml(whole.substr(0, whole.size() - 2), "rig.yaml"), CalibrationError);
}

TEST(CalibrationFile, AChangedNumberIsRefused) {
  std::string text = to_yaml(example());
  const auto at = text.find("905.");
  ASSERT_NE(at, std::string::npos);
  text[at + 2] = '6';
  expect_refused(text, {"checksum", "changed by hand", "allowed"});
}

TEST(CalibrationFile, StaleForeignAndImpossibleFilesNameTheThing) {
  const std::string good = body_of(to_yaml(example()));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    return with_checksum(text);
  };
  const auto without_line = [&](const std::string& key) {
    std::string text = good;
    const auto at = text.find(key);
    EXPECT_NE(at, std::string::npos) << key;
    const auto from = text.rfind('\n', at) + 1;
    text.erase(from, text.find('\n', at) + 1 - from);
    return with_checksum(text);
  };
  expect_refused(with("schema_version: 1", "schema_version: 2"), {"schema_version is 2", "allowed: 1", "anew"});
  expect_refused(without_line("schema_version"), {"schema_version is missing"});
  expect_refused("camera_matrix: 1\n", {"schema is missing", "allowed: bevel-calibration"});
  expect_refused("", {"schema is missing"});
  expect_refused(without_line("image_width"), {"cameras[0].image_width is missing"});
  expect_refused(without_line("made_utc"), {"made_utc is missing"});
  expect_refused(without_line("   index:"), {"cameras[0].wall.index is missing"});
  expect_refused(with("camera_matrix:", "camera_matrix_:"), {"cameras[0].camera_matrix is missing"});
  expect_refused(with("frame: fiducial", "frame: somewhere"),
                 {"frame is 'somewhere'", "allowed: none, fiducial, insertion"});
  expect_refused(with("image_width: 640", "image_width: 0"), {"image_width is 0", "allowed: 16 to 8192"});
  expect_refused(with("image_width: 640", "image_width: wide"), {"cameras[0].image_width is not a whole number"});
  expect_refused(with("905.", ".nan, 905."), {"camera_matrix"});
  expect_refused(with("905., ", ".Nan, "), {"camera_matrix", "nan", "finite"});
  expect_refused(with("-1.2000000000000000e-01", ".Inf"), {"distortion_coefficients", "inf", "finite"});
  expect_refused(with("index: 1.3330000000000000e+00", "index: 0.7"), {"wall index is 0.7", "allowed: 1 to 2.5"});
  expect_refused(with("camera: 3", "camera: 0"), {"number 0 twice"});
  expect_refused(with("cols: 5", "cols: 4"), {"rig.yaml"});
  expect_refused(with("%YAML:1.0", "{]"), {"rig.yaml"});
}

// Whatever stands before a checksum that is right: an answer or a CalibrationError, never anything else.
TEST(CalibrationFile, NoTextBreaksTheReader) {
  constexpr unsigned kSeed = 2024;
  std::mt19937 random(kSeed);
  const auto any = [&](size_t below) { return std::uniform_int_distribution<size_t>(0, below - 1)(random); };
  const std::string good = body_of(to_yaml(example()));
  const std::string bytes = "{}[]:-,\"' \n\t.0e!%#&*|>~\x80\xff";
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text = good;
    for (size_t changes = 1 + any(3); changes > 0; --changes) {
      const size_t at = any(text.size()), how = any(3);
      if (how == 0) text[at] = bytes[any(bytes.size())];
      if (how == 1) text.erase(at, 1 + any(40));
      if (how == 2) text.insert(at, 1 + any(3), bytes[any(bytes.size())]);
    }
    try {
      from_yaml(with_checksum(text), "rig.yaml");
    } catch (const CalibrationError&) {
      ++refused;
    }
  }
  std::printf("seed %u: %d of 3000 refused\n", kSeed, refused);
  EXPECT_GT(refused, 1000);
}

TEST(CalibrationFile, NoFileAndNoCameraAreNamed) {
  try {
    load_calibration("/nowhere/rig.yaml");
    ADD_FAILURE();
  } catch (const CalibrationError& error) {
    EXPECT_STREQ(error.what(), "/nowhere/rig.yaml: not a file");
  }
  try {
    camera_of(example(), 7, "rig.yaml");
    ADD_FAILURE();
  } catch (const CalibrationError& error) {
    EXPECT_STREQ(error.what(), "rig.yaml: camera 7 is not in it, allowed: 0, 3");
  }
}

}  // namespace
}  // namespace bevel::camera
