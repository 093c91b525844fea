// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include <bevel/drivers/camera/frame_source.hpp>
#include <bevel/drivers/camera/frame_stream.hpp>
#include <bevel/rig/camera/frame_server.hpp>
#include "tests/support/stale_socket.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::camera {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

cv::Mat shade(int level, cv::Size size = {64, 48}) { return {size, CV_8UC1, cv::Scalar(level)}; }

SourceConfig config_of(SourceKind kind, const std::string& path) {
  SourceConfig config;
  config.kind = kind;
  config.path = path;
  config.connect_timeout_ms = 50;
  return config;
}

TEST(NaturalOrder, ComparesRunsOfDigitsAsNumbers) {
  EXPECT_TRUE(natural_less("ImgFeedback2.jpg", "ImgFeedback10.jpg"));
  EXPECT_FALSE(natural_less("ImgFeedback10.jpg", "ImgFeedback2.jpg"));
  EXPECT_TRUE(natural_less("a9b2", "a9b10"));
  EXPECT_TRUE(natural_less("a", "b"));
  EXPECT_TRUE(natural_less("a1", "a1b"));
  EXPECT_FALSE(natural_less("a1", "a1"));
  EXPECT_NE(natural_less("a01", "a1"), natural_less("a1", "a01"));
  EXPECT_TRUE(natural_less("x99999999999999999999", "x100000000000000000000"));
}

TEST(FolderSource, NaturalOrderAndStamps) {
  const test::TemporaryFolder folder;
  for (const int i : {10, 1, 2, 9}) cv::imwrite(folder / ("ImgFeedback" + std::to_string(i) + ".png"), shade(i));
  std::ofstream(folder / "notes.txt") << "not a picture";
  SourceConfig config = config_of(SourceKind::folder, folder.path());
  config.start_utime = 1000;
  config.period_us = 50;
  config.camera = 3;
  const auto source = make_frame_source(config);
  int64_t seq = 0;
  for (const int expected : {1, 2, 9, 10}) {
    const FrameResult got = source->next(milliseconds(0));
    ASSERT_TRUE(std::holds_alternative<Frame>(got));
    const Frame& frame = std::get<Frame>(got);
    EXPECT_EQ(frame.gray.at<uchar>(5, 5), expected);
    EXPECT_EQ(frame.seq, seq);
    EXPECT_EQ(frame.capture_utime, 1000 + 50 * seq);
    EXPECT_EQ(frame.camera, 3);
    ++seq;
  }
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source->next(milliseconds(0))));
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source->next(milliseconds(0))));
}

TEST(FolderSource, UnreadableImageIsAFailureThatNamesIt) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "broken.png") << "no picture";
  const FrameResult got = make_frame_source(config_of(SourceKind::folder, folder.path()))->next(milliseconds(0));
  ASSERT_TRUE(std::holds_alternative<SourceFailure>(got));
  EXPECT_NE(std::get<SourceFailure>(got).text.find("broken.png"), std::string::npos);
}

TEST(SourceConfigCheck, NamesTheKeyOrThePath) {
  const test::TemporaryFolder folder;
  struct Case {
    const char* named;
    SourceConfig config;
  };
  std::vector<Case> cases;
  cases.push_back({"path", config_of(SourceKind::folder, "")});
  cases.push_back({"/no/such/folder", config_of(SourceKind::folder, "/no/such/folder")});
  cases.push_back({"no jpg", config_of(SourceKind::folder, folder.path())});
  cases.push_back({"/no/such/film.avi", config_of(SourceKind::video, "/no/such/film.avi")});
  cases.push_back({"/dev/null", config_of(SourceKind::device, "/dev/null")});
  cases.push_back({"no frame server answers", config_of(SourceKind::stream, folder / "nobody")});
  cases.push_back({"characters", config_of(SourceKind::stream, "/" + std::string(200, 'x'))});
  cases.push_back({"period_us", config_of(SourceKind::folder, folder.path())});
  cases.back().config.period_us = 0;
  cases.push_back({"rate_hz", config_of(SourceKind::device, "/dev/video0")});
  cases.back().config.rate_hz = std::nan("");
  cases.push_back({"fourcc", config_of(SourceKind::device, "/dev/video0")});
  cases.back().config.fourcc = "YUY";
  for (const Case& bad : cases) {
    try {
      make_frame_source(bad.config);
      ADD_FAILURE() << bad.named << " was accepted";
    } catch (const SourceError& error) {
      EXPECT_NE(std::string(error.what()).find(bad.named), std::string::npos) << error.what();
    }
  }
  EXPECT_EQ(source_kind_from("stream"), SourceKind::stream);
  EXPECT_THROW(source_kind_from("film"), SourceError);
}

