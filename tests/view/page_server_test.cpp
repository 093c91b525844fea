// SPDX-License-Identifier: MIT
#include <bevel/view/page_server.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include <bevel/view/page.hpp>

namespace bevel::view {
namespace {

using testing::HasSubstr;

struct Served {
  Served()
      : server(
            PageServer::open_port(0), [] { return std::string("{\"rows\":[]}"); },
            [](std::int32_t camera, std::int64_t count) {
              return camera == 1 && count == 7 ? std::string("\xff\xd8picture") : "";
            }) {
    const std::string address = server.address();
    port = std::stoi(address.substr(address.rfind(':') + 1));
  }
  httplib::Client client() const {
    httplib::Client c("127.0.0.1", port);
    c.set_read_timeout(5);
    return c;
  }
  PageServer server;
  int port = 0;
};

TEST(PageServer, ServesThePageStateAndHistory) {
  Served served;
  served.server.publish("{\"a\":1}");
  auto client = served.client();
  const auto page = client.Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_EQ(page->body, page_html());
  EXPECT_EQ(client.Get("/state")->body, "{\"a\":1}");
  EXPECT_EQ(client.Get("/history")->body, "{\"rows\":[]}");
  EXPECT_EQ(client.Get("/nothing")->status, 404);
}

TEST(PageServer, GivesThePictureThatIsAskedForOrNone) {
  Served served;
  auto client = served.client();
  const auto picture = client.Get("/picture/1/7");
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->body, "\xff\xd8picture");
  EXPECT_EQ(picture->get_header_value("Content-Type"), "image/jpeg");
  for (const char* path : {"/picture/1/8", "/picture/0/7", "/picture/1", "/picture/-1/7", "/picture/x/7",
                           "/picture/1/99999999999999999999"}) {
    const auto none = client.Get(path);
    ASSERT_TRUE(none) << path;
    EXPECT_EQ(none->status, 404) << path;
  }
}

TEST(PageServer, ThePageNeedsNoNetworkAndIsWhole) {
  EXPECT_THAT(page_html(), HasSubstr("uPlot"));
  EXPECT_THAT(page_html(), HasSubstr("</html>"));
  for (const char* part :
       {"@UPLOT_CSS@", "@UPLOT_JS@", "@VIEW_CSS@", "@VIEW_JS@", "src=\"http", "href=\"http", "@import"})
    EXPECT_EQ(page_html().find(part), std::string::npos) << part;
}

TEST(PageServer, IsReadOnlyAndForThisMachineAlone) {
  Served served;
  auto client = served.client();
  const httplib::Result answers[] = {client.Post("/state", "{}", "application/json"),
                                     client.Put("/", "x", "text/plain"), client.Delete("/history")};
  for (const auto& refused : answers) {
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->status, 405);
  }
  const auto strange = client.Get("/state", {{"Host", "elsewhere.example"}});
  ASSERT_TRUE(strange);
  EXPECT_EQ(strange->status, 403);
}

// Reads events until `until` says so, or for five seconds.
std::string events(const Served& served, const std::function<bool(const std::string&)>& until) {
  std::string text;
  auto client = served.client();
  client.Get("/events", [&](const char* data, std::size_t size) {
    text.append(data, size);
    return !until(text);
  });
  return text;
}

TEST(PageServer, EventsFollowWhatIsPublished) {
  Served served;
  std::atomic<bool> done = false;
  std::thread publisher([&] {
    for (int i = 0; !done; ++i) {
      served.server.publish("{\"i\":" + std::to_string(i) + "}");
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  const std::string text =
      events(served, [](const std::string& t) { return std::count(t.begin(), t.end(), '{') >= 7; });
  done = true;
  publisher.join();
  int last = -1, count = 0;
  for (std::size_t at = 0; (at = text.find("data: {\"i\":", at)) != std::string::npos; ++count) {
    at += 11;
    const int i = std::stoi(text.substr(at));
    EXPECT_GT(i, last);
    last = i;
  }
  EXPECT_GE(count, 5);
}

TEST(PageServer, AReaderThatIsSlowGetsTheNewest) {
  Served served;
  const std::string filler(200'000, 'x');  // more than a socket keeps
  bool first = true;
  const std::string text = events(served, [&](const std::string& t) {
    if (first) {
      first = false;
      for (int i = 0; i < 200; ++i) served.server.publish("{\"i\":" + std::to_string(i) + ",\"x\":\"" + filler + "\"}");
    }
    return t.find("{\"i\":199,") != std::string::npos;
  });
  EXPECT_THAT(text, HasSubstr("{\"i\":199,"));
  EXPECT_LT(text.size(), 100 * filler.size()) << "old ones were queued";  // a socket keeps some megabytes
}

TEST(PageServer, EndsWhileAPageIsOpen) {
  auto served = std::make_unique<Served>();
  std::atomic<bool> open = false;
  std::thread page([&, port = served->port] {
    httplib::Client client("127.0.0.1", port);
    client.Get("/events", [&](const char*, std::size_t) {
      open = true;
      return true;
    });
  });
  served->server.publish("{}");
  while (!open) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const auto since = std::chrono::steady_clock::now();
  served.reset();
  page.join();
  EXPECT_LT(std::chrono::steady_clock::now() - since, std::chrono::seconds(5));
}

TEST(PageServer, APortThatIsTakenIsNamed) {
  Served served;
  try {
    PageServer::open_port(served.port);
    FAIL() << "opened twice";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("port " + std::to_string(served.port)));
    EXPECT_THAT(e.what(), HasSubstr("in use"));
  }
}

TEST(PageServer, WhatIsNoOpenPortIsRefused) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  EXPECT_THROW(PageServer(ends[0], [] { return std::string(); }), std::runtime_error);
  ::close(ends[0]);
  ::close(ends[1]);
}

}  // namespace
}  // namespace bevel::view
