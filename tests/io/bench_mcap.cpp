// SPDX-License-Identifier: MIT
// bench_mcap [SECONDS] [ROUNDS]: how fast MCAP is written and read, beside cp of the same file and beside what of it is
// a floor: the digits of the same numbers alone, and the CRC-32 of the same bytes. MB of the .mcap file by seconds of
// one processor (other processes may have the others), the median of the rounds. Seed 1.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <tuple>
#include <vector>

#include <bevel/io/csv_export.hpp>
#include <bevel/io/json_message.hpp>
#include <bevel/io/mcap_container.hpp>
#include <bevel/io/mcap_export.hpp>
#include <bevel/io/messages.hpp>

namespace {

using namespace bevel;
namespace fs = std::filesystem;

// A rig with its axes at 100 Hz, two cameras that see tip and heading at 30 Hz, and an estimator at 20 Hz; every number
// with all its digits, as measured ones have them.
io::Recording make_recording(int seconds) {
  io::Recording r;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100 * seconds; ++i) {
    const std::int64_t utime = 1'700'000'000'000'000 + std::int64_t{10'000} * i;
    r.arrivals.push_back({io::Arrival::Channel::actuator, r.actuators.size()});
    // Moves that axes can make from one reading to the next.
    r.actuators.push_back(
        {utime, i, {2, 2}, 0.1 * normal(random), normal(random), 0.01 * normal(random), normal(random)});
    if (i % 3 == 0) {
      model::TipMeasurement tip{.utime = utime, .seq = i / 3, .camera = i % 2};
      tip.position_mm = Eigen::Vector3d::NullaryExpr([&] { return normal(random); });
      tip.information_per_mm2.diagonal() << 44 + normal(random), 44 + normal(random), 26 + normal(random);
      r.arrivals.push_back({io::Arrival::Channel::tip, r.tips.size()});
      r.tips.push_back(tip);
      model::TipHeading heading{.utime = utime, .seq = i / 3, .camera = i % 2};
      heading.heading = Eigen::Vector3d(0.1 * normal(random), 0.1 * normal(random), 1).normalized();
      heading.information_per_rad2 =
          2500 * (Eigen::Matrix3d::Identity() - heading.heading * heading.heading.transpose());
      r.arrivals.push_back({io::Arrival::Channel::heading, r.headings.size()});
      r.headings.push_back(heading);
    }
    if (i % 5 == 0) {
      needle_state_t state{};
      state.utime = utime, state.seq = i / 5, state.measurement_utime = utime;
      for (double& value : state.position_mm) value = normal(random);
      state.orientation_wxyz[0] = 1;
      state.curvature_per_mm = 0.0047 + 1e-5 * normal(random);
      for (std::size_t row = 0; row < 9; ++row)
        for (std::size_t column = 0; column <= row; ++column)
          state.covariance[9 * row + column] = state.covariance[9 * column + row] =
              row == column ? 1 + std::abs(normal(random)) : 1e-3 * normal(random);
      r.estimates.push_back(state);
    }
  }
  return r;
}

double cpu_s(int whose) {
  rusage used{};
  getrusage(whose, &used);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(used.ru_utime) + s(used.ru_stime);
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

struct Work {
  const char* name;
  std::function<void()> run;
  int whose = RUSAGE_SELF;
  std::vector<double> took_s{};
};

}  // namespace

int main(int argc, char** argv) {
  const int seconds = argc > 1 ? std::atoi(argv[1]) : 1800, rounds = argc > 2 ? std::atoi(argv[2]) : 7;
  const fs::path here = fs::temp_directory_path() / ("bench_mcap." + std::to_string(::getpid()));
  fs::create_directories(here);
  const std::string log = here / "rec.lcm", mcap = here / "rec.mcap", back = here / "back.lcm", copy = here / "copy";
  io::write_log(make_recording(seconds), log);
  const io::Recording recording = io::read_recording(log);
  std::fputs(recording.remarks("damaged").c_str(), stderr);
  io::export_mcap(recording, mcap);
  const std::string bytes = text_of(mcap);

  // The same numbers as in the file, as numbers and as text.
  std::vector<double> numbers;
  std::string digits;
  std::vector<std::size_t> ends;
  io::import_mcap(bytes);
  for (std::size_t at = 0; (at = bytes.find("\":", at)) != std::string::npos;) {
    at += 2;
    double value = 0;
    const auto [end, error] = std::from_chars(bytes.data() + at, bytes.data() + bytes.size(), value);
    if (error != std::errc()) continue;
    numbers.push_back(value);
    digits.append(bytes.data() + at, end);
    ends.push_back(digits.size());
  }
  volatile double sum = 0;
  std::vector<Work> works{
      {"log to MCAP", [&] { io::export_mcap(io::read_recording(log), mcap); }},
      {"  of it, the MCAP", [&] { io::export_mcap(recording, mcap); }},
      {"MCAP to log", [&] { io::write_log(io::import_mcap_file(mcap).recording, back); }},
      {"  of it, the MCAP", [&] { io::import_mcap_file(mcap); }},
      {"cp", [&] { std::ignore = std::system(("cp " + mcap + " " + copy).c_str()); }, RUSAGE_CHILDREN},
      {"to_chars alone",
       [&] {
         std::array<char, 32> text;
         for (const double n : numbers) sum = sum + *(std::to_chars(text.data(), text.data() + 32, n).ptr - 1);
       }},
      {"from_chars alone",
       [&] {
         std::size_t at = 0;
         for (const std::size_t end : ends) {
           double value = 0;
           std::from_chars(digits.data() + at, digits.data() + end, value);
           sum = sum + value;
           at = end;
         }
       }},
      {"CRC-32 alone", [&] { sum = sum + io::mcap::crc32_of(bytes); }}};
  for (int round = 0; round < rounds; ++round)
    for (Work& work : works) {
      const double before_s = cpu_s(work.whose);
      work.run();
      work.took_s.push_back(cpu_s(work.whose) - before_s);
    }
  const bool same = text_of(log) == text_of(back);
  const double size_mb = static_cast<double>(bytes.size()) * 1e-6;
  const std::size_t messages = recording.arrivals.size() + recording.estimates.size();
  std::printf("%zu messages, %.0f MB of MCAP, %.0f MB of log, %zu numbers; %d rounds; the log back is %s\n", messages,
              size_mb, static_cast<double>(fs::file_size(log)) * 1e-6, numbers.size(), rounds,
              same ? "the same bytes" : "ANOTHER");
  for (Work& work : works) {
    std::ranges::sort(work.took_s);
    const double median_s = work.took_s[work.took_s.size() / 2];
    std::printf("  %-20s %6.2f s  %6.0f MB/s  (%.0f to %.0f)  %6.2f us a message\n", work.name, median_s,
                size_mb / std::max(median_s, 1e-6), size_mb / std::max(work.took_s.back(), 1e-6),
                size_mb / std::max(work.took_s.front(), 1e-6), 1e6 * median_s / static_cast<double>(messages));
  }
  fs::remove_all(here);
  return same ? 0 : 1;
}
