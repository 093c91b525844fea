// Export, import, export: the same bytes, whatever a recording holds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "io/csv_export.hpp"
#include "io/log_writer.hpp"
#include "io/messages.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

// A recording that a rig could have made, with odd numbers wherever a field allows any.
class Generator {
 public:
  explicit Generator(unsigned seed) : random_(seed) {}

  Recording recording() {
    Recording r;
    const int samples = whole(2, 40);
    std::int64_t utime = 1 + static_cast<std::int64_t>(whole(0, 1'000'000)) * whole(0, 1'700'000'000);
    for (int i = 0; i < samples; ++i) {
      utime += whole(6'000, 20'000);
      if (i == 0 || coin()) add_axes(r, utime, i);
      if (coin()) add_tip(r, utime - whole(0, 1) * std::min<std::int64_t>(utime - 1, 5'000), i);
      if (coin()) add_heading(r, utime, i);
      if (coin()) r.commands.push_back({utime, i, whole(0, 1), odd(1e5), odd(1e5)});
      if (whole(0, 4) == 0) r.estimates.push_back(needle_state(utime, i));
      if (whole(0, 4) == 0) r.truths.push_back(needle_state(utime, i));
    }
    if (coin()) r.config = "# any text,\n[recording]\nclock = \"none\"\n";
    return r;
  }

 private:
  int whole(int lowest, int highest) { return std::uniform_int_distribution<int>(lowest, highest)(random_); }
  bool coin() { return whole(0, 1) == 1; }
  // All magnitudes, subnormal ones and both zeros among them.
  double odd(double largest) {
    switch (whole(0, 5)) {
      case 0:
        return whole(0, 1) == 0 ? 0.0 : -0.0;
      case 1:
        return 5e-324 * whole(-3, 3);
      case 2:
        return largest * (coin() ? 1 : -1);
      case 3:
        return 0.001 * whole(-1000, 1000) * largest;
      default:
        return largest * std::uniform_real_distribution<double>(-1, 1)(random_) * std::pow(10.0, -whole(0, 30));
    }
  }
  double small(double largest) { return std::uniform_real_distribution<double>(-largest, largest)(random_); }

  void add_axes(Recording& r, std::int64_t utime, int i) {
    r.arrivals.push_back({Arrival::Channel::actuator, r.actuators.size()});
    r.actuators.push_back({utime, i, {whole(0, 4), whole(0, 4)}, small(0.2), odd(1e5), small(0.09), odd(1e5)});
  }
  void add_tip(Recording& r, std::int64_t utime, int i) {
    model::TipMeasurement m{.utime = utime, .seq = i, .camera = 3, .status = whole(0, 2)};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (whole(0, 3) == 0) continue;  // an axis that was not seen
      m.information_per_mm2(axis, axis) = std::uniform_real_distribution<double>(20, 90)(random_);
      m.position_mm[axis] = coin() ? small(40) : -0.0;
    }
    r.arrivals.push_back({Arrival::Channel::tip, r.tips.size()});
    r.tips.push_back(m);
  }
  void add_heading(Recording& r, std::int64_t utime, int i) {
    model::TipHeading m{.utime = utime, .seq = i, .camera = 15, .status = whole(0, 1)};
    if (m.status == 0 || coin()) {
      m.heading = Eigen::Vector3d(small(1), small(1), 1 + small(0.5)).normalized();
      m.information_per_rad2 = 50 * (Eigen::Matrix3d::Identity() - m.heading * m.heading.transpose());
    }
    r.arrivals.push_back({Arrival::Channel::heading, r.headings.size()});
    r.headings.push_back(m);
  }
  needle_state_t needle_state(std::int64_t utime, int i) {
    needle_state_t m{};
    m.utime = utime, m.seq = i, m.measurement_utime = utime / 2;
    for (double& v : m.position_mm) v = odd(1e5);
    const double angle = small(3);
    m.orientation_wxyz[0] = std::cos(angle), m.orientation_wxyz[2] = std::sin(angle);
    m.curvature_per_mm = odd(1), m.lambda1_per_rad = odd(1e3), m.lambda2 = odd(1e3), m.test_ratio = odd(1e12);
    m.rank = whole(0, 3), m.health = whole(0, 1000), m.reset_count = whole(0, 1000);
    for (std::size_t k = 0; k < 9; ++k) m.covariance[10 * k] = std::abs(odd(1e12));
    return m;
  }

  std::mt19937 random_;
};

std::map<std::string, std::string> files_in(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder))
    files[entry.path().filename().string()] = test::text_of(entry.path());
  return files;
}

class RoundTrip : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder / name).string(); }
  test::TemporaryFolder folder;
};

