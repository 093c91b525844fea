// SPDX-License-Identifier: MIT
// Which channels a case has, and which recordings cannot be diagnosed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include <bevel/error.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::vector<RawRecording> with_information(const std::function<Eigen::Matrix3d(std::size_t)>& of) {
  auto raw = record({.recordings = 2}, 1);
  for (auto& recording : raw)
    for (std::size_t i = 0; i < recording.tips.size(); ++i) recording.tips[i].information_per_mm2 = of(i);
  return raw;
}

Eigen::Matrix3d diagonal(double x, double y, double z) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  matrix.diagonal() << x, y, z;
  return matrix;
}

std::string refusal(std::vector<RawRecording> raw) {
  try {
    make_case(std::move(raw));
  } catch (const ArgumentError& e) {
    return e.what();
  }
  return "taken";
}

std::vector<std::string> names_of(const RecordedCase& recorded) {
  std::vector<std::string> names;
  for (const auto& channel : recorded.channels) names.push_back(channel.name);
  return names;
}

TEST(Channels, ADiagonalInformationSeesTheAxesItHasInformationAlong) {
  const auto recorded = make_case(with_information([](auto) { return diagonal(0, 25, 16); }));
  EXPECT_THAT(names_of(recorded), ::testing::ElementsAre("tip.y", "tip.z"));
  EXPECT_NEAR(recorded.channels[0].claimed_sd, 0.2, 1e-12);
  EXPECT_NEAR(recorded.channels[1].claimed_sd, 0.25, 1e-12);
  const auto& recording = recorded.recordings[0];
  ASSERT_EQ(recording.series[0].measured.size(), recording.position_mm.size());
  for (std::size_t i = 0; i < recording.position_mm.size(); ++i) {
    EXPECT_EQ(recording.series[0].measured[i], recording.position_mm[i].y());
    EXPECT_EQ(recording.series[1].measured[i], recording.position_mm[i].z());
  }
  EXPECT_EQ(recorded.measurements(),
            2 * (recorded.recordings[0].position_mm.size() + recorded.recordings[1].position_mm.size()));
}

// A sensor that sees a heading to all sides gives two channels, by x and y, in the message of its position.
TEST(Channels, AHeadingIsReadByItsComponents) {
  const auto recorded = make_case(record({.recordings = 2, .heading_sd_rad = 0.004}, 1));
  EXPECT_THAT(names_of(recorded), ::testing::ElementsAre("tip.x", "tip.y", "tip.z", "heading.x", "heading.y"));
  EXPECT_NEAR(recorded.channels[3].claimed_sd, 0.004, 1e-4);
  EXPECT_STREQ(recorded.channels[3].unit(), "rad");
  EXPECT_STREQ(recorded.channels[0].unit(), "mm");
  const auto raw = record({.recordings = 2, .heading_sd_rad = 0.004}, 1);
  const auto& recording = recorded.recordings[1];
  ASSERT_EQ(recording.motion.at.size(), raw[1].tips.size()) << "one message each";
  ASSERT_EQ(recording.series[4].message, recording.series[0].message);
  for (std::size_t i = 0; i < raw[1].headings.size(); ++i)
    EXPECT_EQ(recording.series[4].measured[i], raw[1].headings[i].heading.y());
}

