// SPDX-License-Identifier: MIT
// What the fault injector makes of a camera that gives positions and headings: both fail as one.
#include <gtest/gtest.h>

#include <bevel/error.hpp>
#include <bevel/estimator/health.hpp>
#include <bevel/io/checked_decode.hpp>
#include <bevel/model/motion_direction.hpp>
#include "tests/loop/simulated_loop.hpp"

namespace bevel {
namespace {

using nodes::Component;
using nodes::FaultInjector;
using nodes::FaultKind;
using test::SimulatedLoop;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kFrame_ms = 33;
constexpr int kFramesBefore = 40, kFrames = 100;

tip_heading_t heading_at(std::int64_t utime, std::int64_t seq, const Eigen::Vector3d& ahead = {0, -0.1, 1}) {
  model::TipHeading m;
  m.utime = utime;
  m.seq = seq;
  m.heading = Eigen::Vector3d(0, ahead.y(), ahead.z()).normalized();
  const Eigen::Vector3d across(0, m.heading.z(), -m.heading.y());
  m.information_per_rad2 = 400 * across * across.transpose();
  return io::to_message(m);
}

tip_measurement_t tip_at(std::int64_t utime, std::int64_t seq) {
  tip_measurement_t m{};
  m.utime = utime;
  m.seq = seq;
  m.position_mm[2] = 0.33 * static_cast<double>(seq);
  m.information_per_mm2[4] = m.information_per_mm2[8] = 25;
  return m;
}

struct Out {
  std::int64_t at_ns;
  std::vector<std::uint8_t> bytes;
};
struct Spoiled {
  std::vector<Out> tips, headings;
};

// What leaves the injector from the fault on, of a camera at 30 Hz.
Spoiled spoil(FaultKind kind, std::uint64_t seed) {
  FaultInjector injector(Component::camera);
  const std::int64_t fault_ns = kFramesBefore * kFrame_ms * kMs - kMs;
  injector.begin(kind, fault_ns, seed);
  Spoiled out;
  for (std::int64_t ms = 0; ms < (kFrames + 30) * kFrame_ms; ++ms) {
    const std::int64_t now_ns = ms * kMs, utime = 1'000'000 + 1000 * ms;
    if (ms % kFrame_ms == 0 && ms < kFrames * kFrame_ms) {
      const std::int64_t seq = ms / kFrame_ms;
      injector.pass(io::channel::kTipMeasurement, io::encode(tip_at(utime, seq)), now_ns, utime);
      injector.pass(io::channel::kTipHeading,
                    io::encode(heading_at(utime, seq, {0, -0.001 * static_cast<double>(seq), 1})), now_ns, utime);
    }
    injector.flush(now_ns, [&](const char* channel, std::span<const std::uint8_t> bytes) {
      if (now_ns < fault_ns) return;
      const bool heading = std::string_view(channel) == io::channel::kTipHeading;
      EXPECT_TRUE(heading || std::string_view(channel) == io::channel::kTipMeasurement) << channel;
      (heading ? out.headings : out.tips).push_back({now_ns, {bytes.begin(), bytes.end()}});
    });
  }
  return out;
}

std::optional<tip_heading_t> read(const Out& out) {
  const auto decoded = io::checked_decode<tip_heading_t>(out.bytes.data(), out.bytes.size());
  return decoded ? std::optional(decoded.message) : std::nullopt;
}

TEST(FaultInjector, ACamerasHeadingsFailAsItsPositionsDo) {
  constexpr int kAfter = kFrames - kFramesBefore;
  for (std::uint64_t seed = 1; seed <= 8; ++seed)
    for (int k = 0; k < nodes::kFaultKinds; ++k) {
      const auto kind = static_cast<FaultKind>(k);
      SCOPED_TRACE(std::string(nodes::name_of(kind)) + ", seed " + std::to_string(seed));
      const Spoiled out = spoil(kind, seed);
      EXPECT_EQ(out.headings.size(), out.tips.size());
      if (kind == FaultKind::off) {
        EXPECT_EQ(out.headings.size(), 0U);
        continue;
      }
      if (kind == FaultKind::slow || kind == FaultKind::intermittent) {
        EXPECT_LT(out.headings.size(), kAfter * 0.6);
        EXPECT_GT(out.headings.size(), 3U);
      }
      if (kind == FaultKind::replayed || kind == FaultKind::second_sender) {
        EXPECT_GE(out.headings.size(), kAfter * 1.3);
      }
      if (kind == FaultKind::stuck || kind == FaultKind::wrong || kind == FaultKind::delayed) {
        EXPECT_EQ(out.headings.size(), static_cast<std::size_t>(kAfter));
      }
      int readable = 0;
      for (std::size_t i = 0; i < out.headings.size(); ++i) {
        EXPECT_EQ(out.headings[i].at_ns, out.tips[i].at_ns);
        const auto heading = read(out.headings[i]);
        if (!heading) continue;
        ++readable;
        const double slope = -heading->heading[1] / heading->heading[2];
        if (kind == FaultKind::stuck) {
          EXPECT_NEAR(slope, 0.001 * (kFramesBefore - 1), 1e-9);
        }
        if (kind == FaultKind::wrong) {
          EXPECT_GT(std::abs(heading->heading[0]) + std::abs(slope), 0.3) << "turned, and still a heading";
        }
        if (kind == FaultKind::delayed) {
          EXPECT_GE(out.headings[i].at_ns / 1000 - (heading->utime - 1'000'000), 150'000);
        }
      }
      if (kind == FaultKind::garbage) {
        EXPECT_LT(readable, kAfter / 4);
      } else {
        EXPECT_EQ(readable, static_cast<int>(out.headings.size()));
      }
    }
}

TEST(FaultInjector, AChannelOfAnotherComponentIsRefused) {
  FaultInjector injector(Component::controller);
  EXPECT_FALSE(injector.concerns(io::channel::kTipHeading));
  EXPECT_TRUE(injector.concerns(io::channel::kMotionCommand));
  EXPECT_THROW(injector.pass(io::channel::kTipHeading, {1, 2, 3}, 1, 1), bevel::ArgumentError);
}

// The loop with cameras that give the tangent of the shaft: without a fault it arrives, and headings that are turned
// stop it although the positions are right.
TEST(FaultInjector, TurnedHeadingsOfTheCamerasStopTheLoop) {
  for (const bool turned : {false, true}) {
    nodes::SystemConfig config = test::loop_config();
    config.estimator.shaft_cameras = {0};
    SimulatedLoop loop(9, config);
    const Eigen::Vector3d target(6, -9, 80);
    ASSERT_EQ(loop.steer_to(target), "");
    nodes::LcmPort headings(loop.lcm);
    FaultInjector* injector = nullptr;
    {
      auto owned = std::make_unique<FaultInjector>(Component::camera);
      injector = owned.get();
      headings.inject(std::move(owned));
    }
    std::normal_distribution<double> noise(0, 0.02);
    std::int64_t seq = 0;
    loop.each_ms = [&] {
      headings.tell_time(loop.now());
      if (loop.ms % 33 != 0) return;
      const model::Pose tip = loop.rig->plant().tip();
      model::MotionDirection motion;
      ASSERT_TRUE(model::motion_direction(tip.R, model::slip_parameters(loop.config.rig.truth), motion));
      const Eigen::Vector3d ahead = tip.R * motion.along;
      const double angle = std::atan2(ahead.y(), ahead.z()) + noise(loop.rng);
      headings.publish(io::channel::kTipHeading,
                       heading_at(loop.utime(), seq++, {0, std::sin(angle), std::cos(angle)}));
    };
    loop.run(2);
    ASSERT_EQ(loop.state(), controller::State::steering);
    if (turned) injector->begin(FaultKind::wrong, loop.ns(), 1);
    ASSERT_TRUE(loop.run(60, [&loop] { return loop.state() != controller::State::steering; }));
    EXPECT_EQ(loop.state(), turned ? controller::State::stopped : controller::State::hold);
    EXPECT_EQ((loop.needle_state->health & estimator::kRejecting) != 0, turned);
    if (!turned) {
      EXPECT_LT((loop.tip() - target).norm(), 0.8);
      EXPECT_GT(loop.estimator->estimator().counters().headings.offered, 100);
    }
    loop.each_ms = nullptr;
  }
}

}  // namespace
}  // namespace bevel
