// SPDX-License-Identifier: MIT
// [[camera]] calibration = "...": what the processes take of a calibration, and what they refuse.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bevel/drivers/camera/calibration/calibration_file.hpp>
#include <bevel/error.hpp>
#include <bevel/io/config.hpp>
#include <bevel/nodes/system_config.hpp>
#include "tests/calibration/true_optics.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::nodes {
namespace {

using ::testing::HasSubstr;

constexpr const char* kNeedle =
    "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n";

class SystemFile : public testing::Test {
 protected:
  void SetUp() override {
    camera::Calibration c;
    c.made_utc = "2026-07-14T09:30:00Z";
    auto cameras = test::two_cameras();
    for (int n : {0, 1}) {
      camera::CalibratedCamera one;
      one.model = cameras[static_cast<size_t>(n)].model(n);
      c.cameras.push_back(one);
    }
    camera::move_frame({0, 1, 0, 0, 0, 1, 1, 0, 0}, test::kBox_mm, c);
    folder_.write("provisional.yaml", to_yaml(c));
    c.frame = camera::FrameKind::fiducial;
    yaml_ = to_yaml(c);
    folder_.write("cameras.yaml", yaml_);
  }
  SystemConfig load(const std::string& cameras) {
    return load_system_config(folder_.write("rig.toml", std::string(kNeedle) + cameras));
  }
  void expect_refused(const std::string& cameras, const std::vector<std::string>& words) {
    try {
      load(cameras);
      ADD_FAILURE() << words.front() << ": was accepted";
    } catch (const io::ConfigError& error) {
      for (const std::string& word : words) EXPECT_THAT(error.what(), HasSubstr(word));
    }
  }
  test::TemporaryFolder folder_;
  std::string yaml_;
};

TEST_F(SystemFile, CamerasComeFromTheYamlBesideIt) {
  const SystemConfig config = load(
      "[[camera]]\ncamera = 0\ncalibration = \"cameras.yaml\"\n[[camera]]\ncamera = 1\ncalibration = "
      "\"cameras.yaml\"\nwidth_px = 640\n"
      "[[camera]]\ncamera = 2\npx_per_mm = 5.0\norigin_px = [1, 2]\ncolumns_carry = \"+y\"\nrows_carry = \"+z\"\n");
  ASSERT_EQ(config.cameras.size(), 3U);
  ASSERT_TRUE(config.cameras[1].calibrated);
  EXPECT_EQ(config.cameras[1].calibrated->number, 1);
  EXPECT_NEAR(config.cameras[1].calibrated->lens.parameters[camera::kFx], 870, 1e-9);
  EXPECT_TRUE(config.cameras[1].calibrated->wall);
  EXPECT_EQ(config.cameras[0].width_px, 640);
  EXPECT_EQ(config.cameras[0].height_px, 480);
  EXPECT_FALSE(config.cameras[2].calibrated) << "a planar view beside them";
}

TEST_F(SystemFile, WhatDoesNotFitIsRefusedByName) {
  const std::string good = "[[camera]]\ncamera = 0\ncalibration = \"cameras.yaml\"\n";
  load(good);
  expect_refused(good + "width_px = 1280\n", {"camera[0].width_px", "is 1280, allowed: 640"});
  expect_refused(good + "px_per_mm = 4.0\n", {"camera[0].px_per_mm", "one or the other"});
  expect_refused("[[camera]]\ncamera = 3\ncalibration = \"cameras.yaml\"\n", {"camera 3 is not in it, allowed: 0, 1"});
  expect_refused("[[camera]]\ncamera = 0\ncalibration = \"missing.yaml\"\n",
                 {"camera[0].calibration", "missing.yaml: not a file"});
  expect_refused("[[camera]]\ncamera = 0\ncalibration = \"provisional.yaml\"\n",
                 {"frame is none", "provisional_frame"});
  EXPECT_NO_THROW(load("[[camera]]\ncamera = 0\ncalibration = \"provisional.yaml\"\nprovisional_frame = true\n"));
  expect_refused("[[camera]]\ncamera = 0\n", {"px_per_mm is missing"});
  expect_refused(good + "[source]\nkind = \"device\"\npath = \"/dev/video0\"\nwidth_px = 1280\nheight_px = 960\n",
                 {"source.width_px", "1280 x 960, allowed: 640 x 480"});
  folder_.write("cameras.yaml", yaml_.substr(0, yaml_.size() / 2));
  expect_refused(good, {"cameras.yaml", "cut", "allowed"});
  std::string stale = yaml_;
  stale.replace(stale.find("schema_version: 1"), 17, "schema_version: 0");
  folder_.write("cameras.yaml", stale);
  expect_refused(good, {"schema_version is 0, allowed: 1"});
}

}  // namespace
}  // namespace bevel::nodes
