// SPDX-License-Identifier: MIT
// Table I's question on real tissue: bicycle against extended model, fitted on two insertions and tested on the third.
// Data: 12 hand-pushed insertions (Bernardes et al. 2023; no licence, hence not part of this project), looked for in
// $BEVEL_SHARED or <source>/../shared. Without them the program says so and ends with status 0.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/candidates.hpp>
#include "tests/support/shared_recordings.hpp"

namespace {
using namespace bevel;
using namespace bevel::diagnosis;
namespace fs = std::filesystem;

constexpr double kTrackerSigma_mm = 0.1;  // 0.06-0.09 stated by the source's noise; rounded up

// Settled tip positions of one insertion in the stage's frame: x, z lateral, depth along -y, from the entry point.
std::vector<Eigen::Vector3d> read_tips(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::map<std::string, std::size_t> column;
  std::size_t count = 0;
  std::istringstream names(line);
  for (std::string name; std::getline(names, name, ','); ++count) {
    name.erase(0, name.find_first_not_of(' '));
    column.emplace(name, count);
  }
  std::vector<Eigen::Vector3d> tips;
  while (std::getline(file, line)) {
    std::vector<double> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::atof(cell.c_str()));
    if (row.size() < count) continue;
    const auto at = [&](const char* name) { return row[column.at(name)]; };
    if (at("Entry_point y") == 0 && at("Entry_point x") == 0) continue;  // not in yet
    const double depth_mm = at("Entry_point y") - at("Tip y");
    if (depth_mm > 0.5) tips.emplace_back(at("Tip x") - at("Base x"), at("Tip z") - at("Base z"), depth_mm);
  }
  // The pusher swings back a little after each push: in order of depth the needle only goes in.
  std::sort(tips.begin(), tips.end(), [](const auto& a, const auto& b) { return a.z() < b.z(); });
  return tips;
}

// Into {A}: origin at `origin` (lateral), bending direction -> -y. Depth stands in for the commanded insertion, which
// leads and lags the tip by millimetres here: only the lateral position at a depth is compared.
Insertion to_insertion(const std::string& name, const std::vector<Eigen::Vector3d>& tips, const Eigen::Vector2d& origin,
                       const Eigen::Vector2d& bend) {
  const double length_mm = tips.back().z();
  const double end_mm = (tips.back().head<2>() - origin).norm();
  std::vector<model::ActuatorState> actuators(1);
  std::vector<model::TipMeasurement> measurements;
  actuators[0].utime = 1;
  for (const auto& tip : tips) {
    // Arc length of a nearly parabolic path of this end deflection.
    const double arc_mm = tip.z() + 2.0 / 3.0 * end_mm * end_mm / length_mm * std::pow(tip.z() / length_mm, 3);
    model::ActuatorState a;
    a.utime = actuators.back().utime + 500'000;
    a.insertion_mm = std::max(arc_mm, actuators.back().insertion_mm);
    actuators.push_back(a);
    model::TipMeasurement m;
    m.utime = a.utime;
    const Eigen::Vector2d d = tip.head<2>() - origin;
    // y_A = -bend, z_A = -y of the stage, x_A completes: for stage axes (x, z) this is the lateral rotation below.
    m.position_mm = {-(d.x() * bend.y() - d.y() * bend.x()), -d.dot(bend), tip.z()};
    m.information_per_mm2 =
        Eigen::Vector3d(1, 1, 0).asDiagonal().toDenseMatrix() / (kTrackerSigma_mm * kTrackerSigma_mm);
    measurements.push_back(m);
  }
  return make_insertion(name, actuators, measurements);
}

struct Variant {
  const char* name;
  bool extended;
  double tilt_rad;  // standard deviation of the entry's tilt; 0 holds it at the nominal axis
  model::FrontWheel wheel = model::FrontWheel::published;
};

FitOptions options_for(const Variant& v) {
  FitOptions o;
  o.start.curvature_per_mm = 0.0015;
  o.start.lambda1_per_rad = 0.144;
  o.start.lambda2 = 0.032;
  o.start.front_wheel = v.wheel;
  o.entry_sigma(kEntryOffsetX) = o.entry_sigma(kEntryOffsetY) = 0.7;
  o.entry_sigma(kEntryTiltX) = o.entry_sigma(kEntryTiltY) = v.tilt_rad;
  return v.extended ? o : bicycle_options(o);
}

struct Figures {
  double squares = 0, largest = 0;
  std::size_t count = 0;
  void add(const ErrorFigures& f) {
    squares += f.rms_mm * f.rms_mm * static_cast<double>(f.count);
    count += f.count;
    largest = std::max(largest, f.largest_mm);
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / static_cast<double>(count)); }
};

