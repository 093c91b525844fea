// SPDX-License-Identifier: MIT
// The local bus over real sockets: echo, broadcast, filters, and what happens when the hub goes and comes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <bevel/drivers/can/local_bus.hpp>
#include <bevel/drivers/can/open_bus.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::can {
namespace {

class LocalBusTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::string path_ = (folder_ / "bus").string();
  std::unique_ptr<LocalHub> hub_ = std::make_unique<LocalHub>(path_);
};

TEST_F(LocalBusTest, FramesReachAllOthersAndEchoToTheSender) {
  const auto a = open_bus("unix:" + path_);
  const auto b = open_bus("unix:" + path_);
  const auto c = open_bus("unix:" + path_, std::vector<std::uint32_t>{0x701});
  hub_->service();
  EXPECT_EQ(hub_->clients(), 3U);
  const Frame frame{0x181, 6, {1, 2, 3, 4, 5, 6}};
  ASSERT_EQ(a->send(frame), SendResult::sent);
  EXPECT_EQ(a->receive().kind, Reception::Kind::nothing);  // no echo before it was passed on
  hub_->service();
  const auto echo = a->receive();
  EXPECT_EQ(echo.kind, Reception::Kind::echo);
  EXPECT_EQ(echo.frame, frame);
  const auto heard = b->receive();
  EXPECT_EQ(heard.kind, Reception::Kind::frame);
  EXPECT_EQ(heard.frame, frame);
  EXPECT_EQ(b->receive().kind, Reception::Kind::nothing);
  EXPECT_EQ(c->receive().kind, Reception::Kind::nothing);  // does not listen to it
}

// More than are fetched at once; what was fetched before a link was lost is not heard after it.
TEST_F(LocalBusTest, ManyFramesComeInTheirOrderAndNoneFromBeforeALoss) {
  constexpr std::uint8_t kFrames = 20;
  const auto a = open_bus("unix:" + path_);
  const auto b = open_bus("unix:" + path_);
  hub_->service();
  for (int round = 0; round < 2; ++round) {
    for (std::uint8_t i = 0; i < kFrames; ++i) {
      ASSERT_EQ(a->send({0x181, 1, {i}}), SendResult::sent);
      hub_->service();
    }
    const std::uint8_t expected = round == 0 ? kFrames : 3;
    for (std::uint8_t i = 0; i < expected; ++i) {
      const auto heard = b->receive();
      ASSERT_EQ(heard.kind, Reception::Kind::frame);
      EXPECT_EQ(heard.frame.data[0], i);
    }
  }
  (void)b->purge();
  b->maintain(0);
  hub_->service();
  EXPECT_EQ(b->receive().kind, Reception::Kind::event);
  ASSERT_EQ(a->send({0x182, 0, {}}), SendResult::sent);
  hub_->service();
  EXPECT_EQ(b->receive().frame.id, 0x182U);
}

TEST_F(LocalBusTest, AFullQueueIsCountedAndNeverBlocks) {
  const auto a = open_bus("unix:" + path_);
  hub_->service();
  SendResult last = SendResult::sent;
  for (int i = 0; i < 1000 && last == SendResult::sent; ++i) last = a->send({0x201, 8, {}});
  EXPECT_EQ(last, SendResult::queue_full);
  EXPECT_EQ(a->counters().queue_full, 1U);
  EXPECT_LT(a->counters().sent, 100U);  // short: what waits is old
}

TEST_F(LocalBusTest, ALostHubIsAnEventAndIsFoundAgain) {
  const auto a = open_bus("unix:" + path_);
  hub_->service();
  hub_.reset();
  const auto event = a->receive();
  EXPECT_EQ(event.kind, Reception::Kind::event);
  EXPECT_EQ(event.event, BusEvent::gone);
  EXPECT_FALSE(a->is_open());
  EXPECT_EQ(a->send({0x201, 8, {}}), SendResult::gone);
  a->maintain(0);
  EXPECT_FALSE(a->is_open());
  hub_ = std::make_unique<LocalHub>(path_);
  a->maintain(1);  // too early: the pause is not over
  EXPECT_FALSE(a->is_open());
  a->maintain(100'000'000);
  EXPECT_TRUE(a->is_open());
  EXPECT_EQ(a->receive().event, BusEvent::reopened);
}

TEST_F(LocalBusTest, ASecondHubIsRefusedAndADeadOneReplaced) {
  EXPECT_THROW(LocalHub second(path_), std::runtime_error);
  hub_.reset();
  // A hub that was killed leaves a socket nobody serves.
  const int dead = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(dead);
  EXPECT_NO_THROW(hub_ = std::make_unique<LocalHub>(path_));
}

TEST_F(LocalBusTest, OrdinaryFilesAtItsPathAreRefusedAndKept) {
  for (const char* name : {"insertion.lcm", "folder", "link"}) {
    const std::string path = (folder_ / name).string();
    if (name == std::string("folder"))
      std::filesystem::create_directory(path);
    else if (name == std::string("link"))
      std::filesystem::create_symlink(folder_ / "insertion.lcm", path);
    else
      std::ofstream(path) << "a recording";
    EXPECT_THAT([&] { const LocalHub hub(path); }, testing::ThrowsMessage<std::runtime_error>(
                                                       testing::HasSubstr("; allowed: a path that does not exist yet")))
        << name;
    EXPECT_TRUE(std::filesystem::exists(path)) << name;
  }
  std::ifstream kept(folder_ / "insertion.lcm");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(kept), {}), "a recording");
}

TEST_F(LocalBusTest, ASocketOfAnotherProgramIsRefusedAndKept) {
  const std::string path = (folder_ / "frames").string();
  sockaddr_un address = wire::address_of(path);
  const int other = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(other, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(other, 1), 0);
  EXPECT_THAT([&] { const LocalHub hub(path); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("another process serves it already")));
  EXPECT_TRUE(std::filesystem::exists(path));
  ::close(other);
}

TEST_F(LocalBusTest, AFileThatTookTheSocketsPlaceIsKept) {
  std::filesystem::remove(path_);
  std::ofstream(path_) << "a recording";
  hub_.reset();
  EXPECT_TRUE(std::filesystem::is_regular_file(path_));
}

TEST_F(LocalBusTest, RubbishFromAClientIsNotPassedOn) {
  const auto a = open_bus("unix:" + path_);
  const int raw = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::connect(raw, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const std::string rubbish(64, '\xFF');
  for (const std::size_t size : {1U, 15U, 16U, 17U, 64U})
    ASSERT_EQ(::send(raw, rubbish.data(), size, 0), static_cast<ssize_t>(size));
  hub_->service();
  EXPECT_EQ(a->receive().kind, Reception::Kind::nothing);
  EXPECT_EQ(hub_->clients(), 2U);
  ::close(raw);
  hub_->service();
  EXPECT_EQ(hub_->clients(), 1U);
}

TEST(LocalBusAddress, ThatCannotWorkIsRefused) {
  EXPECT_THROW(open_bus("unix:"), std::runtime_error);
  EXPECT_THROW(open_bus("unix:" + std::string(200, 'x')), std::runtime_error);
  EXPECT_THROW(open_bus(std::string(40, 'c')), std::runtime_error);
}

}  // namespace
}  // namespace bevel::can
