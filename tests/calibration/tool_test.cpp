// SPDX-License-Identifier: MIT
// bevel-calibrate from picture files on: what it writes is what finds a tip in the gel, and what it refuses it names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include <bevel/analysis/calibrate/calibrate_tool.hpp>
#include <bevel/drivers/camera/calibrated_view.hpp>
#include <bevel/drivers/camera/decode.hpp>
#include <bevel/error.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include "tests/calibration/true_optics.hpp"
#include "tests/camera/exif.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;
using camera::BoardKind;
using camera::CalibratedView;
using ::testing::HasSubstr;

constexpr unsigned long long kSeed = 31;
const camera::BoardSpec kBoard{BoardKind::charuco, 8, 6, 9.0, 6.75};
const cv::Vec3d kEntry_W = test::kBox_mm + cv::Vec3d(0, -30, 0);
const cv::Matx33d kR_WA = test::turned(0.03, -0.02, 0.02) * cv::Matx33d(0, 1, 0, 0, 0, 1, 1, 0, 0);  // x ahead, z down

// Pictures of two cameras: 10 places in air, 8 immersed, a fiducial in the needle's plane; made once, they take
// seconds.
class Tool : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder();
    cameras_ = new std::vector<test::TrueCamera>(test::two_cameras());
    const camera::Board board(kBoard);
    std::vector<test::BoardPlace> places;
    const auto shots = test::shots_of(*cameras_, board, 10, 8, 0, kSeed, &places);
    const cv::Matx33d R_AB = camera::rotation_of_axes("+z", "-y");
    const test::BoardPlace fiducial{kR_WA * R_AB, kR_WA * cv::Vec3d(0, 25, 2) + kEntry_W};
    for (size_t c = 0; c < 2; ++c) {
      const fs::path air = path("air" + std::to_string(c)), wet = path("wet" + std::to_string(c));
      fs::create_directories(air), fs::create_directories(wet);
      for (size_t s = 0; s < shots.size(); ++s)
        cv::imwrite((shots[s].immersed ? wet : air) / shots[s].name,
                    test::photograph((*cameras_)[c], board, places[s], shots[s].immersed, kSeed + 100 * c + s));
      cv::imwrite(path("fiducial" + std::to_string(c) + ".png"),
                  test::photograph((*cameras_)[c], board, fiducial, true, kSeed + 900 + c));
    }
    cv::imwrite(fs::path(path("air0")) / "empty.png", cv::Mat(480, 640, CV_8UC1, cv::Scalar(130)));
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete cameras_;
  }
  static std::string path(const std::string& name) { return (fs::path(folder_->path()) / name).string(); }
  static CalibrateOptions options() {
    CalibrateOptions o;
    o.board = kBoard;
    o.air = {path("air0"), path("air1")};
    o.immersed = {path("wet0"), path("wet1")};
    o.out_folder = path("out");
    return o;
  }
  static cv::Point2d pixel(size_t c, const cv::Vec3d& p_A) {
    return (*cameras_)[c].pixel(kR_WA * p_A + kEntry_W, true);
  }
  // Largest distance of triangulated tips from the truth, cameras as the file has them.
  static double worst_tip_mm(const std::string& yaml) {
    const camera::Calibration calibration = camera::load_calibration(yaml);
    const CalibratedView views[2] = {CalibratedView(calibration.cameras[0].model),
                                     CalibratedView(calibration.cameras[1].model)};
    double worst = 0;
    for (const double x : {-8.0, 0.0, 8.0})
      for (const double y : {-8.0, 0.0, 8.0})
        for (const double z : {5.0, 30.0, 55.0}) {
          cv::Matx33d sum = cv::Matx33d::zeros();
          cv::Vec3d right;
          for (size_t c = 0; c < 2; ++c) {
            const cv::Matx33d W(views[c].information_per_mm2(pixel(c, {x, y, z}), cv::Matx22d::eye()).data());
            sum += W;
            right += W * cv::Vec3d(views[c].position_mm(pixel(c, {x, y, z})).data());
          }
          worst = std::max(worst, cv::norm(sum.inv() * right - cv::Vec3d(x, y, z)));
        }
    return worst;
  }
  static test::TemporaryFolder* folder_;
  static std::vector<test::TrueCamera>* cameras_;
  std::ostringstream out_, err_;
};
test::TemporaryFolder* Tool::folder_ = nullptr;
std::vector<test::TrueCamera>* Tool::cameras_ = nullptr;

