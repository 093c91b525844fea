// SPDX-License-Identifier: MIT
// Recordings of trackers: another frame, another zero of the depth, held values, lags and gaps of the base.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <random>

#include <bevel/error.hpp>
#include <bevel/io/csv_import.hpp>
#include <bevel/io/held_values.hpp>
#include <bevel/io/motion_gap.hpp>
#include <bevel/io/recording.hpp>
#include "tests/support/run_program.hpp"
#include "tests/support/shared_recordings.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kCurvature_per_mm = 0.0125;  // radius 80 mm
constexpr double kSigma_mm = 0.05;

// Point and heading of a needle that enters along z and bends toward -y.
Eigen::Vector3d arc_mm(double s_mm) {
  const double angle = kCurvature_per_mm * s_mm;
  return {0, -(1 - std::cos(angle)) / kCurvature_per_mm, std::sin(angle) / kCurvature_per_mm};
}
Eigen::Vector3d arc_heading(double s_mm) {
  const double angle = kCurvature_per_mm * s_mm;
  return {0, -std::sin(angle), std::cos(angle)};
}

// A hand that pushes at 1 to 5 mm/s.
double pushed_mm(double t_s) { return 3 * t_s + 2 * (1 - std::cos(t_s)); }

// A recording in the frame of a tracker: p = rotation p_A + translation.
struct Tracker {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
  double length_s = 20, interval_s = 0.1, noise_mm = 0;
  int outlier_every = 0;                               // rows; 0: none
  std::function<double(double)> depth_mm = pushed_mm;  // of the needle
  std::function<double(double)> base_mm = pushed_mm;   // as the base's column has it
  std::function<double(double)> roll_rad = [](double) { return 0.0; };
};

class TrackerMap : public ::testing::Test {
 protected:
  std::string csv(const Tracker& tracker, const std::string& name = "own.csv") const {
    std::mt19937 random(7);
    std::normal_distribution<double> normal(0, 1);
    std::string text = "t,depth,roll,x,y,z,hx,hy,hz\n";
    for (int i = 0; i * tracker.interval_s < tracker.length_s; ++i) {
      const double t_s = i * tracker.interval_s, s_mm = tracker.depth_mm(t_s);
      Eigen::Vector3d noise_mm = tracker.noise_mm * Eigen::Vector3d(normal(random), normal(random), normal(random));
      // A reflection, taken for the tip: too near to be implausible by itself.
      if (tracker.outlier_every > 0 && i % tracker.outlier_every == tracker.outlier_every / 2)
        noise_mm += Eigen::Vector3d(4, -6, i % 2 == 0 ? 8 : -5);
      const Eigen::Vector3d at_mm = tracker.rotation * arc_mm(s_mm) + tracker.translation_mm + noise_mm;
      const Eigen::Vector3d along = tracker.rotation * arc_heading(s_mm);
      for (const double value :
           {t_s, tracker.base_mm(t_s), tracker.roll_rad(t_s), at_mm.x(), at_mm.y(), at_mm.z(), along.x(), along.y()})
        text += format_number(value) + ",";
      text += format_number(along.z()) + "\n";
    }
    return folder.write(name, text);
  }
  std::string map_text(const std::string& tip, const std::string& more = "", const std::string& insertion = "") const {
    return "[time]\nseconds = \"t\"\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\nsigma_mm = [0.05, 0.05, "
           "0.05]\n"
           "heading = [\"hx\", \"hy\", \"hz\"]\nheading_sd_rad = 0.003\n" +
           tip + "[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\n" + insertion +
           "[rotation]\ncolumn = \"roll\"\nunit = \"rad\"\n" + more;
  }
  ColumnMap map(const std::string& tip, const std::string& more = "", const std::string& insertion = "") const {
    return load_column_map(folder.write("map.toml", map_text(tip, more, insertion)));
  }
  std::string refusal(const std::string& tip, const Tracker& tracker = {}) const {
    try {
      import_csv(csv(tracker), map(tip));
    } catch (const std::exception& e) {
      return e.what();
    }
    return "accepted";
  }

  test::TemporaryFolder folder;
};

std::string row_by_row(const Eigen::Matrix3d& m) {
  std::string text = "[";
  for (Eigen::Index i = 0; i < 9; ++i) text += (i > 0 ? ", " : "") + format_number(m(i / 3, i % 3));
  return text + "]";
}

