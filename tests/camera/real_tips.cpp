// SPDX-License-Identifier: MIT
#include "tests/camera/real_tips.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>

#include <bevel/drivers/camera/decode.hpp>
#include <bevel/drivers/camera/frame_source.hpp>

namespace bevel::test {

namespace fs = std::filesystem;

std::vector<TipLabel> read_labels(const fs::path& csv) {
  std::ifstream file(csv);
  if (!file) throw std::runtime_error(csv.string() + ": cannot be read");
  std::vector<TipLabel> labels;
  std::string line;
  int number = 0;
  for (bool heading = true; std::getline(file, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    if (std::exchange(heading, false)) continue;
    std::istringstream words(line);
    TipLabel l;
    std::array<std::string, 4> value;
    std::getline(words, l.set, ',');
    std::getline(words, l.folder, ',');
    std::getline(words, l.file, ',');
    for (std::string& v : value) std::getline(words, v, ',');
    try {
      l.tip_px = {std::stod(value[0]), std::stod(value[1])};
      l.across_sd_px = std::stod(value[2]);
      l.along_sd_px = std::stod(value[3]);
    } catch (const std::exception&) {
      throw std::runtime_error(csv.string() + ":" + std::to_string(number) + ": four numbers wanted: " + line);
    }
    labels.push_back(l);
  }
  return labels;
}

std::vector<SeenFrame> track_folders(const fs::path& root, const camera::TrackerConfig& config, double px_per_mm,
                                     Frames frames) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(root))
    if (entry.is_directory()) folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  std::vector<SeenFrame> seen;
  for (const fs::path& folder : folders) {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path().filename().string());
    std::sort(files.begin(), files.end(), camera::natural_less);
    camera::TipTracker tracker(config, px_per_mm);
    int64_t seq = 0;
    for (const std::string& file : files) {
      const cv::Mat gray = camera::read_gray(folder / file).gray;
      if (gray.empty()) throw std::runtime_error((folder / file).string() + ": no picture");
      ++seq;
      if (frames == Frames::alone) tracker = camera::TipTracker(config, px_per_mm);
      seen.push_back({folder.filename().string(), file, gray, tracker.track({seq * 1'000'000, seq, 0, gray})});
    }
  }
  return seen;
}

LabelFigures compare(const std::vector<TipLabel>& labels, const std::vector<SeenFrame>& seen, const std::string& set,
                     const Repeatability& second_look) {
  LabelFigures f;
  for (const TipLabel& label : labels) {
    if (label.set != set) continue;
    const auto at = std::find_if(seen.begin(), seen.end(),
                                 [&](const SeenFrame& s) { return s.folder == label.folder && s.file == label.file; });
    if (at == seen.end()) throw std::runtime_error("labelled, but not there: " + label.folder + "/" + label.file);
    ++f.labels;
    ++f.by_status.at(static_cast<size_t>(at->tip.status));
    if (at->tip.status != camera::TipStatus::ok) continue;
    ++f.ok;
    const cv::Vec2d t = at->tip.direction_px;
    const cv::Vec2d n(-t[1], t[0]);
    const cv::Vec2d e(at->tip.tip_px.x - label.tip_px.x, at->tip.tip_px.y - label.tip_px.y);
    LabelError error{&label, &*at, e.dot(n), e.dot(t), 0.0};
    const double across_sd_px = second_look.across_of_opinion * label.across_sd_px;
    const double along_sd_px = second_look.along_of_opinion * label.along_sd_px;
    const cv::Matx22d together =
        at->tip.covariance_px2 + across_sd_px * across_sd_px * (n * n.t()) + along_sd_px * along_sd_px * (t * t.t());
    error.squared = e.dot(together.inv() * e);
    f.errors.push_back(error);
    f.beyond_6_px += cv::norm(e) > 6.0 ? 1 : 0;
  }
  for (const LabelError& e : f.errors) f.squared += 0.5 * e.squared / f.ok;
  return f;
}

std::vector<PathTip> path_tips(const std::vector<SeenFrame>& seen, size_t first, size_t last) {
  std::vector<PathTip> tips;
  for (size_t i = first; i < last; ++i) {
    const camera::TipResult& tip = seen[i].tip;
    if (tip.status != camera::TipStatus::ok) continue;
    tips.push_back(
        {tip.tip_px.y / kRealPxPerMm, tip.tip_px.x / kRealPxPerMm, std::sqrt(tip.covariance_px2(0, 0)) / kRealPxPerMm});
  }
  return tips;
}

namespace {

constexpr double kStep_mm = 8.0;  // of insertion, a picture

double slope_of(const std::vector<std::array<double, 3>>& rows, double without_folder) {  // folder, x, y
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& r : rows)
    if (r[0] != without_folder) n += 1, x += r[1], y += r[2], xx += r[1] * r[1], xy += r[1] * r[2];
  return (n * xy - x * y) / (n * xx - x * x);
}

}  // namespace

