// SPDX-License-Identifier: MIT
// Decoding of images: rows and columns of the sensor whatever the orientation tag, one brightness scale per bit depth,
// and no decoder in the source tree but this one.
#include <bevel/drivers/camera/decode.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <fstream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include <bevel/drivers/camera/frame_sources.hpp>
#include "tests/camera/exif.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::camera {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

// 64 x 48, different after each of the eight rotations and reflections.
cv::Mat wedge() {
  cv::Mat out(48, 64, CV_8UC1);
  for (int row = 0; row < out.rows; ++row)
    for (int col = 0; col < out.cols; ++col) out.at<uchar>(row, col) = static_cast<uchar>(2 * col + row);
  out(cv::Rect(4, 4, 12, 6)) = 255;
  return out;
}

void write(const fs::path& file, const std::vector<uint8_t>& bytes) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void expect_same(const cv::Mat& got, const cv::Mat& expected, const std::string& what) {
  ASSERT_EQ(got.size(), expected.size()) << what;
  EXPECT_EQ(cv::norm(got, expected, cv::NORM_INF), 0.0) << what;
}

TEST(Decode, GivesTheSamePixelsWithAndWithoutAnOrientationTagInJpeg) {
  const cv::Mat expected = decode_gray(test::jpeg_of(wedge(), 0)).gray;
  for (const bool little_endian : {true, false})
    for (int orientation = 1; orientation <= 8; ++orientation) {
      const DecodedImage got = decode_gray(test::jpeg_of(wedge(), orientation, little_endian));
      expect_same(got.gray, expected, "orientation " + std::to_string(orientation));
      EXPECT_EQ(got.orientation, orientation);
    }
}

TEST(Decode, GivesTheSamePixelsWithAndWithoutAnOrientationTagInPng) {
  std::vector<uint8_t> bytes;
  cv::imencode(".png", wedge(), bytes);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    // An eXIf chunk behind the header chunk; CRC-32 as in PNG 1.2, appendix D.
    const std::string body = "eXIf" + test::exif_tiff(orientation, false);
    uint32_t crc = 0xFFFFFFFF;
    for (const char c : body) {
      crc ^= static_cast<uint8_t>(c);
      for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? 0xEDB88320 ^ (crc >> 1) : crc >> 1;
    }
    crc ^= 0xFFFFFFFF;
    std::vector<uint8_t> chunk{0, 0, 0, static_cast<uint8_t>(body.size() - 4)};
    chunk.insert(chunk.end(), body.begin(), body.end());
    for (int shift = 24; shift >= 0; shift -= 8) chunk.push_back(static_cast<uint8_t>(crc >> shift));
    std::vector<uint8_t> tagged = bytes;
    tagged.insert(tagged.begin() + 33, chunk.begin(), chunk.end());
    const DecodedImage got = decode_gray(tagged);
    expect_same(got.gray, wedge(), "orientation " + std::to_string(orientation));
    EXPECT_EQ(got.orientation, orientation);
  }
}

TEST(Decode, GivesTheSamePixelsWithAndWithoutAnOrientationTagInTiff) {
  // An uncompressed image in one strip, little-endian (TIFF 6.0, section 4).
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const cv::Mat image = wedge();
    std::vector<uint8_t> bytes{'I', 'I', 42, 0, 8, 0, 0, 0};
    const auto integer = [&bytes](uint32_t value, int size) {
      for (int i = 0; i < size; ++i) bytes.push_back(static_cast<uint8_t>(value >> (8 * i)));
    };
    const std::vector<std::pair<uint32_t, uint32_t>> entries{{256, 64},
                                                             {257, 48},
                                                             {258, 8},
                                                             {259, 1},
                                                             {262, 1},
                                                             {273, 8 + 2 + 12 * 10 + 4},
                                                             {274, static_cast<uint32_t>(orientation)},
                                                             {277, 1},
                                                             {278, 48},
                                                             {279, 64 * 48}};
    integer(static_cast<uint32_t>(entries.size()), 2);
    for (const auto& [tag, value] : entries) integer(tag, 2), integer(3, 2), integer(1, 4), integer(value, 4);
    integer(0, 4);
    bytes.insert(bytes.end(), image.datastart, image.dataend);
    const DecodedImage got = decode_gray(bytes);
    expect_same(got.gray, image, "orientation " + std::to_string(orientation));
    EXPECT_EQ(got.orientation, orientation);
  }
}

TEST(Decode, ReadsNothingPastTheEndOfACutFile) {
  const auto whole = test::jpeg_of(wedge(), 6);
  for (size_t size = 0; size < 60; ++size) {
    const std::vector<uint8_t> part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_TRUE(decode_gray(part).gray.empty()) << size << " bytes";
  }
}

TEST(Decode, AnImageFolderAndAnMjpegDeviceIgnoreOrientation) {
  const cv::Mat expected = decode_gray(test::jpeg_of(wedge(), 0)).gray;
  const test::TemporaryFolder folder;
  for (const int orientation : {3, 6}) {
    const auto jpeg = test::jpeg_of(wedge(), orientation);
    write(fs::path(folder.path()) / ("a" + std::to_string(orientation) + ".jpg"), jpeg);
    int found = 1;
    expect_same(gray_of({V4L2_PIX_FMT_MJPEG, 64, 48, 0}, jpeg, &found), expected, "MJPEG");
    EXPECT_EQ(found, orientation);
  }
  SourceConfig config;
  config.path = folder.path();
  FolderSource source(config);
  EXPECT_EQ(source.remark(), "");
  for (int i = 0; i < 2; ++i) {
    const FrameResult got = source.next(milliseconds(0));
    ASSERT_TRUE(std::holds_alternative<Frame>(got));
    expect_same(std::get<Frame>(got).gray, expected, "folder");
  }
  EXPECT_THAT(source.remark(), HasSubstr("a3.jpg' carries orientation tag 3; the image is not rotated"));
}