TEST_F(TrackerMap, ATransformTurnsAndMovesTipsAndHeadings) {
  const Tracker tracker{
      .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized())),
      .translation_mm = {-128, 198, -146}};
  const Eigen::Quaterniond to_A = tracker.rotation.conjugate();
  const Eigen::Vector3d t_mm = -(to_A * tracker.translation_mm);
  const std::string translation = "translation_mm = [" + format_number(t_mm.x()) + ", " + format_number(t_mm.y()) +
                                  ", " + format_number(t_mm.z()) + "]\n";
  const std::string quaternion = "quaternion = [" + format_number(to_A.w()) + ", " + format_number(to_A.x()) + ", " +
                                 format_number(to_A.y()) + ", " + format_number(to_A.z()) + "]\n";
  for (const std::string& rotation : {"rotation = " + row_by_row(to_A.toRotationMatrix()) + "\n", quaternion}) {
    const ImportedRecording r = import_csv(csv(tracker), map("[tip.transform]\n" + rotation + translation));
    ASSERT_EQ(r.tips.size(), 200U);
    for (std::size_t i = 0; i < r.tips.size(); ++i) {
      const double s_mm = pushed_mm(0.1 * static_cast<double>(i));
      EXPECT_LT((r.tips[i].position_mm - arc_mm(s_mm)).norm(), 1e-9);
      EXPECT_LT((r.headings[i].heading - arc_heading(s_mm)).norm(), 1e-12);
      EXPECT_LT((r.headings[i].information_per_rad2 * r.headings[i].heading).norm(), 1e-6) << "none along the heading";
    }
  }
}

TEST_F(TrackerMap, ATransformThatIsNoRotationIsRefused) {
  EXPECT_THAT(refusal("[tip.transform]\nrotation = [1, 0, 0, 0, 1, 0, 0, 0, -1]\n"), HasSubstr("is a reflection"));
  EXPECT_THAT(refusal("[tip.transform]\nrotation = [1, 0, 0, 0, 1, 0, 0.1, 0, 1]\n"), HasSubstr("is no rotation"));
  EXPECT_THAT(refusal("[tip.transform]\nquaternion = [1, 0.2, 0, 0]\n"), HasSubstr("has the length 1.0198"));
  EXPECT_THAT(refusal("[tip.transform]\nquaternion = [1, 0, 0, 0]\nrotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"),
              HasSubstr("allowed: one of them"));
  EXPECT_THAT(refusal("frame = \"from-straight-insertion\"\n[tip.transform]\nquaternion = [1, 0, 0, 0]\n"),
              HasSubstr("tip.frame"));
  const std::string flat = folder.write("flat.toml",
                                        "[time]\nseconds = \"t\"\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\n"
                                        "sigma_mm = [0, 0.1, 0.1]\nframe = \"from-straight-insertion\"\n"
                                        "[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\n");
  EXPECT_THROW(load_column_map(flat), ConfigError);
}

TEST_F(TrackerMap, TheEntryDirectionIsFoundFromAStraightInsertion) {
  const std::string straight = "frame = \"from-straight-insertion\"\n";
  for (const double angle_rad : {0.0, 0.3, 1.2}) {
    const Tracker tracker{
        .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(1, 0.5, 0).normalized())),
        .translation_mm = {12, -3, 40},
        .noise_mm = kSigma_mm,
        .outlier_every = 41};
    const ImportedRecording r = import_csv(csv(tracker), map(straight));
    ASSERT_TRUE(r.frame.has_value());
    const Eigen::Vector3d z = r.frame->to_A.conjugate() * Eigen::Vector3d::UnitZ();
    const double error_rad = std::acos(std::min(1.0, z.dot(tracker.rotation * Eigen::Vector3d::UnitZ())));
    EXPECT_LT(error_rad, 4 * r.frame->direction_sd_rad);
    EXPECT_LT(r.frame->direction_sd_rad, 0.003);
    EXPECT_LT((r.frame->origin_mm - tracker.translation_mm).norm(), 4 * r.frame->origin_sd_mm);
    EXPECT_LT(r.frame->origin_sd_mm, 0.1);
    EXPECT_NEAR(r.frame->radius_mm, 80, 1);
    EXPECT_NEAR(r.frame->scale, 1, 0.01);
    // The rotation is the smallest one, about an axis without a part along z: here it takes the tracker's frame to {A}.
    EXPECT_EQ(r.frame->tips, 195U) << "without the outliers";
    for (std::size_t i = 0; i < r.tips.size(); ++i) {
      const double s_mm = pushed_mm(0.1 * static_cast<double>(i));
      if (i % 41 == 20) continue;  // an outlier
      EXPECT_LT((r.tips[i].position_mm - arc_mm(s_mm)).norm(), 5 * kSigma_mm + 0.1);
      EXPECT_LT((r.headings[i].heading - arc_heading(s_mm)).norm(), 0.01);
    }
    EXPECT_THAT(summary(r), AllOf(HasSubstr("z of {A} is ("), HasSubstr("roll about z")));
  }
}