void study_tissue(const fs::path& folder, const std::string& tissue) {
  std::vector<std::vector<Eigen::Vector3d>> tips;
  for (int i = 1; i <= 3; ++i)
    tips.push_back(read_tips(folder / (tissue + "_openloop_0" + std::to_string(i) + ".csv")));

  // Shape without a model: lateral deflection in the bending plane as a cubic of depth (offset, slope, curvature,
  // third).
  for (std::size_t i = 0; i < tips.size(); ++i) {
    const Eigen::Vector2d bend = (tips[i].back() - tips[i].front()).head<2>().normalized();
    const auto n = static_cast<Eigen::Index>(tips[i].size());
    Eigen::MatrixX4d A(n, 4);
    Eigen::VectorXd b(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double s = tips[i][static_cast<std::size_t>(k)].z() / 100;
      A.row(k) << 1, s, s * s, s * s * s;
      b(k) = tips[i][static_cast<std::size_t>(k)].head<2>().dot(bend);
    }
    const Eigen::Vector4d c = (A.transpose() * A).ldlt().solve(A.transpose() * b);
    const double sigma = (A * c - b).norm() / std::sqrt(static_cast<double>(n - 4));
    const Eigen::Matrix4d cov = (A.transpose() * A).inverse() * sigma * sigma;
    std::printf(
        "  %s %zu: per 100 mm: slope %6.2f +- %.2f  square %6.2f +- %.2f  cube %6.2f +- %.2f mm, residual %.2f mm\n",
        tissue.c_str(), i + 1, c(1), std::sqrt(cov(1, 1)), c(2), std::sqrt(cov(2, 2)), c(3), std::sqrt(cov(3, 3)),
        sigma);
  }

  for (const Variant& v : {Variant{"bicycle, entry square", false, 0}, Variant{"extended, entry square", true, 0},
                           Variant{"bicycle, entry tilted", false, 0.03}, Variant{"extended, entry tilted", true, 0.03},
                           Variant{"nonslip, entry square", true, 0, model::FrontWheel::nonslip},
                           Variant{"nonslip, entry tilted", true, 0.03, model::FrontWheel::nonslip}}) {
    Figures in, out, out_own_entry;
    std::string lambdas;
    for (std::size_t held = 0; held < 3; ++held) {
      // Origin and bending plane come from the insertions that are fitted.
      Eigen::Vector2d origin = Eigen::Vector2d::Zero();
      Eigen::Vector2d bend = Eigen::Vector2d::Zero();
      for (std::size_t i = 0; i < 3; ++i) {
        if (i == held) continue;
        origin += 0.5 * tips[i].front().head<2>();
        bend += (tips[i].back() - tips[i].front()).head<2>();
      }
      bend.normalize();
      std::vector<Insertion> fitted;
      for (std::size_t i = 0; i < 3; ++i)
        if (i != held) fitted.push_back(to_insertion(tissue, tips[i], origin, bend));
      const FitOptions options = options_for(v);
      const FitResult fit = fit_from_many_starts(fitted, options);
      for (std::size_t i = 0; i < 2; ++i)
        in.add(error_figures({fitted[i]}, fit.needle, Compare::same_insertion, {fit.entries[i]}));
      // Held out: the entry is what the two others had on average, nothing of the third is used.
      const Insertion third = to_insertion(tissue, tips[held], origin, bend);
      const Entry mean = 0.5 * (fit.entries[0] + fit.entries[1]);
      out.add(error_figures({third}, fit.needle, Compare::same_insertion, {mean}));
      // And with its own entry fitted, needle held: what is left is the needle's.
      FitOptions entry_only = options;
      entry_only.start = fit.needle;
      entry_only.fitted = {};
      const FitResult own = fit_trajectory({third}, entry_only);
      out_own_entry.add(error_figures({third}, fit.needle, Compare::same_insertion, own.entries));
      char text[160];
      const bool bound = v.extended && fit.find(kNeedleLambda1)->at_bound;
      std::snprintf(text, sizeof text, "  [k %.4f l1 %.2f l2 %.2f%s open %d]", fit.needle.curvature_per_mm,
                    fit.needle.lambda1_per_rad, fit.needle.lambda2, bound ? " BOUND" : "", fit.unfixed_directions());
      lambdas += text;
    }
    std::printf("| %-8s | %-22s | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |%s\n", tissue.c_str(), v.name, in.rms(),
                in.largest, out.rms(), out.largest, out_own_entry.rms(), out_own_entry.largest, lambdas.c_str());
  }
}
}  // namespace

int main() {
  const fs::path folder = bevel::test::shared_recordings() / "real" / "bwh";
  if (!fs::exists(folder)) {
    std::printf("%s: not there; the real recordings are not part of this project\n", folder.c_str());
    return 0;
  }
  std::printf(
      "tissue, model, fitted RMS and largest, held-out RMS and largest, held-out with its own entry RMS and largest "
      "(mm)\n");
  for (const char* tissue : {"exvivo", "phantomA", "phantomB", "phantomC"}) study_tissue(folder, tissue);
  return 0;
}
