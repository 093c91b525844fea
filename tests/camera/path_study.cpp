// SPDX-License-Identifier: MIT
// Planar models fitted to the tips of real pictures, held out by frame: path_study FOLDER_OF_FOLDERS OUT. A table on
// stdout; into OUT one picture a folder, its last frame with the tips (yellow), the bicycle's path (green) and that of
// the extended model with the slip of agar (red, thin), both fitted to all frames but the last four and drawn on.
#include <array>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/camera/path_fit.hpp"
#include "tests/camera/real_tips.hpp"

namespace {

using namespace bevel::test;  // NOLINT(google-build-using-namespace)

constexpr int kPredicted = 4;

void draw(const std::string& file, const cv::Mat& gray, const std::vector<PathTip>& tips) {
  cv::Mat out;
  cv::cvtColor(gray, out, cv::COLOR_GRAY2BGR);
  const auto place = [](double aside_mm, double depth_mm) {
    return cv::Point(cvRound(aside_mm * kRealPxPerMm), cvRound(depth_mm * kRealPxPerMm));
  };
  const std::vector<PathTip> known(tips.begin(), tips.end() - kPredicted);
  for (const auto& [model, colour] :
       {std::pair{PathModel::agar, cv::Scalar(0, 0, 255)}, {PathModel::bicycle, cv::Scalar(0, 200, 0)}}) {
    const PathFit fit = fit_path(known, model);
    const int steps = cvCeil(tips.back().depth_mm - tips.front().depth_mm);
    for (int i = 0; i < steps; ++i) {
      const double z = tips.front().depth_mm + i;
      cv::line(out, place(fit.aside_mm(z), z), place(fit.aside_mm(z + 1.0), z + 1.0), colour, 1, cv::LINE_AA);
    }
  }
  for (const PathTip& t : tips) cv::circle(out, place(t.aside_mm, t.depth_mm), 3, {0, 220, 255}, 1, cv::LINE_AA);
  cv::imwrite(file, out);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: path_study FOLDER_OF_FOLDERS OUT\n");
    return 2;
  }
  std::filesystem::create_directories(argv[2]);
  const auto seen = track_folders(argv[1], real_config(), kRealPxPerMm);
  std::printf(
      "| folder | tips | 1000 k, bicycle | each left out, RMS mm: line, bicycle, agar, free | last four: the same | "
      "lambda1, lambda2 |\n| --- | --- | --- | --- | --- | --- |\n");
  std::array<std::vector<double>, std::size(kPathModels)> each, ahead;
  for (size_t first = 0, last = 0; first < seen.size(); first = last) {
    while (last < seen.size() && seen[last].folder == seen[first].folder) ++last;
    const auto tips = path_tips(seen, first, last);
    const PathFit bicycle = fit_path(tips, PathModel::bicycle), free = fit_path(tips, PathModel::extended);
    std::printf("| %s | %zu | %.2f +- %.2f |", seen[first].folder.c_str(), tips.size(), 1000.0 * bicycle.p[2],
                1000.0 * bicycle.sd[2]);
    for (const PathModel model : kPathModels) std::printf(" %.2f", rms(each_left_out(tips, model)));
    std::printf(" |");
    for (const PathModel model : kPathModels) std::printf(" %.2f", rms(last_left_out(tips, model, kPredicted)));
    std::printf(" | %.2f +- %.2f, %.2f +- %.2f |\n", free.p[3], free.sd[3], free.p[4], free.sd[4]);
    for (size_t m = 0; m < std::size(kPathModels); ++m) {
      const auto one = each_left_out(tips, kPathModels[m]), four = last_left_out(tips, kPathModels[m], kPredicted);
      each[m].insert(each[m].end(), one.begin(), one.end()), ahead[m].insert(ahead[m].end(), four.begin(), four.end());
    }
    draw(std::filesystem::path(argv[2]) / (seen[first].folder + ".png"), seen[last - 1].gray, tips);
  }
  std::printf("| all | %zu | |", each[0].size());
  for (const auto& off_mm : each) std::printf(" %.2f", rms(off_mm));
  std::printf(" |");
  for (const auto& off_mm : ahead) std::printf(" %.2f", rms(off_mm));
  std::printf(" | |\n");
  auto config = real_config();
  config.tip_point = bevel::camera::TipPoint::axis;
  know_bevel(config);
  const Headings h = compare_headings(track_folders(argv[1], config, kRealPxPerMm));
  std::printf(
      "\nheading less the path's direction, %d tips: %+.3f rad on average, growing by %+.3f +- %.3f of it; by the slip "
      "of "
      "agar %+.3f\n",
      h.tips, h.off_mean_rad, h.off_by_direction, h.off_by_direction_sd, h.agar_by_direction);
}