TEST_F(Tool, PicturesAndAFiducialGiveCamerasThatFindTheTip) {
  CalibrateOptions o = options();
  o.fiducial = {path("fiducial0.png"), path("fiducial1.png")};
  o.fiducial_immersed = true;
  o.fiducial_y = "-y";
  o.fiducial_origin_mm = {0, 25, 2};
  EXPECT_EQ(run(o, out_, err_), 0);
  std::printf("seed %llu\n%s%s", kSeed, out_.str().c_str(), err_.str().c_str());
  EXPECT_THAT(err_.str(), HasSubstr("empty.png: no board of 8 x 6 squares found"));
  const double worst_mm = worst_tip_mm(path("out/cameras.yaml"));
  std::printf("largest error of a tip in the gel: %.3f mm\n", worst_mm);
  EXPECT_LT(worst_mm, 0.35);
  const auto figures = nlohmann::json::parse(std::ifstream(path("out/figures.json")));
  for (const auto& camera : figures["cameras"]) {
    EXPECT_LT(camera["held_out_rms_px"].get<double>(), 0.15);
    EXPECT_GT(camera["held_out_rms_px"].get<double>(), 0.01);
  }
  std::stringstream page;
  page << std::ifstream(path("out/report.html")).rdbuf();
  for (const char* words : {"empty.png", "no board of 8 x 6 squares found", "held out", "if refraction were ignored",
                            "calibration = ", "<svg", "wall: distance"})
    EXPECT_THAT(page.str(), HasSubstr(words));
}

TEST_F(Tool, TheLogOfAStraightInsertionGivesTheFrame) {
  ASSERT_EQ(run(options(), out_, err_), 0);
  const camera::Calibration provisional = camera::load_calibration(path("out/cameras.yaml"));
  EXPECT_EQ(provisional.frame, camera::FrameKind::none);
  // What bevel-camera would publish while the needle goes in at 2 mm/s, 20 Hz; noise of 0.1 px.
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise(0, 0.1);
  {
    io::LogWriter log(path("insertion.lcm"));
    std::int64_t seq = 0;
    for (std::int64_t i = 0; i <= 600; ++i) {
      const std::int64_t utime = 1'700'000'000'000'000 + i * 50'000;
      model::ActuatorState axes;
      axes.utime = utime;
      axes.seq = i;
      axes.axis_status = {2, 2};
      axes.insertion_mm = 0.1 * static_cast<double>(i);
      axes.insertion_rate_mm_s = 2;
      log.write_message(utime, io::channel::kActuatorState, io::to_message(axes));
      for (size_t c = 0; c < 2; ++c) {
        const CalibratedView view(provisional.cameras[c].model);
        const cv::Point2d px = pixel(c, {0, 0, axes.insertion_mm}) + cv::Point2d(noise(random), noise(random));
        model::TipMeasurement m;
        m.utime = utime;
        m.seq = seq++ / 2;
        m.camera = static_cast<std::int32_t>(c);
        const auto p = view.position_mm(px);
        const auto W = view.information_per_mm2(px, cv::Matx22d(0.01, 0, 0, 0.01));
        m.position_mm = Eigen::Map<const Eigen::Vector3d>(p.data());
        m.information_per_mm2 = Eigen::Map<const Eigen::Matrix3d>(W.data());
        log.write_message(utime, io::channel::kTipMeasurement, io::to_message(m));
      }
    }
    log.close();
  }
  CalibrateOptions o;
  o.calibration = path("out/cameras.yaml");
  o.insertion = path("insertion.lcm");
  o.out_folder = path("framed");
  const cv::Vec3d looks = kR_WA.t() * cv::Vec3d(0, 0, 1);
  o.roll_deg = -std::atan2(looks[1], looks[0]) * 180 / CV_PI;
  std::ostringstream out;
  EXPECT_EQ(run(o, out, err_), 0) << err_.str();
  const double worst_mm = worst_tip_mm(path("framed/cameras.yaml"));
  std::printf("%slargest error of a tip in the gel: %.3f mm\n", out.str().c_str(), worst_mm);
  EXPECT_LT(worst_mm, 0.35);
}

