// SPDX-License-Identifier: MIT
// Peers of the live page that send too much, too slowly, too often, or from the page of another site.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <bevel/view/http_request.hpp>
#include <bevel/view/page_server.hpp>

namespace bevel::view {
namespace {

using testing::StartsWith;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point since) { return std::chrono::duration<double>(Clock::now() - since).count(); }

class Peer {
 public:
  explicit Peer(int port) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval longest{20, 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &longest, sizeof longest);
  }
  ~Peer() { ::close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // False once the server has closed the connection.
  bool send(const std::string& text) const {
    return ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  // Up to `most` bytes, or what comes before the server closes.
  std::string receive(std::size_t most = std::string::npos) const {
    std::string all;
    char bytes[4096];
    while (all.size() < most) {
      const ssize_t size = ::recv(fd_, bytes, sizeof bytes, 0);
      if (size <= 0) break;
      all.append(bytes, static_cast<std::size_t>(size));
    }
    return all;
  }

 private:
  int fd_;
};

struct Served {
  explicit Served(std::vector<std::string> hosts = {})
      : server(
            PageServer::open_port(0), [] { return std::string("{}"); },
            [](std::int32_t, std::int64_t) { return std::string(); }, std::move(hosts)) {
    const std::string address = server.address();
    port = std::stoi(address.substr(address.rfind(':') + 1));
  }
  std::string ask(const std::string& request) const {
    const Peer peer(port);
    peer.send(request);
    return peer.receive();
  }
  std::string get(const std::string& headers) const { return ask("GET /state HTTP/1.1\r\n" + headers + "\r\n"); }
  PageServer server;
  int port = 0;
};

const std::string kHost = "Host: 127.0.0.1\r\n";

TEST(PageLimits, HeadersAreLimitedInSizeAndNumber) {
  const Served served;
  EXPECT_THAT(served.get(kHost + "A: " + std::string(5000, 'x') + "\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(served.get(kHost + "A: " + std::string(20'000, 'x') + "\r\n"), StartsWith("HTTP/1.1 431"));
  std::string many = kHost;
  for (int i = 0; i < 200; ++i) many += "A" + std::to_string(i) + ": x\r\n";
  EXPECT_THAT(served.get(many), StartsWith("HTTP/1.1 431"));
  EXPECT_THAT(served.ask("GET /" + std::string(20'000, 'x') + " HTTP/1.1\r\n" + kHost + "\r\n"),
              StartsWith("HTTP/1.1 431"));
  // Without an end: the server keeps 8 kB of it, not all.
  const Peer endless(served.port);
  std::size_t sent = 0;
  while (sent < 50'000'000 && endless.send(std::string(10'000, 'x'))) sent += 10'000;
  EXPECT_LT(sent, 50'000'000U);
}

TEST(PageLimits, ABodyIsRefused) {
  const Served served;
  EXPECT_THAT(served.get(kHost + "Content-Length: 5\r\n"), StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(served.get(kHost + "Content-Length: 99999999999999\r\n"), StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(served.get(kHost + "Transfer-Encoding: chunked\r\n"), StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(served.get(kHost + "Content-Length: 0\r\n"), StartsWith("HTTP/1.1 200"));
}

TEST(PageLimits, WhatIsNoRequestIsRefused) {
  const Served served;
  for (const char* text : {"\r\n\r\n", "x\r\n\r\n", "GET /state\r\n\r\n", "GET / HTTP/2\r\nHost: localhost\r\n\r\n",
                           "GET state HTTP/1.1\r\nHost: localhost\r\n\r\n", "GET / HTTP/1.1\r\nHost localhost\r\n\r\n",
                           "GET / HTTP/1.1\r\nHost: localhost\r\nHost: elsewhere\r\n\r\n"})
    EXPECT_THAT(served.ask(text), StartsWith("HTTP/1.1 400")) << text;
}

TEST(PageLimits, ARequestThatDoesNotEndIsClosedHoweverSlowlyItGoesOn) {
  const Served served;
  const auto since = Clock::now();
  const Peer silent(served.port), slow(served.port);
  slow.send("GET /state HTTP/1.1\r\nA: ");
  while (seconds_since(since) < 20 && slow.send("x")) ::usleep(200'000);
  EXPECT_LT(seconds_since(since), 12);
  EXPECT_THAT(silent.receive(), StartsWith("HTTP/1.1 408"));
  EXPECT_LT(seconds_since(since), 13);
}

TEST(PageLimits, SilentPeersDoNotKeepAPageFromBeingServed) {
  const Served served;
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < 40; ++i) peers.push_back(std::make_unique<Peer>(served.port));
  const auto since = Clock::now();
  EXPECT_THAT(served.get(kHost), StartsWith("HTTP/1.1 200"));
  EXPECT_LT(seconds_since(since), 2);
}

TEST(PageLimits, ConnectionsOfOnePeerAndPagesAreLimited) {
  const Served served;
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < PageServer::kMostOfPeer; ++i) peers.push_back(std::make_unique<Peer>(served.port));
  EXPECT_THAT(served.get(kHost), StartsWith("HTTP/1.1 503"));
  peers.clear();
  std::string again;
  for (int i = 0; i < 50 && !again.starts_with("HTTP/1.1 200"); ++i) {
    ::usleep(100'000);
    again = served.get(kHost);
  }
  EXPECT_THAT(again, StartsWith("HTTP/1.1 200"));
  for (int i = 0; i < PageServer::kMostPages; ++i) {
    peers.push_back(std::make_unique<Peer>(served.port));
    peers.back()->send("GET /events HTTP/1.1\r\n" + kHost + "\r\n");
    EXPECT_THAT(peers.back()->receive(1), StartsWith("HTTP/1.1 200"));
  }
  EXPECT_THAT(served.ask("GET /events HTTP/1.1\r\n" + kHost + "\r\n"), StartsWith("HTTP/1.1 503"));
}

TEST(PageLimits, APageThatDoesNotReadIsClosed) {
  Served served;
  const Peer peer(served.port);
  peer.send("GET /events HTTP/1.1\r\n" + kHost + "\r\n");
  EXPECT_THAT(peer.receive(1), StartsWith("HTTP/1.1 200"));
  const std::string large(8'000'000, 'x');  // more than the buffers of a connection
  const auto since = Clock::now();
  while (seconds_since(since) < 12) {
    served.server.publish(large);
    ::usleep(100'000);
  }
  EXPECT_LT(peer.receive().size(), 2 * large.size()) << "it was not closed before it began to read";
}

TEST(PageHost, OnlyNamesOfThisMachineAndConfiguredOnesAreServed) {
  const Served served({"rig.lan"});
  for (const char* host :
       {"127.0.0.1", "127.0.0.1:8402", "localhost", "LOCALHOST:8402", "[::1]", "[::1]:8402", "rig.lan", "Rig.lan:80"})
    EXPECT_THAT(served.get("Host: " + std::string(host) + "\r\n"), StartsWith("HTTP/1.1 200")) << host;
  for (const char* host :
       {"", "elsewhere.example", "elsewhere.example:8402", "127.0.0.1.elsewhere.example", "localhost.elsewhere.example",
        "127.0.0.1:x", "127.0.0.1:", "127.0.0.1:1:1", "0.0.0.0", "localhost@elsewhere.example"})
    EXPECT_THAT(served.get("Host: " + std::string(host) + "\r\n"), StartsWith("HTTP/1.1 403")) << host;
  EXPECT_THAT(served.get(""), StartsWith("HTTP/1.1 403"));
}

TEST(PageHost, AnotherSitesPageIsRefused) {
  const Served served({"rig.lan"});
  for (const char* origin : {"http://127.0.0.1:8402", "http://localhost:9", "https://rig.lan"})
    EXPECT_THAT(served.get(kHost + "Origin: " + origin + "\r\n"), StartsWith("HTTP/1.1 200")) << origin;
  for (const char* origin : {"null", "http://elsewhere.example", "http://127.0.0.1.elsewhere.example", "file://",
                             "http://elsewhere.example:8402", ""})
    EXPECT_THAT(served.get(kHost + "Origin: " + origin + "\r\n"), StartsWith("HTTP/1.1 403")) << origin;
  EXPECT_THAT(served.get(kHost), testing::HasSubstr("Cross-Origin-Resource-Policy: same-origin"));
}

}  // namespace
}  // namespace bevel::view
