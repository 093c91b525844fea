// SPDX-License-Identifier: MIT
// CAMERA_PICTURE: made of a frame, through LCM's encoding and the checked decode, and against every way in which bytes
// can be wrong.
#include <bevel/io/camera_picture.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include <bevel/drivers/camera/decode.hpp>
#include <bevel/error.hpp>
#include <bevel/nodes/camera_pictures.hpp>

namespace bevel::io {
namespace {

constexpr unsigned kSeed = 20261124;

// Dark but for a bright disc about the tip.
camera::Frame frame_with(const cv::Size& size, const cv::Point2d& tip) {
  camera::Frame frame{.capture_utime = 1'700'000'000'000'000, .seq = 5, .camera = 1, .gray = cv::Mat(size, CV_8UC1)};
  for (int row = 0; row < size.height; ++row)
    for (int col = 0; col < size.width; ++col)
      frame.gray.at<std::uint8_t>(row, col) = std::hypot(col - tip.x, row - tip.y) < size.width / 40.0 ? 230 : 20;
  return frame;
}

camera::TipObservation seen_at(const cv::Point2d& tip) {
  camera::TipObservation seen;
  seen.capture_utime = 1'700'000'000'000'000;
  seen.camera = 1;
  seen.status = camera::TipStatus::ok;
  seen.tip_px = tip;
  return seen;
}

camera_picture_t example(const cv::Size& size = {640, 480}, const cv::Point2d& tip = {400, 120}) {
  return nodes::make_picture(frame_with(size, tip), seen_at(tip), 41);
}

Decoded<camera_picture_t> decode_bytes(const std::vector<std::uint8_t>& bytes) {
  return checked_decode<camera_picture_t>(bytes.data(), bytes.size());
}

// The disc in the picture that arrives is where the message says that the tip is: the centre of its light.
TEST(CameraPicture, shows_the_tip_where_it_says_it_is) {
  for (const cv::Size size : {cv::Size(640, 480), cv::Size(1280, 1024), cv::Size(480, 640), cv::Size(200, 100)})
    for (const cv::Point2d share : {cv::Point2d(0.2, 0.3), cv::Point2d(0.7, 0.5), cv::Point2d(0.5, 0.8)}) {
      const cv::Point2d tip(share.x * size.width, share.y * size.height);
      const auto arrived = decode_bytes(encode(example(size, tip)));
      ASSERT_TRUE(arrived) << describe(*arrived.error);
      const cv::Mat gray = camera::decode_gray(arrived->jpeg).gray;
      ASSERT_EQ(gray.size(), cv::Size(arrived->width_px, arrived->height_px));
      EXPECT_LE(std::max(gray.cols, gray.rows), 320);
      EXPECT_LT(arrived->jpeg_size, 20'000);
      double light = 0, x = 0, y = 0;
      for (int row = 0; row < gray.rows; ++row)
        for (int col = 0; col < gray.cols; ++col) {
          const double bright = std::max(0, gray.at<std::uint8_t>(row, col) - 60);
          light += bright;
          x += bright * col;
          y += bright * row;
        }
      EXPECT_NEAR(x / light, arrived->tip_px[0], 0.3) << size;
      EXPECT_NEAR(y / light, arrived->tip_px[1], 0.3) << size;
      EXPECT_EQ(arrived->seq, 41);
      EXPECT_EQ(arrived->camera, 1);
    }
}

// A decorator that dropped the remark would hide an ignored orientation tag while pictures are published.
TEST(KeptFrame, PassesOnTheRemarkOfItsSource) {
  class Source : public camera::FrameSource {
   public:
    camera::FrameResult next(std::chrono::milliseconds /*timeout*/) override { return camera::EndOfFrames{}; }
    std::string remark() const override { return "carries orientation tag 6"; }
  };
  EXPECT_EQ(nodes::KeptFrame(std::make_unique<Source>()).remark(), "carries orientation tag 6");
}

TEST(CameraPicture, without_a_tip_is_a_picture_all_the_same) {
  camera::TipObservation lost = seen_at({0, 0});
  lost.status = camera::TipStatus::lost;
  const auto arrived = decode_bytes(encode(nodes::make_picture(frame_with({640, 480}, {1, 1}), lost, 0)));
  ASSERT_TRUE(arrived);
  EXPECT_NE(arrived->status, 0);
}

TEST(CameraPicture, what_is_not_its_bytes_is_refused) {
  const std::vector<std::uint8_t> bytes = encode(example());
  ASSERT_TRUE(decode_bytes(bytes));
  EXPECT_EQ(checked_decode<camera_picture_t>(nullptr, 100).error->fault, DecodeFault::size);
  for (std::size_t size = 0; size < bytes.size(); size += size < 80 ? 1 : 97)
    EXPECT_TRUE(decode_bytes({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}).error) << size;
  std::vector<std::uint8_t> longer = bytes;
  longer.push_back(0xd9);
  EXPECT_EQ(decode_bytes(longer).error->fault, DecodeFault::size);
  std::vector<std::uint8_t> other = bytes;
  other[3] ^= 1U;
  EXPECT_EQ(decode_bytes(other).error->fault, DecodeFault::fingerprint);
  // A length that is a lie makes no room for it.
  for (const std::uint8_t top : {0x7f, 0xff}) {
    std::vector<std::uint8_t> lie = bytes;
    lie[56] = top;
    EXPECT_EQ(decode_bytes(lie).error->fault, DecodeFault::size);
  }
}

TEST(CameraPicture, every_field_has_its_bounds) {
  const auto refused = [](auto change, const char* field) {
    camera_picture_t m = example();
    change(m);
    const auto error = decode_bytes(encode(m)).error;
    ASSERT_TRUE(error) << field;
    EXPECT_STREQ(error->field, field);
  };
  refused([](auto& m) { m.utime = 0; }, "utime");
  refused([](auto& m) { m.seq = -1; }, "seq");
  refused([](auto& m) { m.camera = -1; }, "camera");
  refused([](auto& m) { m.status = -1; }, "status");
  refused([](auto& m) { m.width_px = 641; }, "width_px");
  refused([](auto& m) { m.height_px = 0; }, "height_px");
  refused([](auto& m) { m.tip_px[0] = std::nan(""); }, "tip_px");
  refused([](auto& m) { m.tip_px[1] = m.height_px; }, "tip_px");
  refused([](auto& m) { m.width_px -= 1; }, "jpeg");  // another size than the JPEG's
  refused([](auto& m) { m.jpeg[0] = 0; }, "jpeg");
  refused([](auto& m) { m.jpeg.back() = 0; }, "jpeg");
  refused([](auto& m) { m.jpeg.assign(60'000, 0), m.jpeg_size = 60'000; }, "jpeg");
  refused([](auto& m) { m.jpeg.clear(), m.jpeg_size = 0; }, "jpeg_size");
  camera_picture_t lying = example();
  lying.jpeg_size += 1;  // a message that is not encoded: LCM's encoder would read past the end
  EXPECT_STREQ(check_fields(lying)->field, "jpeg_size");
}

TEST(CameraPicture, no_bytes_crash_it) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  const std::vector<std::uint8_t> bytes = encode(example({200, 100}, {50, 50}));
  int accepted = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    std::vector<std::uint8_t> wrong = bytes;
    for (unsigned k = 1 + random() % 4; k > 0; --k)
      wrong[random() % (trial % 2 == 0 ? 300 : wrong.size())] = static_cast<std::uint8_t>(random());
    if (const auto decoded = decode_bytes(wrong)) {
      ++accepted;
      ASSERT_EQ(jpeg_size_px(decoded->jpeg), (std::array{decoded->width_px, decoded->height_px}));
    }
  }
  EXPECT_GT(accepted, 0);  // a pixel that is another is still a picture
}

TEST(PictureClock, keeps_to_its_rate_for_each_camera_by_itself) {
  nodes::PictureClock clock(4);
  int first = 0, second = 0;
  for (std::int64_t ns = 1; ns < 10'000'000'000; ns += 33'333'333) {
    first += clock.due(0, ns);
    second += ns > 5'000'000'000 && clock.due(1, ns);
  }
  // Taken at the first frame that is due: every eighth of thirty a second.
  EXPECT_EQ(first, 38);
  EXPECT_EQ(second, 19);
  for (const double wrong : {0.0, -1.0, 5.01, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(nodes::PictureClock{wrong}, bevel::ArgumentError) << wrong;
}

}  // namespace
}  // namespace bevel::io