TEST_F(TrackerMap, ATurningNeedleAndAnOutwardAxisDetermineNoEntryDirection) {
  const std::string straight = "frame = \"from-straight-insertion\"\n";
  const Tracker turning{.roll_rad = [](double t_s) { return 0.1 * t_s; }};
  EXPECT_THAT(refusal(straight, turning), AllOf(HasSubstr("own.csv: frame is"), HasSubstr("[tip.transform]")));
  const Tracker turned_later{.noise_mm = kSigma_mm, .roll_rad = [](double t_s) { return std::max(0.0, t_s - 15); }};
  EXPECT_EQ(refusal(straight, turned_later), "accepted");
  const Tracker outward{.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitX()))};
  EXPECT_THAT(refusal(straight, outward), HasSubstr("so that z leads into the tissue"));
}

TEST_F(TrackerMap, AnOffsetIsAddedToTheInsertion) {
  const Tracker tracker{.base_mm = [](double t_s) { return pushed_mm(t_s) + 31.5; }};
  const ImportedRecording r = import_csv(csv(tracker), map("", "", "offset_mm = -31.5\n"));
  for (std::size_t i = 0; i < r.actuators.size(); ++i)
    EXPECT_NEAR(r.actuators[i].insertion_mm, pushed_mm(0.1 * static_cast<double>(i)), 1e-9);
  EXPECT_THAT(summary(r), Not(HasSubstr("begins at")));
}

// Value at the last update.
std::function<double(double)> held(double period_s, double since_s = 0.3) {
  return [=](double t_s) { return pushed_mm(since_s + period_s * std::floor((t_s - since_s) / period_s + 1e-9)); };
}

double depth_at(const ImportedRecording& r, std::int64_t utime) {
  const auto after = std::ranges::lower_bound(r.actuators, utime, {}, &model::ActuatorState::utime);
  if (after->utime == utime) return after->insertion_mm;
  const auto before = std::prev(after);
  const double share = static_cast<double>(utime - before->utime) / static_cast<double>(after->utime - before->utime);
  return before->insertion_mm + share * (after->insertion_mm - before->insertion_mm);
}

TEST_F(TrackerMap, AHeldBaseIsInterpolatedBetweenItsUpdates) {
  for (const double period_s : {0.2, 0.5, 0.8}) {
    const std::string path = csv({.noise_mm = kSigma_mm, .base_mm = held(period_s)});
    const ColumnMap turning = map("");
    ColumnMap columns = turning;
    columns.rotation.clear();
    const ImportedRecording r = import_csv(path, columns);
    const auto time_s = [](const ImportedRecording& of, std::int64_t utime) {
      return static_cast<double>(utime) * 1e-6 - of.time_shift_s;
    };
    const double first_s = std::fmod(0.3, period_s);
    EXPECT_EQ(r.actuators.size(), static_cast<std::size_t>(std::round((19.9 - first_s) / period_s - 0.5 + 1e-6)) + 1);
    for (const model::ActuatorState& a : r.actuators)
      EXPECT_NEAR(a.insertion_mm, pushed_mm(time_s(r, a.utime)), 1e-6) << period_s;
    // Linear interpolation: acceleration 2 mm/s^2 times period squared / 8. A held value is off by 5 mm/s times period.
    const double error_mm = 0.25 * period_s * period_s + 1e-6;
    for (const model::TipMeasurement& tip : r.tips)
      EXPECT_NEAR(depth_at(r, tip.utime), pushed_mm(time_s(r, tip.utime)), error_mm) << period_s;
    EXPECT_THAT(summary(r),
                HasSubstr("held     insertion: a new value every " + format_number(period_s) + " s, rows every 0.1 s"));
    EXPECT_TRUE(r.motion_gap.empty()) << r.motion_gap;
    // A rotation that is measured in each row keeps its rows.
    const ImportedRecording with_rotation = import_csv(path, turning);
    EXPECT_GT(with_rotation.actuators.size(), 190U);
    for (const model::ActuatorState& a : with_rotation.actuators)
      EXPECT_NEAR(a.insertion_mm, pushed_mm(time_s(with_rotation, a.utime)), error_mm);
  }
}