// A heading that turns by 1 rad toward an oblique direction: its principal axes turn with it, its channels do not.
TEST(Channels, HeadingsOfAStronglyBentNeedleKeepTheirChannels) {
  constexpr double kBend_rad = 1.0, kSd_rad = 0.004;
  auto raw = record({.recordings = 2, .heading_sd_rad = kSd_rad}, 1);
  const Eigen::Vector3d toward(0.5, -std::sqrt(0.75), 0);
  for (auto& recording : raw)
    for (std::size_t i = 0; i < recording.headings.size(); ++i) {
      const double bent_rad = kBend_rad * static_cast<double>(i) / static_cast<double>(recording.headings.size() - 1);
      auto& heading = recording.headings[i];
      heading.heading = std::cos(bent_rad) * Eigen::Vector3d::UnitZ() + std::sin(bent_rad) * toward;
      heading.information_per_rad2 =
          (Eigen::Matrix3d::Identity() - heading.heading * heading.heading.transpose()) / (kSd_rad * kSd_rad);
    }
  const auto recorded = make_case(raw);
  ASSERT_THAT(names_of(recorded), ::testing::ElementsAre("tip.x", "tip.y", "tip.z", "heading.x", "heading.y"));
  for (const std::size_t c : {3U, 4U}) {
    const Channel& channel = recorded.channels[c];
    const Series& series = recorded.recordings[0].series[c];
    ASSERT_EQ(series.measured.size(), raw[0].headings.size());
    // A turn by e across the heading h moves its component along an axis a by sd |a - (a.h) h|.
    for (std::size_t i = 0; i < series.measured.size(); ++i) {
      const Eigen::Vector3d& h = raw[0].headings[i].heading;
      const double along = channel.axis.dot(h);
      EXPECT_NEAR(series.measured[i], along, 1e-12);
      EXPECT_NEAR(series.relative_sd[i] * channel.claimed_sd, kSd_rad * std::sqrt(1 - along * along),
                  5e-3 * kSd_rad);  // while the correlation is small it is left out of the marginal
    }
  }
}

// One camera sees a heading turn in its picture alone: from along x, about x.
TEST(Channels, AHeadingThatOneCameraSeesHasOneChannel) {
  auto raw = record({.recordings = 2, .heading_sd_rad = 0.004}, 1);
  for (auto& recording : raw)
    for (auto& heading : recording.headings) {
      const Eigen::Vector3d across = Eigen::Vector3d::UnitX().cross(heading.heading).normalized();
      heading.information_per_rad2 = across * across.transpose() / (0.01 * 0.01);
    }
  const auto recorded = make_case(std::move(raw));
  EXPECT_THAT(names_of(recorded), ::testing::ElementsAre("tip.x", "tip.y", "tip.z", "heading.y"));
  EXPECT_NEAR(recorded.channels[3].claimed_sd, 0.01, 1e-3);
}

// Without a clock the n-th time is the n-th stop, however long it took.
TEST(Channels, WithoutAClockTimesAreAnOrder) {
  auto raw = record({.recordings = 2}, 1);
  for (auto& recording : raw) {
    recording.has_clock = false;
    recording.actuators.resize(30);
    recording.tips.resize(30);
    for (std::size_t i = 0; i < 30; ++i)
      recording.tips[i].utime = recording.actuators[i].utime = 1'000'000 + static_cast<std::int64_t>(i * i) * 777'000;
  }
  const auto recorded = make_case(std::move(raw));
  EXPECT_FALSE(recorded.has_clock);
  const auto& time_s = recorded.recordings[0].series[0].time_s;
  ASSERT_EQ(time_s.size(), 30U);
  for (std::size_t i = 2; i < 30; ++i) EXPECT_NEAR(time_s[i] - time_s[i - 1], time_s[1] - time_s[0], 1e-9);
}