TEST(FrameStream, LoopbackOfTwoCameras) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "frames";
  rig::FrameServer server(path);
  const auto source = make_frame_source(config_of(SourceKind::stream, path));
  const auto deadline = steady_clock::now() + std::chrono::seconds(5);
  while (server.clients() < 1 && steady_clock::now() < deadline) std::this_thread::sleep_for(milliseconds(1));
  cv::Mat gradient(480, 640, CV_8UC1);
  for (int r = 0; r < gradient.rows; ++r)
    for (int c = 0; c < gradient.cols; ++c) gradient.at<uchar>(r, c) = static_cast<uchar>(r + 3 * c);
  server.publish({111, 7, 0, gradient});
  server.publish({222, 8, 1, gradient.colRange(10, 74).rowRange(0, 48)});  // not continuous in memory
  for (const int camera : {0, 1}) {
    const FrameResult got = source->next(milliseconds(5000));
    ASSERT_TRUE(std::holds_alternative<Frame>(got));
    const Frame& frame = std::get<Frame>(got);
    EXPECT_EQ(frame.camera, camera);
    EXPECT_EQ(frame.seq, 7 + camera);
    EXPECT_EQ(frame.capture_utime, 111 * (camera + 1));
    const cv::Mat expected = camera == 0 ? gradient : cv::Mat(gradient.colRange(10, 74).rowRange(0, 48));
    ASSERT_EQ(frame.gray.size(), expected.size());
    EXPECT_EQ(cv::norm(frame.gray, expected, cv::NORM_INF), 0.0);
  }
  EXPECT_TRUE(std::holds_alternative<FrameTimeout>(source->next(milliseconds(10))));
}

TEST(FrameStream, SlowClientLosesFramesAndBlocksNobody) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "frames";
  rig::FrameServer server(path);
  const auto slow = make_frame_source(config_of(SourceKind::stream, path));
  const auto quick = make_frame_source(config_of(SourceKind::stream, path));
  const auto deadline = steady_clock::now() + std::chrono::seconds(5);
  while (server.clients() < 2 && steady_clock::now() < deadline) std::this_thread::sleep_for(milliseconds(1));
  ASSERT_EQ(server.clients(), 2);
  constexpr int frames = 60;
  for (int i = 0; i < frames; ++i) {
    server.publish({i, i, 0, shade(i, {640, 480})});
    const FrameResult got = quick->next(milliseconds(5000));
    ASSERT_TRUE(std::holds_alternative<Frame>(got)) << "frame " << i;
    EXPECT_EQ(std::get<Frame>(got).seq, i);
  }
  EXPECT_GT(server.dropped(), 0);
  // What the slow one still gets is whole and in order.
  int64_t last = -1;
  int received = 0;
  for (;;) {
    const FrameResult got = slow->next(milliseconds(200));
    if (!std::holds_alternative<Frame>(got)) break;
    const Frame& frame = std::get<Frame>(got);
    EXPECT_GT(frame.seq, last);
    EXPECT_EQ(cv::norm(frame.gray, shade(static_cast<int>(frame.seq), {640, 480}), cv::NORM_INF), 0.0);
    last = frame.seq;
    ++received;
  }
  EXPECT_GE(received, 1);
  EXPECT_EQ(received + server.dropped(), frames);
}