// Water in the pictures, gel in the file: the walls stay where they were found.
TEST_F(Tool, TheGelsIndexTakesTheWaters) {
  CalibrateOptions o = options();
  ASSERT_EQ(run(o, out_, err_), 0);
  const camera::Calibration water = camera::load_calibration(path("out/cameras.yaml"));
  o.gel_index = 1.345;
  o.out_folder = path("gel");
  ASSERT_EQ(run(o, out_, err_), 0);
  const camera::Calibration gel = camera::load_calibration(path("gel/cameras.yaml"));
  for (size_t c = 0; c < 2; ++c) {
    const auto &before = water.cameras[c].model.wall->parameters, &after = gel.cameras[c].model.wall->parameters;
    EXPECT_EQ(before[camera::kIndex], 1.333);
    EXPECT_EQ(after[camera::kIndex], 1.345);
    EXPECT_NEAR(after[camera::kDistance], before[camera::kDistance], 1e-9);
  }
}

TEST_F(Tool, AnUnreadablePictureIsToldByTheStatus) {
  CalibrateOptions o = options();
  o.air = {path("air0")};
  o.immersed.clear();
  std::ofstream(fs::path(path("air0")) / "broken.png") << "no picture";
  EXPECT_EQ(run(o, out_, err_), 3);
  EXPECT_THAT(err_.str(), HasSubstr("broken.png: not a readable picture"));
  fs::remove(fs::path(path("air0")) / "broken.png");
}

// Phones and some cameras tag their images with an orientation; the lens of the sensor does not turn with it.
TEST_F(Tool, OrientationTagsInThePicturesChangeNothing) {
  CalibrateOptions o = options();
  o.immersed.clear();
  std::vector<double> lenses[2];
  for (const int orientation : {0, 6}) {
    const std::string folder = path("phone" + std::to_string(orientation));
    fs::create_directories(folder);
    for (const auto& entry : fs::directory_iterator(path("air0"))) {
      const auto jpeg = test::jpeg_of(camera::read_gray(entry.path()).gray, orientation);
      std::ofstream(fs::path(folder) / (entry.path().stem().string() + ".jpg"), std::ios::binary)
          .write(reinterpret_cast<const char*>(jpeg.data()), static_cast<std::streamsize>(jpeg.size()));
    }
    o.air = {folder};
    o.out_folder = path("out-phone");
    std::ostringstream err;
    ASSERT_EQ(run(o, out_, err), 0);
    const std::string remark = "carries orientation tag 6; the image is not rotated";
    const auto first = err.str().find(remark);
    EXPECT_EQ(first != std::string::npos, orientation == 6) << err.str();
    if (orientation == 6) {
      EXPECT_EQ(err.str().find(remark, first + 1), std::string::npos) << "printed once per folder";
    }
    const auto lens = camera::load_calibration(path("out-phone/cameras.yaml")).cameras[0].model.lens;
    EXPECT_EQ(lens.picture_px, cv::Size(640, 480));
    lenses[orientation == 6].assign(lens.parameters.begin(), lens.parameters.end());
  }
  // OpenCV's corner search runs in threads: its sums differ in the last digits.
  for (size_t i = 0; i < lenses[0].size(); ++i) EXPECT_NEAR(lenses[0][i], lenses[1][i], 1e-3);
}

// A 12-bit sensor fills the low 12 of the 16 bits of a PNG.
TEST_F(Tool, TwelveBitPicturesAreScaled) {
  CalibrateOptions o = options();
  o.immersed.clear();
  const std::string folder = path("deep");
  fs::create_directories(folder);
  for (const auto& entry : fs::directory_iterator(path("air0"))) {
    cv::Mat deep;
    camera::read_gray(entry.path()).gray.convertTo(deep, CV_16U, 4095.0 / 255.0);
    cv::imwrite((fs::path(folder) / entry.path().filename()).string(), deep);
  }
  o.air = {folder};
  o.out_folder = path("out-deep");
  ASSERT_EQ(run(o, out_, err_), 0) << err_.str();
  EXPECT_THAT(err_.str(), HasSubstr("uses 12 of its 16 bits per sample; they are scaled to 8 bits"));
  EXPECT_NEAR(camera::load_calibration(path("out-deep/cameras.yaml")).cameras[0].model.lens.parameters[camera::kFx],
              900, 9);
}

