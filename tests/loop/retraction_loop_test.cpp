// SPDX-License-Identifier: MIT
// Back along the path through all the nodes: the operator's word, drives and messages as they run live.
#include <algorithm>

#include "tests/loop/loop_fixture.hpp"

namespace bevel {
namespace {

using controller::Reason;
using controller::State;
using nodes::Word;

class RetractionLoop : public testing::Test {
 protected:
  void begin(const nodes::SystemConfig& config) { loop = std::make_unique<test::SimulatedLoop>(kSeed, config); }
  double insertion_mm() { return loop->rig->drive(0).position_unit(); }
  void retract(double to_mm) { loop->say(Word::retract, {0, 0, to_mm}); }
  // Steers there; what it passed on the way in, by inserted length.
  void arrive(const Eigen::Vector3d& target) {
    ASSERT_EQ(loop->steer_to(target), "");
    ASSERT_TRUE(loop->run(90, [this] {
      way_.push_back({insertion_mm(), loop->tip()});
      return loop->state() != State::steering;
    }));
    ASSERT_EQ(loop->state(), State::hold) << loop->said("bevel-controller").reason;
    loop->run(0.5);
    std::cout << "seed " << kSeed << ": tip to target " << (loop->tip() - target).norm() << " mm\n";
  }
  Eigen::Vector3d passed_mm(double insertion) const {
    const auto after = std::lower_bound(way_.begin() + 1, way_.end() - 1, insertion,
                                        [](const Passed& p, double mm) { return p.insertion_mm < mm; });
    const Passed &a = *(after - 1), &b = *after;
    const double length = b.insertion_mm - a.insertion_mm;
    return a.tip_mm + (length > 0 ? (insertion - a.insertion_mm) / length : 0) * (b.tip_mm - a.tip_mm);
  }
  // Until it holds again: the farthest of the true tip from where it was, and of the estimate from the tip.
  void draw_back(double to_mm, double& off_the_path_mm, double& estimate_mm) {
    retract(to_mm);
    ASSERT_EQ(loop->state(), State::retracting) << loop->said("bevel-controller").reason;
    off_the_path_mm = estimate_mm = 0;
    ASSERT_TRUE(loop->run(60, [&] {
      off_the_path_mm = std::max(off_the_path_mm, (loop->tip() - passed_mm(insertion_mm())).norm());
      const Eigen::Vector3d estimate = Eigen::Vector3d::Map(loop->needle_state->position_mm);
      // Of when it was made: what has moved since is along the needle.
      const Eigen::Vector3d off = estimate - loop->tip();
      const Eigen::Vector3d along = loop->rig->plant().tip().R.col(2);
      estimate_mm = std::max(estimate_mm, (off - along * along.dot(off)).norm());
      return loop->state() != State::retracting;
    }));
    ASSERT_EQ(loop->state(), State::hold) << loop->said("bevel-controller").reason;
    loop->run(0.5);
    EXPECT_NEAR(insertion_mm(), to_mm, 0.15);
  }

  struct Passed {
    double insertion_mm;
    Eigen::Vector3d tip_mm;
  };
  std::unique_ptr<test::SimulatedLoop> loop;
  std::vector<Passed> way_;
};

const Eigen::Vector3d kTarget(4, -6, 70), kSecond(9, -10, 110);

TEST_F(RetractionLoop, BackByFortyMillimetresAndOnToAnotherTarget) {
  // A workspace that ends at the entry, and with it the drive's own limit (0x607D), is not run into.
  nodes::SystemConfig config = test::loop_config();
  config.stepper.axes[0].position_min_unit = 0;
  begin(config);
  ASSERT_NO_FATAL_FAILURE(arrive(kTarget));
  double off_the_path_mm = 0, estimate_mm = 0;
  const double to_mm = insertion_mm() - 40;
  ASSERT_NO_FATAL_FAILURE(draw_back(to_mm, off_the_path_mm, estimate_mm));
  std::cout << "drawn back 40 mm: tip off the way in by " << off_the_path_mm
            << " mm at most, estimate beside the tip by " << estimate_mm << " mm, inserted " << insertion_mm() - to_mm
            << " mm more than asked for\n";
  EXPECT_LT(off_the_path_mm, 0.02);
  EXPECT_LT(estimate_mm, 0.3);
  ASSERT_NO_FATAL_FAILURE(arrive(kSecond));
  EXPECT_LT((loop->tip() - kSecond).norm(), 0.3);
  // And out: to the entry.
  retract(0);
  ASSERT_TRUE(loop->run(60, [this] { return loop->state() != State::retracting; }));
  loop->run(0.5);
  EXPECT_EQ(loop->state(), State::hold) << loop->said("bevel-controller").reason;
  EXPECT_NEAR(insertion_mm(), 0, 0.15);
  EXPECT_LT(loop->tip().norm(), 0.3);
}

TEST_F(RetractionLoop, TheOperatorsStopIsObeyedAtOnce) {
  begin(test::loop_config());
  ASSERT_NO_FATAL_FAILURE(arrive(kTarget));
  retract(10);
  loop->run(2);
  ASSERT_LT(loop->rig->drive(0).velocity_unit_s(), -4);
  loop->say(Word::stop);
  EXPECT_EQ(loop->state(), State::stopped);
  const std::int64_t from = loop->ms;
  ASSERT_TRUE(loop->run(1, [this] { return loop->at_rest(); }));
  EXPECT_LT(loop->ms - from, 100);
  const double at_mm = insertion_mm();
  retract(10);
  loop->run(1);
  EXPECT_NEAR(insertion_mm(), at_mm, 0.05) << "latched";
  EXPECT_EQ(loop->reason(), Reason::operator_stop);
}

}  // namespace
}  // namespace bevel