TEST(FrameStream, ClientsMayComeAndGo) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "frames";
  rig::FrameServer server(path);
  for (int i = 0; i < 3; ++i) {
    const auto source = make_frame_source(config_of(SourceKind::stream, path));
    bool got = false;
    for (int attempt = 0; attempt < 500 && !got; ++attempt) {
      server.publish({attempt, attempt, 0, shade(i)});
      got = std::holds_alternative<Frame>(source->next(milliseconds(10)));
    }
    EXPECT_TRUE(got);
  }
}

TEST(FrameStream, SecondServerIsRefusedADeadOnesSocketIsTakenOver) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "frames";
  {
    const rig::FrameServer first(path);
    EXPECT_THROW(rig::FrameServer second(path), std::runtime_error);
  }
  test::leave_stale_socket(path, SOCK_STREAM);
  EXPECT_NO_THROW(rig::FrameServer again(path));
  EXPECT_THROW(rig::FrameServer(std::string(300, 'x')), std::runtime_error);
}

TEST(FrameStream, AnOrdinaryFileAtItsPathIsRefusedAndKept) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "insertion.lcm";
  std::ofstream(path) << "a recording";
  EXPECT_THAT([&] { const rig::FrameServer server(path); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("the path is a regular file; allowed: ")));
  EXPECT_EQ(std::filesystem::file_size(path), 11U);
}

TEST(FrameStream, EndWhenTheServerGoes) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "frames";
  auto server = std::make_unique<rig::FrameServer>(path);
  const auto source = make_frame_source(config_of(SourceKind::stream, path));
  server.reset();
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source->next(milliseconds(2000))));
}

/// A server that sends `bytes` and closes.
FrameResult what_a_client_makes_of(const std::vector<unsigned char>& bytes) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "frames";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(static_cast<char*>(address.sun_path), path.c_str(), sizeof address.sun_path - 1);
  const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
  EXPECT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(listen(listener, 1), 0);
  const auto source = make_frame_source(config_of(SourceKind::stream, path));
  const int client = accept(listener, nullptr, nullptr);
  EXPECT_EQ(send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  close(client);
  close(listener);
  return source->next(milliseconds(2000));
}

TEST(FrameStream, BadHeadersAreRefusedByName) {
  struct Case {
    const char* named;
    void (*spoil)(FrameHeader&);
  };
  const Case cases[] = {
      {"magic", [](FrameHeader& h) { h.magic = 1; }},
      {"version", [](FrameHeader& h) { h.version = 9; }},
      {"header_bytes", [](FrameHeader& h) { h.header_bytes = 0; }},
      {"width_px", [](FrameHeader& h) { h.width_px = 0; }},
      {"height_px", [](FrameHeader& h) { h.height_px = 0xFFFFFFFF; }},
      {"width_px*height_px", [](FrameHeader& h) { h.width_px = h.height_px = 8192; }},
      {"payload_bytes", [](FrameHeader& h) { h.payload_bytes = 0xFFFFFFFF; }},
      {"middle of a frame", [](FrameHeader&) {}},
  };
  for (const Case& bad : cases) {
    FrameHeader header;
    header.width_px = 8;
    header.height_px = 8;
    header.payload_bytes = 64;
    bad.spoil(header);
    const HeaderBytes head = encode(header);
    std::vector<unsigned char> bytes(head.size() + 10);
    std::memcpy(bytes.data(), head.data(), head.size());
    const FrameResult got = what_a_client_makes_of(bytes);
    ASSERT_TRUE(std::holds_alternative<SourceFailure>(got)) << bad.named;
    EXPECT_NE(std::get<SourceFailure>(got).text.find(bad.named), std::string::npos)
        << std::get<SourceFailure>(got).text;
  }
}

}  // namespace
}  // namespace bevel::camera