// Sets of views from poor to good: "Good" implies that the lens is right, and a single orientation of the board is
// never good, however well it predicts further views of the same orientation.
TEST(CalibrationVerdict, GoodImpliesThatTheLensIsDetermined) {
  const camera::Board board(kBoard);
  const test::TrueCamera truth;
  int good = 0, others = 0;
  for (const double tilt : {0.0, 0.03, 0.1, 0.2, 0.45})
    for (unsigned seed = 1; seed <= 4; ++seed) {
      std::mt19937_64 random(seed);
      std::uniform_real_distribution<double> any(-1, 1);
      std::vector<camera::Shot> shots;
      for (int s = 0; s < 16; ++s) {
        const cv::Matx33d R = test::turned(0.25 + tilt * any(random), -0.2 + tilt * any(random), 0.5 * any(random));
        const cv::Vec3d middle(25 * any(random), 18 * any(random), 160 + 20 * any(random));
        const auto place = test::place_board(board, middle, R);
        shots.push_back({std::to_string(s), false, {test::see(truth, board, place, false, 0.1, random)}});
      }
      try {
        const camera::Calibrated got = camera::calibrate(board, test::input_of({truth}, shots));
        const CalibrationVerdict verdict = verdict_of(got);
        const double off = std::abs(got.calibration.cameras[0].model.lens.parameters[camera::kFx] / truth.fx - 1);
        std::printf("tilt %.2f, seed %u: %s, fx off by %.2f %%, lens to %.2f %%, orientations: %d\n", tilt, seed,
                    verdict.title.c_str(), 100 * off, 100 * lens_error(got, 0), got.tilts[0]);
        const bool is_good = verdict.title.starts_with("Good");
        if (is_good) {
          EXPECT_LT(off, 0.012) << "four standard errors of 0.3 %";
        }
        if (tilt == 0.0) {
          EXPECT_FALSE(is_good) << "one orientation";
        }
        if (tilt > 0.4) {
          EXPECT_TRUE(is_good) << verdict.reason;
        }
        ++(is_good ? good : others);
      } catch (const std::exception& error) {
        std::printf("tilt %.2f, seed %u: refused: %s\n", tilt, seed, error.what());
        EXPECT_LT(tilt, 0.2);
        ++others;
      }
    }
  EXPECT_GE(good, 4);
  EXPECT_GE(others, 4);
}

// One view 16 times, as an issue reported it.
TEST_F(Tool, OnePictureSixteenTimesIsRefused) {
  CalibrateOptions o = options();
  o.immersed.clear();
  o.air = {path("same")};
  o.out_folder = path("out-same");
  fs::create_directories(path("same"));
  fs::path first;
  for (const auto& entry : fs::directory_iterator(path("air0")))
    if (entry.path().filename() != "empty.png" && (first.empty() || entry.path() < first)) first = entry.path();
  for (int i = 0; i < 16; ++i) fs::copy_file(first, fs::path(path("same")) / ("view" + std::to_string(i) + ".png"));
  std::ostringstream out, err;
  try {
    run(o, out, err);
    ADD_FAILURE() << "accepted: " << out.str();
  } catch (const ArgumentError& error) {
    EXPECT_THAT(error.what(), HasSubstr("15 more repeat the view of another picture"));
  }
}

// A legacy board is recognised and reported; pictures of both kinds of board are refused.
TEST_F(Tool, ALegacyBoardIsRecognisedAndReported) {
  const camera::Board board(kBoard);
  std::vector<test::BoardPlace> places;
  const auto shots = test::shots_of({(*cameras_)[0]}, board, 10, 0, 0, kSeed, &places);
  CalibrateOptions o = options();
  o.immersed.clear();
  o.air = {path("legacy")};
  o.out_folder = path("out-legacy");
  fs::create_directories(path("legacy"));
  for (size_t s = 0; s < shots.size(); ++s)
    cv::imwrite((fs::path(path("legacy")) / shots[s].name).string(),
                test::photograph((*cameras_)[0], board, places[s], false, kSeed + s, camera::CharucoPattern::legacy));
  EXPECT_EQ(run(o, out_, err_), 0) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("legacy pattern (marker 0 in the first square"));
  EXPECT_NE(test::text_of(path("out-legacy/report.html")).find("legacy pattern"), std::string::npos);
  const auto& lens = camera::load_calibration(path("out-legacy/cameras.yaml")).cameras[0].model.lens.parameters;
  EXPECT_NEAR(lens[camera::kFx], 900, 9);
  EXPECT_NEAR(lens[camera::kCx], 325, 4);
  EXPECT_NEAR(lens[camera::kCy], 236, 4);
  cv::imwrite((fs::path(path("legacy")) / "zz.png").string(),
              test::photograph((*cameras_)[0], board, places[0], false, kSeed));
  try {
    run(o, out_, err_);
    ADD_FAILURE() << "accepted";
  } catch (const ArgumentError& error) {
    EXPECT_THAT(error.what(), HasSubstr("zz.png' shows a board with the current ChArUco pattern"));
    EXPECT_THAT(error.what(), HasSubstr("allowed: one board in all pictures"));
  }
}

