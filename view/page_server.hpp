// The live page over HTTP: read-only, on this machine alone. GET / is the page, /events the snapshots as server-sent
// events, /history what a page begins with, /state the newest snapshot. A page that reads slowly gets the newest
// snapshot, not a queue of old ones.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace bevel::view {

class PageServer {
 public:
  using Picture = std::function<std::string(std::int32_t camera, std::int64_t count)>;
  static constexpr int kMostPages = 16;            ///< pages that may be open at once
  static constexpr int kThreads = kMostPages + 5;  ///< that serve them: one accepts, four answer other requests

  // A port that is open before anything is served; 0 takes one that is free. Throws std::runtime_error naming the port
  // and why it cannot be had.
  static int open_port(int port);

  // Takes over what open_port() returned, in this process or in the one that started it, and serves from threads of
  // its own, which call `history` too, and `picture` for the JPEG of a camera and count ("": there
  // is none).
  PageServer(
      int socket, std::function<std::string()> history,
      Picture picture = [](std::int32_t, std::int64_t) { return std::string(); });
  ~PageServer();  // ends the pages' connections
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  // For every page that is open. Any thread; does not wait for a reader.
  void publish(std::string snapshot);

  std::string address() const;  // http://127.0.0.1:8402/

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bevel::view
