// SPDX-License-Identifier: MIT
// Detections on real frames, to be looked at: one tile a labelled frame. Green: where the tip was found and the two
// standard deviations that are claimed; yellow: the label; red frame: not ok.
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "tests/camera/real_tips.hpp"

namespace {

constexpr int kCrop_px = 72;
constexpr int kZoom = 3;

cv::Mat tile(const bevel::test::TipLabel& label, const bevel::test::SeenFrame& seen) {
  const cv::Point corner(cvRound(label.tip_px.x) - kCrop_px / 2, cvRound(label.tip_px.y) - kCrop_px / 2);
  cv::Mat wide, out;
  cv::copyMakeBorder(seen.gray, wide, kCrop_px, kCrop_px, kCrop_px, kCrop_px, cv::BORDER_CONSTANT);
  const cv::Mat crop = wide(cv::Rect(corner + cv::Point(kCrop_px, kCrop_px), cv::Size(kCrop_px, kCrop_px)));
  cv::resize(crop, out, {}, kZoom, kZoom, cv::INTER_CUBIC);
  cv::normalize(out, out, 0, 255, cv::NORM_MINMAX);
  cv::cvtColor(out, out, cv::COLOR_GRAY2BGR);
  const auto place = [&](const cv::Point2d& p) {
    return cv::Point(cvRound((p.x - corner.x + 0.5) * kZoom - 0.5), cvRound((p.y - corner.y + 0.5) * kZoom - 0.5));
  };
  cv::circle(out, place(label.tip_px), 4, {0, 220, 255}, 1, cv::LINE_AA);
  const bool ok = seen.tip.status == bevel::camera::TipStatus::ok;
  if (ok) {
    cv::Matx22d vectors;
    cv::Vec2d values;
    cv::eigen(seen.tip.covariance_px2, values, vectors);
    const cv::Size axes(cvRound(2.0 * kZoom * std::sqrt(values[0])), cvRound(2.0 * kZoom * std::sqrt(values[1])));
    const double angle_deg = std::atan2(vectors(0, 1), vectors(0, 0)) * 180.0 / CV_PI;
    cv::ellipse(out, place(seen.tip.tip_px), axes, angle_deg, 0.0, 360.0, {0, 200, 0}, 1, cv::LINE_AA);
    cv::drawMarker(out, place(seen.tip.tip_px), {0, 200, 0}, cv::MARKER_CROSS, 7);
  }
  cv::rectangle(out, {0, 0}, {out.cols - 1, out.rows - 1}, ok ? cv::Scalar(60, 60, 60) : cv::Scalar(0, 0, 255));
  const std::string name = label.folder + " " + label.file.substr(0, label.file.find('.'));
  cv::putText(out, name, {2, 9}, cv::FONT_HERSHEY_PLAIN, 0.6, {0, 0, 255});
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    std::fprintf(stderr, "usage: tip_sheet FOLDER_OF_FOLDERS LABELS.csv OUT.png [tuned|held_out]\n");
    return 2;
  }
  const auto labels = bevel::test::read_labels(argv[2]);
  const auto seen = bevel::test::track_folders(argv[1], bevel::test::real_config(), bevel::test::kRealPxPerMm);
  std::vector<cv::Mat> rows;
  constexpr size_t columns = 8;
  std::vector<cv::Mat> row;
  for (const auto& label : labels) {
    if (argc == 5 && label.set != argv[4]) continue;
    for (const auto& s : seen)
      if (s.folder == label.folder && s.file == label.file) row.push_back(tile(label, s));
    if (row.size() < columns) continue;
    cv::hconcat(row, rows.emplace_back());
    row.clear();
  }
  if (!row.empty()) {
    row.resize(columns, cv::Mat::zeros(row.front().size(), row.front().type()));
    cv::hconcat(row, rows.emplace_back());
  }
  cv::Mat sheet;
  cv::vconcat(rows, sheet);
  return cv::imwrite(argv[3], sheet) ? 0 : 1;
}