TEST_F(RoundTrip, ExportImportExportGivesTheSameBytesAndTheSameOrderOfArrival) {
  int cells_not_seen = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Recording made = Generator(seed).recording();
    write_log(made, path("made.lcm"));
    const Recording first = read_recording(path("made.lcm"));
    ASSERT_TRUE(first.intact()) << seed << ": " << first.describe_faults();
    export_csv(first, path("first"));
    write_log(import_exported(path("first")), path("again.lcm"));
    const Recording again = read_recording(path("again.lcm"));
    ASSERT_TRUE(again.intact()) << seed << ": " << again.describe_faults();
    export_csv(again, path("second"));
    ASSERT_EQ(files_in(path("first")), files_in(path("second"))) << "seed " << seed;
    ASSERT_EQ(first.arrivals.size(), again.arrivals.size());
    for (std::size_t i = 0; i < first.arrivals.size(); ++i)
      ASSERT_TRUE(first.arrivals[i].channel == again.arrivals[i].channel &&
                  first.arrivals[i].index == again.arrivals[i].index)
          << "seed " << seed;
    if (!first.tips.empty()) {
      const std::string tips = test::text_of(folder / "first/tip_measurement.csv");
      for (std::size_t at = 0; (at = tips.find(",,", at)) != std::string::npos; ++at) ++cells_not_seen;
    }
  }
  EXPECT_GT(cells_not_seen, 30) << "or the generator has no axis that was not seen";
}

TEST_F(RoundTrip, ThePrograms) {
  write_log(Generator(7).recording(), path("rec.lcm"));
  const auto run = [&](const std::string& program, const std::string& arguments) {
    const test::Said said = test::run_program(folder, program, arguments);
    EXPECT_EQ(said.status, 0) << program << ": " << said.err;
  };
  run("bevel-export", "-o " + path("csv") + " " + path("rec.lcm"));
  run("bevel-import", "-o " + path("logs") + " " + path("csv/rec") + "/");
  run("bevel-export", "-o " + path("csv2") + " " + path("logs"));
  EXPECT_EQ(files_in(path("csv/rec")), files_in(path("csv2/rec")));
  const test::Said over =
      test::run_program(folder, "bevel-import", "-o " + folder.path().string() + " " + path("csv/rec"));
  EXPECT_EQ(over.status, 1) << "it would have replaced the log itself";
  EXPECT_THAT(over.err, HasSubstr("rec.lcm: is there already"));
}

TEST_F(RoundTrip, AnExportThatReplacesOneLeavesNothingOfIt) {
  Recording full = Generator(3).recording();
  full.headings.push_back({.utime = 5, .seq = 0, .camera = 1, .status = 1});
  full.arrivals.push_back({Arrival::Channel::heading, full.headings.size() - 1});
  export_csv(full, path("csv"));
  ASSERT_TRUE(fs::exists(folder / "csv/tip_heading.csv"));
  full.headings.clear();
  std::erase_if(full.arrivals, [](const Arrival& a) { return a.channel == Arrival::Channel::heading; });
  export_csv(full, path("csv"));
  EXPECT_FALSE(fs::exists(folder / "csv/tip_heading.csv"));
}

TEST_F(RoundTrip, WhatIsNoExportIsRefusedWithItsPlace) {
  const auto refusal = [&](const std::string& name, const std::string& text) {
    fs::create_directories(folder / "csv");
    folder.write("csv/" + name, text);
    try {
      import_exported(path("csv"));
    } catch (const std::runtime_error& e) {
      return std::string(e.what());
    }
    return std::string("taken");
  };
  const std::string header = "utime,seq,mode,insertion_rate_mm_s,rotation_rate_rad_s\n";
  EXPECT_THAT(refusal("motion_command.csv", header + "1,0,7,0,0\n"),
              HasSubstr("motion_command.csv:2: readers would refuse this row (out of range"));
  EXPECT_THAT(refusal("motion_command.csv", header + "1,0,1,,0\n"),
              HasSubstr("motion_command.csv:2: column 'insertion_rate_mm_s' is '', and must be given"));
  EXPECT_THAT(refusal("motion_command.csv", header + "1.5,0,1,0,0\n"), HasSubstr("column 'utime' is '1.5', not an"));
  EXPECT_THAT(refusal("motion_command.csv", "utime,seq\n1,0\n"), HasSubstr("no column 'mode'"));
  EXPECT_THAT([&] { import_exported(folder.path().string()); },
              ::testing::ThrowsMessage<std::runtime_error>(HasSubstr("has none of the files of bevel-export")));
}

}  // namespace
}  // namespace bevel::io
