// SPDX-License-Identifier: MIT
// bevel-replay's page of a log in which two cameras take turns, one of which alone sees x.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include <bevel/analysis/replay/report.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::analysis {
namespace {

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;
constexpr int kReadings = 2400;  // more than a figure has room for; an even number of them in every step of counting

Replay two_cameras() {
  Replay replay;
  replay.name = "turns";
  for (int i = 0; i < kReadings; ++i) {
    const std::int64_t utime = kStart_utime + 16'667LL * i;
    estimator::FilterState state;
    state.covariance.setIdentity();
    state.pose.p_mm = {std::sin(0.01 * i), 0, 0.05 * i};
    StateRow row;
    row.utime = utime;
    row.state = state;
    replay.states.push_back(row);
    InnovationRow reading;
    reading.utime = utime;
    reading.camera = i % 2;
    reading.accepted = true;
    reading.rank = 2;
    reading.position_mm = state.pose.p_mm;
    if (i == 1001) reading.position_mm.x() = 7;  // what must be seen
    reading.sees = {reading.camera == 1, reading.camera == 0, true};
    reading.innovation_mm = reading.state_variance_mm2 = reading.noise_variance_mm2 = Eigen::Vector3d::Ones();
    replay.innovations.push_back(reading);
  }
  return replay;
}

TEST(ReplayPage, shows_what_each_camera_measured) {
  const test::TemporaryFolder folder;
  write_files(two_cameras(), folder.path().string(), 20);
  std::stringstream page;
  page << std::ifstream(folder / "turns.html").rdbuf();
  const std::string html = page.str(), open = R"(id="figures">)";
  const std::size_t from = html.find(open) + open.size();
  const auto data = nlohmann::json::parse(html.substr(from, html.find("</script>", from) - from));
  const auto cameras_of = [&](const std::string& axis) {
    std::map<std::string, nlohmann::json> found;
    for (const auto& figure : data["figures"])
      if (figure.contains("y") && figure["y"] == axis)
        for (const auto& s : figure["series"])
          if (s["kind"] == "points") found[s["label"]] = data["lists"][s["y"].get<std::size_t>()];
    return found;
  };
  auto of_x = cameras_of("x (mm)"), of_y = cameras_of("y (mm)"), of_z = cameras_of("z (mm)");
  ASSERT_EQ(of_x.size(), 1U);
  EXPECT_GT(of_x["camera 1"].size(), 500U);
  EXPECT_EQ(of_x["camera 1"].size(), of_y["camera 0"].size());
  EXPECT_EQ(of_z.size(), 2U);
  double largest = 0;
  for (const auto& x_mm : of_x["camera 1"]) largest = std::max(largest, x_mm.get<double>());
  EXPECT_EQ(largest, 7);
}

}  // namespace
}  // namespace bevel::analysis