// What was said before the refusal.
std::string expect_refused(const CalibrateOptions& o, const std::vector<std::string>& words) {
  std::ostringstream out, err;
  try {
    run(o, out, err);
    ADD_FAILURE() << words.front() << ": was accepted";
  } catch (const std::exception& error) {
    for (const std::string& word : words) EXPECT_THAT(error.what(), HasSubstr(word));
  }
  return err.str();
}

TEST_F(Tool, WhatIsWrongIsNamed) {
  const std::string mixed = path("mixed"), none = path("none"), few = path("few");
  for (const std::string& folder : {mixed, none, few}) fs::create_directories(folder);
  cv::imwrite(mixed + "/a.png", cv::Mat(480, 640, CV_8UC1, cv::Scalar(1)));
  cv::imwrite(mixed + "/b.png", cv::Mat(240, 320, CV_8UC1, cv::Scalar(1)));
  cv::imwrite(few + "/a.png", cv::Mat(480, 640, CV_8UC1, cv::Scalar(1)));
  CalibrateOptions o = options();
  o.immersed.clear();
  o.air = {mixed};
  expect_refused(o, {"b.png' is 320 x 240 px, allowed: 640 x 480 px"});
  o.air = {none};
  expect_refused(o, {"none' has no picture", "allowed"});
  o.air = {path("nowhere")};
  expect_refused(o, {"nowhere' is not a folder", "allowed"});
  o.air = {few};
  expect_refused(o, {"camera 0: pictures in air with a board are 0, allowed: 6 or more"});
  o.air = {path("air0"), path("air1"), path("air0")};
  expect_refused(o, {"--air has 3 folders, allowed: 1 or 2"});
  o.air = {path("air0"), path("air1") + "/../air0"};
  expect_refused(o, {"air0' is the same folder as one of --air", "allowed: different folders for all cameras"});
  o.air = {path("air0")};
  o.immersed = {path("air0") + "/"};
  expect_refused(o, {"--immersed", "is the same folder as one of --air"});
  o.immersed.clear();
  // Another board than the one in the pictures: its markers are known, but lie elsewhere on it.
  o.air = {path("air0"), path("air1")};
  o.board.columns = 9;
  EXPECT_THAT(expect_refused(o, {"camera 0: pictures in air with a board are 0, allowed: 6 or more"}),
              HasSubstr("no board of 9 x 6 squares found in it"));
  o = options();
  o.immersed = {path("wet0")};
  expect_refused(o, {"--immersed has 1 values, allowed: 2"});
  o = options();
  o.board.columns = 2;
  expect_refused(o, {"columns is 2", "allowed: 4 to 60"});
  o = options();
  o.gel_index = 0.5;
  expect_refused(o, {"--gel-index is 0.5", "allowed: 1 to 2.5"});
  o = options();
  o.print_board = path("board.jpg");
  expect_refused(o, {"'.jpg', allowed: .svg, .png"});
  o = CalibrateOptions{};
  o.calibration = path("nowhere.yaml");
  o.insertion = path("insertion.lcm");
  expect_refused(o, {"nowhere.yaml: not a file"});
}

TEST_F(Tool, ABoardToPrintIsFoundInItsOwnPicture) {
  CalibrateOptions o = options();
  o.print_board = path("board.png");
  EXPECT_EQ(run(o, out_, err_), 0);
  EXPECT_EQ(camera::Board(kBoard).find(camera::read_gray(o.print_board).gray).ids.size(), 35U);
  o.print_board = path("board.svg");
  EXPECT_EQ(run(o, out_, err_), 0);
  EXPECT_GT(fs::file_size(o.print_board), 5000U);
}

}  // namespace
}  // namespace bevel::analysis
