// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <cstdio>
#include <filesystem>
#include <ostream>

#include <bevel/analysis/replay/batch.hpp>
#include <bevel/error.hpp>
#include <bevel/io/find_logs.hpp>

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;

struct CaseFigures {
  std::array<NoiseColour, 3> noise;
  ChiSquareMean raw;    // as the camera states its noise
  ChiSquareMean white;  // after its measured colour and size
  int series = 0, coloured = 0;
  std::int64_t rejected = 0, measurements = 0;
  int status = 0;  // of the program: whether logs were damaged
};

CaseFigures figures_of(const std::string& folder, const BatchOptions& options, std::ostream& err) {
  const auto logs = io::find_logs({folder});
  BatchOptions own = options;
  own.model_path = (fs::path(folder) / "model.toml").string();
  const ReplaySetup setup = load_setup(own);
  CaseFigures result;
  ReplayOptions calibrated;
  calibrated.effects = setup.effects;
  calibrated.discrepancies = setup.discrepancies;
  const auto first = replay_logs(logs, setup.config, calibrated);
  result.status = tell_damage(first, err);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<std::vector<AxisSample>> readings;
    readings.reserve(first.size());
    for (const Replay& replay : first) readings.push_back(axis_samples(replay, axis));
    result.noise[static_cast<std::size_t>(axis)] = measure_noise(readings);
  }
  calibrated.noise_by_axis.assign(result.noise.begin(), result.noise.end());
  for (const Replay& replay : first) {
    const InnovationFigures f = innovation_figures(replay);
    result.raw.sum += f.nis.sum, result.raw.degrees += f.nis.degrees;
  }
  for (const Replay& replay : replay_logs(logs, setup.config, calibrated)) {
    const InnovationFigures f = innovation_figures(replay);
    result.rejected += f.rejected, result.measurements += f.measurements;
    for (int axis = 0; axis < 3; ++axis) {
      const auto& noise = result.noise[static_cast<std::size_t>(axis)];
      if (!(noise.sd_mm > 0)) continue;
      const auto white = whiten(axis_innovations(replay, axis), noise);
      for (const double u : white) result.white.add(u * u, 1);
      ++result.series;
      if (ljung_box(white).p_value < 0.01) ++result.coloured;
    }
  }
  return result;
}

}  // namespace

int run_cases(const BatchOptions& options, std::ostream& out, std::ostream& err) {
  std::vector<std::string> folders;
  for (const std::string& path : options.paths) {
    if (!fs::is_directory(path)) throw IoError(path + ": no such folder of cases");
    for (const auto& entry : fs::directory_iterator(path))
      if (fs::exists(entry.path() / "model.toml")) folders.push_back(entry.path().string());
  }
  if (folders.empty()) throw IoError(options.paths.front() + ": holds no case (a folder with model.toml)");
  std::sort(folders.begin(), folders.end());
  out << "case      noise x y z (mm)    rho x y z          NIS as stated  NIS calibrated [95 % band]  not white  "
         "rejected   consistent\n";
  int status = 0;
  for (const std::string& folder : folders) {
    const CaseFigures f = figures_of(folder, options, err);
    status = std::max(status, f.status);
    // Series that fail a test at 1 % although they are white: as many as happen by chance 99 times in 100.
    const boost::math::binomial by_chance(std::max(1, f.series), 0.01);
    const bool white = f.coloured <= boost::math::quantile(boost::math::complement(by_chance, 0.01));
    const bool consistent = white && f.white.in_band();
    char line[320];
    std::snprintf(
        line, sizeof line,
        "%-8s  %.3f %.3f %.3f   %.2f %.2f %.2f   %8.3f       %8.3f [%.3f, %.3f]     %3d of %-3d  %4lld/%-5lld %s\n",
        fs::path(folder).filename().c_str(), f.noise[0].sd_mm, f.noise[1].sd_mm, f.noise[2].sd_mm, f.noise[0].rho,
        f.noise[1].rho, f.noise[2].rho, f.raw.mean(), f.white.mean(), f.white.lowest(), f.white.highest(), f.coloured,
        f.series, static_cast<long long>(f.rejected), static_cast<long long>(f.measurements),
        consistent ? "yes" : "NO");
    out << line;
  }
  return status;
}

}  // namespace bevel::analysis
