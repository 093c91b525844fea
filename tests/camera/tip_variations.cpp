// SPDX-License-Identifier: MIT
// Real frames changed as other cameras, lights and mountings would change them: what of them is found still, and how
// far from the labels, which are changed alike. Frames alone, each through a tracker that has seen nothing else.
// tip_variations FOLDER_OF_FOLDERS LABELS.csv [tuned|held_out]; errors in px of the frames as they are.
#include <cmath>
#include <cstdio>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>

#include <bevel/drivers/camera/decode.hpp>
#include "tests/camera/real_tips.hpp"

namespace {

using bevel::camera::EntrySide;

struct Variation {
  std::string name;
  std::function<cv::Mat(const cv::Mat&)> picture;
  std::function<cv::Point2d(const cv::Point2d&, const cv::Size&)> place = [](const cv::Point2d& p, const cv::Size&) {
    return p;
  };
  EntrySide side = EntrySide::top;
  double scale = 1.0;
};

Variation light(const std::string& name, const std::function<double(double)>& of_gray) {
  cv::Mat table(1, 256, CV_8UC1);
  for (int g = 0; g < 256; ++g) table.at<uchar>(g) = cv::saturate_cast<uchar>(of_gray(g));
  return {name, [table](const cv::Mat& in) {
            cv::Mat out;
            cv::LUT(in, table, out);
            return out;
          }};
}

Variation scaled(double scale) {
  Variation v{"scaled by " + std::to_string(scale).substr(0, 3), [scale](const cv::Mat& in) {
                cv::Mat out;
                cv::resize(in, out, {}, scale, scale, scale < 1.0 ? cv::INTER_AREA : cv::INTER_CUBIC);
                return out;
              }};
  v.place = [scale](const cv::Point2d& p, const cv::Size&) {
    return cv::Point2d((p.x + 0.5) * scale - 0.5, (p.y + 0.5) * scale - 0.5);
  };
  v.scale = scale;
  return v;
}

Variation turned(const std::string& name, cv::RotateFlags how, EntrySide side) {
  Variation v{name, [how](const cv::Mat& in) {
                cv::Mat out;
                cv::rotate(in, out, how);
                return out;
              }};
  v.place = [how](const cv::Point2d& p, const cv::Size& size) {
    const double w = size.width - 1.0, h = size.height - 1.0;
    return how == cv::ROTATE_90_CLOCKWISE ? cv::Point2d(h - p.y, p.x)
           : how == cv::ROTATE_180        ? cv::Point2d(w - p.x, h - p.y)
                                          : cv::Point2d(p.y, w - p.x);
  };
  v.side = side;
  return v;
}

std::vector<Variation> variations() {
  const auto as_it_is = [](const cv::Mat& in) { return in; };
  Variation mirrored{"left to right", [](const cv::Mat& in) {
                       cv::Mat out;
                       cv::flip(in, out, 1);
                       return out;
                     }};
  mirrored.place = [](const cv::Point2d& p, const cv::Size& s) { return cv::Point2d(s.width - 1.0 - p.x, p.y); };
  const auto jpeg = [](int quality) {
    return Variation{"JPEG quality " + std::to_string(quality), [quality](const cv::Mat& in) {
                       std::vector<uchar> bytes;
                       cv::imencode(".jpg", in, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
                       return bevel::camera::decode_gray(bytes).gray;
                     }};
  };
  const Variation noisy{"noise of 5 gray", [](const cv::Mat& in) {
                          cv::Mat noise(in.size(), CV_16SC1), out;
                          cv::RNG random(20261124);
                          random.fill(noise, cv::RNG::NORMAL, 0.0, 5.0);
                          cv::add(in, noise, out, cv::noArray(), CV_8U);
                          return out;
                        }};
  const Variation soft{"blurred by 1.5 px", [](const cv::Mat& in) {
                         cv::Mat out;
                         cv::GaussianBlur(in, out, {}, 1.5);
                         return out;
                       }};
  return {{"as they are", as_it_is},
          mirrored,
          turned("turned right", cv::ROTATE_90_CLOCKWISE, EntrySide::right),
          turned("on their head", cv::ROTATE_180, EntrySide::bottom),
          turned("turned left", cv::ROTATE_90_COUNTERCLOCKWISE, EntrySide::left),
          light("brighter by 40", [](double g) { return g + 40.0; }),
          light("darker by 40", [](double g) { return g - 40.0; }),
          light("contrast 0.6", [](double g) { return 128.0 + 0.6 * (g - 128.0); }),
          light("contrast 1.5", [](double g) { return 128.0 + 1.5 * (g - 128.0); }),
          light("gamma 0.6", [](double g) { return 255.0 * std::pow(g / 255.0, 0.6); }),
          light("gamma 1.6", [](double g) { return 255.0 * std::pow(g / 255.0, 1.6); }),
          scaled(0.7),
          scaled(1.5),
          scaled(2.5),
          jpeg(30),
          jpeg(10),
          noisy,
          soft};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: tip_variations FOLDER_OF_FOLDERS LABELS.csv [tuned|held_out]\n");
    return 2;
  }
  using namespace bevel;
  const std::string set = argc == 4 ? argv[3] : "tuned";
  const bool list = set == "tuned";  // held-out frames are not to be worked on
  const auto labels = test::read_labels(argv[2]);
  std::printf(
      "| %s | ok | not ok | across 50, 95 %%, largest | along 50, 95 %%, largest | beyond 6 px and ok | squared / 2 "
      "|\n",
      set.c_str());
  std::printf("| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Variation& v : variations()) {
    std::vector<double> across, along;
    std::string refused;
    int ok = 0, beyond = 0;
    double squared = 0.0;
    for (const test::TipLabel& label : labels) {
      if (label.set != set) continue;
      const cv::Mat gray = bevel::camera::read_gray(std::filesystem::path(argv[1]) / label.folder / label.file).gray;
      if (gray.empty()) {
        std::fprintf(stderr, "tip_variations: %s/%s is no picture\n", label.folder.c_str(), label.file.c_str());
        return 1;
      }
      camera::TrackerConfig config = test::real_config();
      config.entry_side = v.side;
      camera::TipTracker tracker(config, test::kRealPxPerMm * v.scale);
      const camera::TipResult tip = tracker.track({1, 0, 0, v.picture(gray)});
      if (tip.status != camera::TipStatus::ok) {
        refused += " " + std::string(camera::name_of(tip.status));
        if (list)
          std::fprintf(stderr, "%s: %s %s: %s\n", v.name.c_str(), label.folder.c_str(), label.file.c_str(),
                       std::string(tip.reason).c_str());
        continue;
      }
      ++ok;
      const cv::Point2d off = tip.tip_px - v.place(label.tip_px, gray.size());
      const cv::Vec2d e = cv::Vec2d(off.x, off.y) / v.scale, t = tip.direction_px, n(-t[1], t[0]);
      across.push_back(std::abs(e.dot(n))), along.push_back(std::abs(e.dot(t)));
      beyond += cv::norm(e) > 6.0 ? 1 : 0;
      if (list && cv::norm(e) > 6.0)
        std::fprintf(stderr, "%s: %s %s: off by %.1f px across and %.1f along, claimed %.1f along\n", v.name.c_str(),
                     label.folder.c_str(), label.file.c_str(), e.dot(n), e.dot(t),
                     std::sqrt(t.dot(tip.covariance_px2 * t)) / v.scale);
      const cv::Matx22d claimed =
          tip.covariance_px2 * (1.0 / (v.scale * v.scale)) + 0.58 * 0.58 * (n * n.t()) + 0.81 * 0.81 * (t * t.t());
      squared += 0.5 * e.dot(claimed.inv() * e);
    }
    const auto at = [](const std::vector<double>& values, double share) { return test::percentile(values, share); };
    std::printf("| %s | %d |%s | %.2f, %.2f, %.2f | %.2f, %.2f, %.2f | %d | %.2f |\n", v.name.c_str(), ok,
                refused.c_str(), at(across, 0.5), at(across, 0.95), at(across, 1.0), at(along, 0.5), at(along, 0.95),
                at(along, 1.0), beyond, squared / std::max(1, ok));
  }
  return 0;
}