TEST(Decode, AVideoThatStatesARotationIsNotRotated) {
  const test::TemporaryFolder folder;
  const std::string path = (fs::path(folder.path()) / "phone.mp4").string();
  {
    cv::VideoWriter writer;
    if (!writer.open(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 25.0, {64, 48}, true))
      GTEST_SKIP() << "OpenCV's FFmpeg has no encoder for mp4v";
    cv::Mat colour;
    cv::cvtColor(wedge(), colour, cv::COLOR_GRAY2BGR);
    for (int i = 0; i < 5; ++i) writer.write(colour);
  }
  const auto first = [&path] {
    SourceConfig config;
    config.kind = SourceKind::video;
    config.path = path;
    VideoSource source(config);
    const FrameResult got = source.next(milliseconds(0));
    return std::pair(std::holds_alternative<Frame>(got) ? std::get<Frame>(got).gray : cv::Mat(), source.remark());
  };
  const auto [plain, none] = first();
  EXPECT_EQ(none, "");
  // The matrix of the track header (ISO/IEC 14496-12, section 8.3.2), from identity to a quarter turn.
  std::string bytes = test::text_of(path);
  const auto place = [](const std::vector<uint32_t>& words) {
    std::string out;
    for (const uint32_t word : words)
      for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(word >> shift & 0xFF);
    return out;
  };
  const std::string identity = place({0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000});
  const size_t at = bytes.find(identity, bytes.find("tkhd"));
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, identity.size(), place({0, 0x10000, 0, 0xFFFF0000, 0, 0, 48 << 16, 0, 0x40000000}));
  std::ofstream(path, std::ios::binary) << bytes;
  const auto [tagged, remark] = first();
  expect_same(tagged, plain, "rotated by its header");
  EXPECT_THAT(remark, HasSubstr("phone.mp4' states a rotation of "));
}

TEST(Decode, ScalesSixteenBitSamplesByTheBitsThatTheyUse) {
  for (const int bits : {8, 10, 12, 14, 16}) {
    cv::Mat deep;
    wedge().convertTo(deep, CV_16U, ((1 << bits) - 1) / 255.0);
    std::vector<uint8_t> bytes;
    cv::imencode(".png", deep, bytes);
    const DecodedImage got = decode_gray(bytes);
    EXPECT_EQ(got.bits, bits);
    ASSERT_EQ(got.gray.size(), wedge().size());
    EXPECT_LE(cv::norm(got.gray, wedge(), cv::NORM_INF), 1.0) << bits << " bits";
  }
  // Left-justified 12-bit samples fill the 16 bits from the top; a dark image of them is not brightened.
  cv::Mat left;
  wedge().convertTo(left, CV_16U, 16.0 / 4.0);
  left.convertTo(left, CV_16U, 16.0);
  std::vector<uint8_t> bytes;
  cv::imencode(".png", left, bytes);
  EXPECT_EQ(decode_gray(bytes).bits, 16);
}

// A dark frame in a sequence is not brightened compared with a bright one before it.
TEST(Decode, KeepsOneBrightnessScaleInAFolder) {
  const test::TemporaryFolder folder;
  const auto file = [&folder](const char* name) { return (fs::path(folder.path()) / name).string(); };
  cv::Mat bright(48, 64, CV_16UC1, cv::Scalar(4001)), dark(48, 64, CV_16UC1, cv::Scalar(401));
  cv::imwrite(file("1.png"), bright);
  cv::imwrite(file("2.png"), dark);
  SourceConfig config;
  config.path = folder.path();
  FolderSource source(config);
  const cv::Mat first = std::get<Frame>(source.next(milliseconds(0))).gray;
  const cv::Mat second = std::get<Frame>(source.next(milliseconds(0))).gray;
  EXPECT_NEAR(first.at<uchar>(0, 0), 4001 * 255.0 / 4095, 1.0);
  EXPECT_NEAR(second.at<uchar>(0, 0), 401 * 255.0 / 4095, 1.0);
}

TEST(Decode, IsTheOnlyDecoderInTheSourceTree) {
  const fs::path root(BEVEL_SOURCE_DIR);
  int files = 0;
  for (const char* part : {"controller", "diagnosis", "drivers", "estimator", "io", "model", "nodes", "proof", "report",
                           "rig", "tests", "tools", "view"})
    for (const auto& entry : fs::recursive_directory_iterator(root / part)) {
      const fs::path& file = entry.path();
      if (file.extension() != ".cpp" && file.extension() != ".hpp") continue;
      if (file == root / "drivers/src/camera/decode.cpp" || file.filename() == "decode_test.cpp") continue;
      ++files;
      const std::string text = test::text_of(file.string());
      for (const char* call : {"cv::imread(", "cv::imdecode(", "cv::imreadmulti("})
        EXPECT_EQ(text.find(call), std::string::npos)
            << file << " calls " << call
            << ") and so rotates images by their EXIF orientation; use bevel/drivers/camera/decode.hpp";
    }
  EXPECT_GT(files, 300);
}

}  // namespace
}  // namespace bevel::camera