Headings compare_headings(const std::vector<SeenFrame>& axis) {
  Headings h;
  std::vector<std::array<double, 3>> rows;  // folder, direction of the path, tangent less that
  int folders = 0;
  const auto a_step = [](const cv::Point2d& d) { return std::abs(cv::norm(d) / kRealPxPerMm - kStep_mm) < 1.5; };
  for (size_t i = 1; i + 1 < axis.size(); ++i) {
    if (axis[i - 1].folder != axis[i].folder) ++folders;
    if (axis[i - 1].folder != axis[i].folder || axis[i + 1].folder != axis[i].folder) continue;
    const camera::TipResult &before = axis[i - 1].tip, &tip = axis[i].tip, &after = axis[i + 1].tip;
    constexpr auto ok = camera::TipStatus::ok;
    if (before.status != ok || tip.heading_status != ok || after.status != ok) continue;
    if (!a_step(tip.tip_px - before.tip_px) || !a_step(after.tip_px - tip.tip_px)) continue;
    const cv::Point2d d = after.tip_px - before.tip_px;
    const double path_rad = std::atan2(d.x, d.y);
    const double off_rad = std::atan2(tip.direction_px[0], tip.direction_px[1]) - path_rad;
    rows.push_back({static_cast<double>(folders), path_rad, off_rad});
    h.off_mean_rad += off_rad, h.off_rms_rad += off_rad * off_rad, h.claimed_rad += tip.direction_variance_rad2;
  }
  h.tips = static_cast<int>(rows.size());
  double sum = 0.0, squares = 0.0;
  for (const auto& r : rows) sum += r[1], squares += r[1] * r[1];
  h.path_sd_rad = std::sqrt(squares / h.tips - std::pow(sum / h.tips, 2));
  h.off_mean_rad /= h.tips, h.off_rms_rad = std::sqrt(h.off_rms_rad / h.tips),
                            h.claimed_rad = std::sqrt(h.claimed_rad / h.tips);
  h.off_by_direction = slope_of(rows, -1.0);
  auto slipping = rows;
  for (auto& r : slipping) r[2] = -(0.22 * r[1] - 0.49 * r[1] * std::abs(r[1]));
  h.agar_by_direction = slope_of(slipping, -1.0);
  std::vector<double> without;
  for (int folder = 0; folder <= folders; ++folder) without.push_back(slope_of(rows, folder));
  double mean = 0.0, spread = 0.0;
  for (const double w : without) mean += w / static_cast<double>(without.size());
  for (const double w : without) spread += (w - mean) * (w - mean);
  h.off_by_direction_sd =
      std::sqrt(spread * (static_cast<double>(without.size()) - 1.0) / static_cast<double>(without.size()));
  return h;
}

Repeatability repeatability(const std::vector<TipLabel>& labels, const std::vector<TipLabel>& again) {
  Repeatability r;
  std::vector<double> across, along;
  double across_z2 = 0.0, along_z2 = 0.0, across2 = 0.0, along2 = 0.0;
  for (const TipLabel& second : again) {
    const auto first = std::find_if(labels.begin(), labels.end(), [&](const TipLabel& l) {
      return l.folder == second.folder && l.file == second.file;
    });
    if (first == labels.end()) throw std::runtime_error("looked at twice, but not there: " + second.folder);
    // Needles run down these pictures, so that columns are across.
    const cv::Point2d d = second.tip_px - first->tip_px;
    across.push_back(std::abs(d.x)), along.push_back(std::abs(d.y));
    across2 += 0.5 * d.x * d.x, along2 += 0.5 * d.y * d.y;
    across_z2 += 0.5 * d.x * d.x / (first->across_sd_px * first->across_sd_px);
    along_z2 += 0.5 * d.y * d.y / (first->along_sd_px * first->along_sd_px);
  }
  r.looks = static_cast<int>(again.size());
  if (r.looks == 0) return r;
  r.across_sd_px = std::sqrt(across2 / r.looks), r.along_sd_px = std::sqrt(along2 / r.looks);
  r.across_of_opinion = std::sqrt(across_z2 / r.looks), r.along_of_opinion = std::sqrt(along_z2 / r.looks);
  r.across_95_px = percentile(across, 0.95), r.along_95_px = percentile(along, 0.95);
  return r;
}

Interval interval_of_percentile(const std::vector<double>& values, double share) {
  if (values.empty()) return {std::nan(""), std::nan("")};
  std::mt19937_64 random(20261124);
  std::uniform_int_distribution<size_t> any(0, values.size() - 1);
  std::vector<double> found;
  for (int draw = 0; draw < 2000; ++draw) {
    std::vector<double> drawn;
    for (size_t i = 0; i < values.size(); ++i) drawn.push_back(values[any(random)]);
    found.push_back(percentile(std::move(drawn), share));
  }
  return {percentile(found, 0.025), percentile(found, 0.975)};
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values.at(static_cast<size_t>(std::lround(share * static_cast<double>(values.size() - 1))));
}

void print(const char* name, const LabelFigures& f) {
  std::vector<double> across, along;
  double mean_across = 0.0, mean_along = 0.0;
  for (const LabelError& e : f.errors) {
    across.push_back(std::abs(e.across_px));
    along.push_back(std::abs(e.along_px));
    mean_across += e.across_px, mean_along += e.along_px;
  }
  const double n = std::max(1, f.ok);
  std::printf("%s: %d labelled, %d found", name, f.labels, f.ok);
  for (size_t k = 1; k < f.by_status.size(); ++k)
    if (f.by_status[k] != 0)
      std::printf(", %d %s", f.by_status[k], std::string(camera::name_of(static_cast<camera::TipStatus>(k))).c_str());
  const auto line = [&](const char* axis, const std::vector<double>& px, double mean) {
    const Interval i = interval_of_percentile(px, 0.95);
    std::printf("\n  %s px: median %.2f, 95 %% %.2f (%.2f to %.2f drawn again), largest %.2f, mean %+.2f", axis,
                percentile(px, 0.5), percentile(px, 0.95), i.low, i.high, percentile(px, 1.0), mean);
  };
  line("across", across, mean_across / n);
  line("along", along, mean_along / n);
  std::printf("\n  beyond 6 px and called ok: %d; normalised squared error / 2: %.2f\n", f.beyond_6_px, f.squared);
}

}  // namespace bevel::test
