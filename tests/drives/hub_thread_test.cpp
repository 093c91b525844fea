// The hub as bevel-rig runs it, on a thread of its own, with clients on two others: every frame reaches the other
// client in the order sent, every echo its sender, and the end asked for is an end.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>

#include "drivers/can/local_bus.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::can {
namespace {

constexpr std::uint32_t kFrames = 500;

struct Heard {
  std::uint32_t frames = 0;
  std::uint32_t echoes = 0;
  bool in_order = true;
};

// Sends frames with this identifier, one at a time as the driver does, until all of them and all of the other's were
// heard.
Heard talk(LocalBus& bus, std::uint32_t id) {
  using std::chrono::steady_clock;
  const auto deadline = steady_clock::now() + std::chrono::seconds(30);
  Heard heard;
  std::uint32_t sent = 0;
  while ((heard.frames < kFrames || heard.echoes < kFrames) && steady_clock::now() < deadline) {
    if (sent < kFrames && sent == heard.echoes) {
      const Frame frame{id, 2, {static_cast<std::uint8_t>(sent), static_cast<std::uint8_t>(sent >> 8)}};
      sent += bus.send(frame) == SendResult::sent ? 1 : 0;
    }
    const Reception got = bus.receive();
    if (got.kind == Reception::Kind::nothing) {
      std::this_thread::yield();
      continue;
    }
    std::uint32_t& count = got.kind == Reception::Kind::echo ? heard.echoes : heard.frames;
    heard.in_order = heard.in_order && (got.frame.data[0] | got.frame.data[1] << 8) == static_cast<int>(count);
    ++count;
  }
  return heard;
}

TEST(HubThread, PassesEveryFrameOnInOrderAndEndsWhenAsked) {
  const test::TemporaryFolder folder;
  const std::string path = (folder / "bus").string();
  LocalHub hub(path);
  LocalBus one(path, {});
  LocalBus two(path, {});
  hub.service();  // both have joined: nobody speaks to nobody
  ASSERT_EQ(hub.clients(), 2U);
  std::jthread server([&hub](const std::stop_token& stop) { hub.run(stop); });
  Heard second;
  std::jthread other([&] { second = talk(two, 2); });
  const Heard first = talk(one, 1);
  other.join();
  server.request_stop();
  server.join();
  for (const Heard& heard : {first, second}) {
    EXPECT_EQ(heard.frames, kFrames);
    EXPECT_EQ(heard.echoes, kFrames);
    EXPECT_TRUE(heard.in_order);
  }
  EXPECT_EQ(hub.dropped(), 0U);
}

}  // namespace
}  // namespace bevel::can