TEST_F(TrackerMap, AHeldTipIsOneMeasurementForEachUpdate) {
  const auto seen = held(0.5);
  const Tracker tracker{.depth_mm = seen};
  const ImportedRecording r = import_csv(csv(tracker), map(""));
  EXPECT_EQ(r.tips.size(), 40U);
  EXPECT_EQ(r.headings.size(), 40U);
  EXPECT_EQ(r.actuators.size(), 200U);
}

TEST_F(TrackerMap, StepsOfTheBaseAreNotTakenForAHeldValue) {
  const Tracker tracker{.noise_mm = kSigma_mm, .depth_mm = held(0.8), .base_mm = held(0.8)};
  const ImportedRecording r = import_csv(csv(tracker), map(""));
  EXPECT_EQ(r.actuators.size(), 200U);
  EXPECT_THAT(summary(r), HasSubstr("the tip moves in the same steps"));
}

TEST_F(TrackerMap, ADepthThatIsRoundedAtAVaryingSpeedIsNotHeld) {
  const Tracker tracker{.noise_mm = kSigma_mm, .base_mm = [](double t_s) { return std::round(pushed_mm(t_s)); }};
  EXPECT_THAT(import_csv(csv(tracker), map("")).held, IsEmpty());
  EXPECT_THAT(import_csv(csv({.noise_mm = kSigma_mm}), map("")).held, IsEmpty());
}

