// SPDX-License-Identifier: MIT
// Serves the live page with an insertion that is made up, for a test of what the page shows: camera 1 falls silent, the
// controller has stopped. Prints the address; ends when its standard input does.
#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include <bevel/io/process_state.hpp>
#include <bevel/view/live_view.hpp>
#include <bevel/view/page_server.hpp>

int main() {
  using namespace bevel;
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const auto now = [] {
    const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
    return view::Moment{std::chrono::steady_clock::now().time_since_epoch().count(),
                        std::chrono::duration_cast<std::chrono::microseconds>(since_epoch).count()};
  };
  std::mutex mutex;
  view::LiveView picture;
  view::PageServer server(
      view::PageServer::open_port(0),
      [&] {
        const std::lock_guard lock(mutex);
        return picture.history();
      },
      [&](std::int32_t camera, std::int64_t count) {
        const std::lock_guard lock(mutex);
        return picture.picture(camera, count);
      });
  const view::Moment start = now();
  const auto step = [&](const view::Moment& at, double s) {  // s seconds into it
    const std::lock_guard lock(mutex);
    needle_state_t needle{};
    needle.utime = at.utime;
    needle.orientation_wxyz[0] = 1;
    needle.position_mm[0] = 6 * std::sin(0.02 * 10 * s);
    needle.position_mm[1] = -0.05 * s * s;
    needle.position_mm[2] = 10 * s;
    needle.curvature_per_mm = 0.0047;
    needle.lambda1_per_rad = 0.49;
    needle.lambda2 = 0.22;
    for (std::size_t i = 0; i < 9; ++i) needle.covariance[10 * i] = i < 3 ? 0.04 : 1e-6;
    picture.on(needle, at);
    actuator_state_t axes{};
    axes.utime = at.utime;
    axes.axis_status[0] = axes.axis_status[1] = 2;
    axes.insertion_mm = 10 * s;
    axes.insertion_rate_mm_s = 10;
    picture.on(axes, at);
    for (int camera = 0; camera < 2; ++camera) {
      if (camera == 1 && s > 5) continue;
      tip_measurement_t tip{};
      tip.utime = at.utime;
      tip.camera = camera;
      for (int i = 0; i < 3; ++i) tip.position_mm[i] = needle.position_mm[i];
      tip.information_per_mm2[camera == 0 ? 4 : 0] = tip.information_per_mm2[8] = 25;
      picture.on(tip, at);
    }
    camera_picture_t seen{};  // black but for a white square, on whose middle the tip is
    seen.utime = at.utime;
    seen.width_px = 160;
    seen.height_px = 120;
    seen.tip_px[0] = 100;
    seen.tip_px[1] = 40;
    cv::Mat gray(120, 160, CV_8UC1, cv::Scalar(0));
    gray(cv::Rect(96, 36, 9, 9)) = 255;
    cv::imencode(".jpg", gray, seen.jpeg);
    seen.jpeg_size = static_cast<std::int32_t>(seen.jpeg.size());
    if (s < 8) picture.on(seen, at);  // and no more of them: it grows old
    process_status_t status{};
    status.utime = at.utime;
    status.process = "bevel-controller";
    status.state = "stopped";
    status.state_code = static_cast<std::int32_t>(io::ProcessState::stopped);
    status.reason = "measurements stale <b>0.25 s</b>";
    picture.on(status, at);
    server.publish(picture.snapshot(at));
  };
  steering_target_t target{};
  target.request = 1;
  target.position_mm[0] = 5;
  target.position_mm[1] = -4;
  target.position_mm[2] = 90;
  target.tolerance_mm = 1;
  picture.on(target, start);
  // Eight seconds of it at once, as if the page were opened late; then as time goes on.
  for (int i = 0; i < 160; ++i) {
    const double s = 0.05 * i;
    const auto back_ns = static_cast<std::int64_t>((8 - s) * static_cast<double>(kSecond_ns));
    step({start.ns - back_ns, start.utime - back_ns / 1000}, s);
  }
  std::printf("%s\n", server.address().c_str());
  std::fflush(stdout);
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, 50) == 0;) step(now(), 8);
}