TEST(Channels, AnObliqueInformationOfAllAxesIsReadByTheirMarginals) {
  // One camera turned about z by 30 degrees, with unequal deviations across.
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(std::numbers::pi / 6, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d information = turn * diagonal(100, 25, 4) * turn.transpose();
  const Eigen::Matrix3d covariance = information.inverse();
  const auto recorded = make_case(with_information([&](auto) -> const Eigen::Matrix3d& { return information; }));
  EXPECT_THAT(names_of(recorded), ::testing::ElementsAre("tip.x", "tip.y", "tip.z"));
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(recorded.channels[static_cast<std::size_t>(i)].claimed_sd, std::sqrt(covariance(i, i)), 1e-9);
}

// A tracker is surer across the needle than along it, and the needle turns in its picture as it bends.
TEST(Channels, APictureInWhichTheNeedleTurnsHasTheSameTwoThroughout) {
  const auto information = [](std::size_t i) {
    const double angle = 0.4 * std::sin(0.1 * static_cast<double>(i));
    const Eigen::Vector3d along(0, std::sin(angle), std::cos(angle)), across(0, std::cos(angle), -std::sin(angle));
    return Eigen::Matrix3d(400 * across * across.transpose() + 25 * along * along.transpose());
  };
  const auto recorded = make_case(with_information(information));
  ASSERT_THAT(names_of(recorded), ::testing::ElementsAre("tip.y", "tip.z"));
  for (const auto& recording : recorded.recordings) {
    ASSERT_EQ(recording.series[0].time_s.size(), recording.position_mm.size());
    for (std::size_t i = 0; i < recording.position_mm.size(); ++i) {
      // Var y = s_across^2 cos^2 + s_along^2 sin^2, and the other way round for z.
      const double angle = 0.4 * std::sin(0.1 * static_cast<double>(i));
      const double c = std::cos(angle) * std::cos(angle), one = 1.0 / 400, other = 1.0 / 25;
      const double sd_y = std::sqrt(one * c + other * (1 - c)), sd_z = std::sqrt(other * c + one * (1 - c));
      EXPECT_NEAR(recording.series[0].relative_sd[i] * recorded.channels[0].claimed_sd, sd_y, 1e-9);
      EXPECT_NEAR(recording.series[1].relative_sd[i] * recorded.channels[1].claimed_sd, sd_z, 1e-9);
    }
  }
}

TEST(Channels, ACameraThatSeesNoDepthHasTwo) {
  // It looks along (1 1 0)/sqrt 2.
  const Eigen::Vector3d depth = Eigen::Vector3d(1, 1, 0).normalized();
  const Eigen::Matrix3d information = 25 * (Eigen::Matrix3d::Identity() - depth * depth.transpose());
  const auto recorded = make_case(with_information([&](auto) -> const Eigen::Matrix3d& { return information; }));
  ASSERT_EQ(recorded.channels.size(), 2U);
  for (const auto& channel : recorded.channels) {
    EXPECT_NEAR(channel.axis.dot(depth), 0, 1e-9);
    EXPECT_NEAR(channel.claimed_sd, 0.2, 1e-9);
  }
  EXPECT_NEAR(recorded.channels[0].axis.dot(recorded.channels[1].axis), 0, 1e-9);
}

TEST(Channels, AnObliqueCamerasOwnRoundingMakesNoNewOnes) {
  // Equal deviations across: any two directions are eigenvectors, and the last digits would choose others for every
  // message.
  const Eigen::Vector3d depth = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
  const Eigen::Matrix3d seen = Eigen::Matrix3d::Identity() - depth * depth.transpose();
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto recorded = make_case(with_information([&](auto) {
    const Eigen::Vector3d tangent = seen * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
    const Eigen::Matrix3d other = 1e-6 * tangent * tangent.transpose();
    return Eigen::Matrix3d((25 + 5 * uniform(random)) * (seen + other));
  }));
  ASSERT_EQ(recorded.channels.size(), 2U);
  for (const auto& channel : recorded.channels) EXPECT_NEAR(channel.claimed_sd, 0.2, 0.02);
  for (const auto& recording : recorded.recordings)
    for (const auto& series : recording.series) EXPECT_EQ(series.time_s.size(), recording.position_mm.size());
}

TEST(Channels, TwoCamerasThatSeeOneAxisAreTwoChannels) {
  auto raw = record({.recordings = 2}, 1);
  for (auto& recording : raw)
    for (std::size_t i = 0; i < recording.tips.size(); ++i) {
      recording.tips[i].camera = static_cast<std::int32_t>(i % 2);
      recording.tips[i].information_per_mm2 = diagonal(i % 2 == 0 ? 0 : 25, 25, 0);
    }
  EXPECT_THAT(names_of(make_case(raw)), ::testing::ElementsAre("tip.y", "tip[1].x", "tip[1].y"));
}

TEST(Channels, AReadingLessSureThanTheMedianSaysSo) {
  const auto recorded =
      make_case(with_information([](std::size_t i) { return diagonal(0, i == 7 ? 25.0 / 9 : 25.0, 0); }));
  const auto& series = recorded.recordings[0].series[0];
  EXPECT_NEAR(series.relative_sd[7], 3, 1e-12);
  EXPECT_NEAR(series.relative_sd[8], 1, 1e-12);
}

TEST(Channels, MessagesThatAreNotUsableAreCounted) {
  auto raw = record({.recordings = 2}, 1);
  raw[0].tips[3].status = 2;
  raw[0].tips[4].information_per_mm2.setZero();
  raw[0].tips[5].position_mm.x() = std::numeric_limits<double>::quiet_NaN();
  const std::size_t all = raw[0].tips.size();
  const auto recorded = make_case(raw);
  EXPECT_EQ(recorded.recordings[0].skipped, 3U);
  EXPECT_EQ(recorded.recordings[0].position_mm.size(), all - 3);
}

TEST(BadInput, OneRecordingOnly) {
  EXPECT_THAT(refusal(record({.recordings = 1}, 1)), AllOf(HasSubstr("1 recording given"), HasSubstr("at least two")));
}

TEST(BadInput, NoUsableTip) {
  auto raw = record({.recordings = 2}, 1);
  for (auto& tip : raw[1].tips) tip.status = 3;
  EXPECT_THAT(refusal(raw), AllOf(HasSubstr("rec2: no usable TIP_MEASUREMENT"),
                                  HasSubstr(std::to_string(raw[1].tips.size()) + " in the log")));
}

TEST(BadInput, NoMotion) {
  auto raw = record({.recordings = 2}, 1);
  raw[1].actuators.resize(1);
  EXPECT_THAT(refusal(raw), AllOf(HasSubstr("rec2: 1 ACTUATOR_STATE"), HasSubstr("at least two")));
}

TEST(BadInput, TooFewReadingsForANoise) {
  auto raw = record({.recordings = 2}, 1);
  for (auto& recording : raw) recording.tips.resize(4);
  EXPECT_THAT(refusal(raw), AllOf(HasSubstr("channel tip.x has 4 readings"), HasSubstr("at least 5")));
  raw = record({.recordings = 2}, 1);
  raw[1].tips.resize(5);
  EXPECT_EQ(refusal(raw), "taken");
}

TEST(BadInput, ClocksApart) {
  for (const double ahead_s : {30.0, -30.0}) {
    auto raw = record({.recordings = 2}, 1);
    for (auto& tip : raw[1].tips) tip.utime += std::llround(ahead_s * 1e6);
    EXPECT_THAT(refusal(raw), AllOf(HasSubstr("rec2"), HasSubstr("clocks of camera and axes are apart"))) << ahead_s;
  }
  // An exposure late by a tenth of a second is physics, not a broken clock.
  auto late = record({.recordings = 2}, 1);
  for (auto& tip : late[1].tips) tip.utime += 100'000;
  EXPECT_EQ(refusal(late), "taken");
}

TEST(BadInput, MixedRigs) {
  const auto mixed = [](const std::function<void(RawRecording&)>& change) {
    auto raw = record({.recordings = 3}, 1);
    change(raw[2]);
    return refusal(raw);
  };
  EXPECT_THAT(mixed([](RawRecording& r) {
                for (auto& tip : r.tips) tip.information_per_mm2(0, 0) = 0;
              }),
              AllOf(HasSubstr("rec3: no channel tip.x"), HasSubstr("different rigs")));
  EXPECT_THAT(mixed([](RawRecording& r) {
                for (auto& tip : r.tips) tip.information_per_mm2 *= 1.0 / 16;
              }),
              AllOf(HasSubstr("different rigs"), HasSubstr("standard deviation claimed for tip.x"), HasSubstr("0.6")));
  EXPECT_THAT(mixed([](RawRecording& r) {
                std::vector<model::TipMeasurement> few;
                for (std::size_t i = 0; i < r.tips.size(); i += 4) few.push_back(r.tips[i]);
                r.tips = few;
              }),
              AllOf(HasSubstr("different rigs"), HasSubstr("a reading of tip.x every")));
}

}  // namespace
}  // namespace bevel::diagnosis::testing