TEST(HeldValues, ALongStandstillHasAnUpdateInEachPeriod) {
  std::vector<std::int64_t> times_us;
  std::vector<bool> is_new;
  for (int i = 0; i < 200; ++i) {
    times_us.push_back(100'000 * i);
    is_new.push_back(i >= 40 && i % 8 == 0 && (i < 104 || i > 130));
  }
  const auto held = find_held_values(times_us, is_new);
  ASSERT_TRUE(held.has_value());
  EXPECT_NEAR(held->period_s, 0.8, 1e-9);
  for (std::size_t i = 0; i < 200; ++i) EXPECT_EQ(held->is_update[i], i % 8 == 0) << i;
}

TEST_F(TrackerMap, ALagIsEstimatedAndNotApplied) {
  for (const double lag_s : {-0.3, 0.25, 0.65}) {
    for (const double period_s : {0.1, 0.8}) {
      const auto base = period_s > 0.1 ? held(period_s) : pushed_mm;
      const Tracker tracker{
          .noise_mm = kSigma_mm, .outlier_every = 41, .base_mm = [&](double t_s) { return base(t_s - lag_s); }};
      const std::string path = csv(tracker);
      const ImportedRecording r = import_csv(path, map(""));
      ASSERT_TRUE(r.lag.has_value());
      // The rows see an update up to one row late.
      EXPECT_NEAR(r.lag->lag_s, lag_s, 4 * r.lag->sd_s + (period_s > 0.1 ? 0.06 : 0)) << period_s;
      EXPECT_LT(r.lag->sd_s, 0.05);
      EXPECT_TRUE(r.lag->significant());
      EXPECT_THAT(summary(r), AllOf(HasSubstr("not corrected"), HasSubstr("[base] offset_s = ")));
      const ImportedRecording corrected =
          import_csv(path, map("", r.lag_setting.substr(0, 6) + "\n" + r.lag_setting.substr(7)));
      EXPECT_NEAR(corrected.lag->lag_s, 0, 0.02);
      // The first row of the base moves by the offset, and by no more than it.
      EXPECT_NEAR(depth_at(corrected, corrected.actuators.front().utime + 5'000'000),
                  depth_at(r, r.actuators.front().utime + 5'000'000), 1e-6);
    }
  }
}

TEST_F(TrackerMap, AConstantRateDoesNotDetermineALag) {
  const auto constant = [](double t_s) { return 3 * t_s; };
  const Tracker tracker{
      .noise_mm = kSigma_mm, .depth_mm = constant, .base_mm = [](double t_s) { return 3 * (t_s - 0.5); }};
  const ImportedRecording r = import_csv(csv(tracker), map(""));
  ASSERT_TRUE(r.lag.has_value());
  EXPECT_FALSE(r.lag->determined) << r.lag->lag_s << " +- " << r.lag->sd_s;
  EXPECT_THAT(summary(r), HasSubstr("not determined by this motion"));
}

TEST_F(TrackerMap, AConstantRateBetweenTwoStopsDoesNotDetermineALag) {
  // 16 mm/s from 0.1 s on and until the end, as of an insertion by a motor.
  const auto ramp = [](double t_s) { return 16 * std::clamp(t_s - 0.1, 0.0, 4.7); };
  for (const double lag_s : {0.0, 0.1}) {
    const Tracker tracker{
        .length_s = 5, .interval_s = 0.033, .noise_mm = 0.2, .depth_mm = ramp, .base_mm = [&](double t_s) {
          return ramp(t_s - lag_s);
        }};
    const ImportedRecording r = import_csv(csv(tracker), map(""));
    ASSERT_TRUE(r.lag.has_value());
    EXPECT_FALSE(r.lag->significant()) << r.lag->lag_s << " +- " << r.lag->sd_s;
  }
}

TEST_F(TrackerMap, AGapOfTheBaseIsReportedByTheRuleOfTheDiagnosis) {
  const std::string whole = test::text_of(csv({}));
  std::string text;  // without the base's cells from 8 to 10 s
  std::size_t row = 0;
  for (std::size_t at = 0; at < whole.size(); ++row) {
    const std::size_t end = whole.find('\n', at);
    std::string line = whole.substr(at, end - at);
    if (row > 81 && row < 101) {
      const std::size_t first = line.find(','), third = line.find(',', line.find(',', first + 1) + 1);
      line = line.substr(0, first) + ",," + line.substr(third);
    }
    text += line + "\n";
    at = end + 1;
  }
  const std::string path = folder.write("gap.csv", text);
  const ImportedRecording r = import_csv(path, map(""));
  EXPECT_THAT(r.remarks(path), AllOf(HasSubstr("gap.csv:102: no ACTUATOR_STATE for 2 s, 8 s after the first"),
                                     HasSubstr("Allowed: gaps up to 0.5 s")));
  EXPECT_FALSE(r.intact());
  EXPECT_TRUE(find_motion_gap(r.actuators).has_value()) << "which is what bevel-diagnose asks";
  EXPECT_EQ(test::run_program(folder, "bevel-import",
                              "-c " + (folder / "map.toml").string() + " -o " + folder.path().string() + " " + path)
                .status,
            3);
}

TEST(MotionGap, AnIntervalIsNoGapWhereAllAreAsLong) {
  std::vector<model::ActuatorState> slow(30);
  for (std::size_t i = 0; i < slow.size(); ++i) {
    slow[i].utime = 800'000 * static_cast<std::int64_t>(i + 1);
    slow[i].insertion_mm = 3 * static_cast<double>(i);
  }
  EXPECT_FALSE(find_motion_gap(slow).has_value());
  EXPECT_NEAR(longest_interval_s(slow), 3.2, 1e-9);
  slow.erase(slow.begin() + 10, slow.begin() + 14);  // 4 s
  const auto gap = find_motion_gap(slow);
  ASSERT_TRUE(gap.has_value());
  EXPECT_NEAR(gap->gap_s, 4, 1e-9);
  for (auto& a : slow) a.insertion_mm *= 0.01;  // 0.15 mm in the gap
  EXPECT_FALSE(find_motion_gap(slow).has_value());
}

// Real recordings. The figures of their README: base published every 0.8 s, lag 0.25 to 0.65 s, best determined in
// openloop_01; scale 0.989 and curvature 0.0120 /mm for all of ultrasteer.
TEST(RealTrackers, AHeldBaseHasTheUpdatesThatWereFoundByHand) {
  const std::filesystem::path real = test::shared_recordings() / "real/bwh2022";
  BEVEL_SKIP_WITHOUT(real);
  const ColumnMap stair = load_column_map((real / "stair.toml").string());
  const ColumnMap tip = load_column_map((real / "tip.toml").string());
  for (const std::string name : {"off_01.csv", "off_02.csv", "openloop_01.csv"}) {
    const std::string raw = (real / "raw" / name).string();
    const ImportedRecording found = import_csv(raw, stair);
    const ImportedRecording by_hand = import_csv(raw, tip, (real / "base" / name).string());
    ASSERT_EQ(found.actuators.size(), by_hand.actuators.size()) << name;
    for (std::size_t i = 0; i < found.actuators.size(); ++i)
      EXPECT_NEAR(static_cast<double>(found.actuators[i].utime - by_hand.actuators[i].utime) * 1e-6, 0, 0.01)
          << name << i;
    EXPECT_TRUE(by_hand.motion_gap.empty()) << by_hand.motion_gap;
    ASSERT_TRUE(found.lag.has_value());
    EXPECT_EQ(found.lag->significant(), name == "openloop_01.csv") << name;
    EXPECT_GT(found.lag->lag_s, 0.2) << name;
    EXPECT_LT(found.lag->lag_s, 0.7) << name;
  }
}

TEST(RealTrackers, AnEntryDirectionIsThatOfTheAlignedRecordings) {
  const std::filesystem::path real = test::shared_recordings() / "real/ultrasteer";
  BEVEL_SKIP_WITHOUT(real);
  ColumnMap map = load_column_map((real / "ultrasteer.toml").string());
  map.frame = TipFrame::from_straight_insertion;
  for (const std::string name : {"trial1.csv", "trial2.csv", "trial3.csv"}) {
    const ImportedRecording r = import_csv((real / "csv/1mm" / name).string(), map);
    const ImportedRecording aligned = import_csv((real / "aligned/1mm" / name).string(), map);
    ASSERT_TRUE(r.frame && aligned.frame);
    EXPECT_NEAR(r.frame->radius_mm, aligned.frame->radius_mm, 0.1) << name;
    EXPECT_NEAR(r.frame->scale, aligned.frame->scale, 1e-3) << name;
    // In the aligned file z of {A} is z already.
    const double tilt_rad = aligned.frame->to_A.angularDistance(Eigen::Quaterniond::Identity());
    EXPECT_LT(tilt_rad, 2 * aligned.frame->direction_sd_rad) << name;
    EXPECT_LT(aligned.frame->origin_mm.norm(), 2 * aligned.frame->origin_sd_mm) << name;
    EXPECT_GT(1 / r.frame->radius_mm, 0.9 * 0.012) << name;
    EXPECT_LT(1 / r.frame->radius_mm, 1.1 * 0.013) << name;
    EXPECT_LT(r.frame->rms_mm, 0.25) << name;
    EXPECT_FALSE(r.lag && r.lag->determined) << "1 mm/s all the way";
  }
}

// Simulated recordings whose camera is late in one case only.
TEST(SimulatedRecordings, ALagIsReportedForTheLateCameraAlone) {
  const std::filesystem::path practice = test::shared_recordings() / "recordings/practice";
  BEVEL_SKIP_WITHOUT(practice);
  int recordings = 0, late = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(practice)) {
    if (entry.path().extension() != ".lcm") continue;
    Recording r = read_recording(entry.path().string());
    std::ranges::stable_sort(r.actuators, {}, &model::ActuatorState::utime);
    std::ranges::stable_sort(r.tips, {}, &model::TipMeasurement::utime);
    const auto lag = estimate_base_lag(r.actuators, r.tips);
    ++recordings;
    if (!lag || !lag->significant()) continue;
    EXPECT_EQ(entry.path().parent_path().filename(), "case05") << entry.path() << lag->lag_s << " +- " << lag->sd_s;
    EXPECT_NEAR(lag->lag_s, -0.0853, 4 * lag->sd_s) << entry.path();
    ++late;
  }
  std::printf("lag: %d recordings, %d significant\n", recordings, late);
  EXPECT_GT(late, 0);
}

}  // namespace
}  // namespace bevel::io
