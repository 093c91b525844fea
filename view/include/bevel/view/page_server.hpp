// SPDX-License-Identifier: MIT
// The live page over HTTP: read-only, on this machine alone. GET / is the page, /events the snapshots as server-sent
// events, /history what a page begins with, /state the newest snapshot. A page that reads slowly gets the newest
// snapshot, not a queue of old ones.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bevel::view {

class PageServer {
 public:
  using Picture = std::function<std::string(std::int32_t camera, std::int64_t count)>;
  static constexpr int kMostPages = 16;                      ///< pages that may be open at once
  static constexpr int kMostConnections = 64;                ///< at once; a browser opens up to six for a page
  static constexpr int kMostOfPeer = 48;                     ///< connections from one address
  static constexpr std::chrono::seconds kLongestRequest{5};  ///< from the connection to the end of the request
  static constexpr std::chrono::seconds kLongestWrite{10};   ///< without progress: the peer does not read
  static constexpr int kThreads = 1;                         ///< that serve all of them

  // A port that is open before anything is served; 0 takes one that is free. Throws IoError naming the port
  // and why it cannot be had.
  static int open_port(int port);

  /// Serves from a separate thread, which calls \p history and \p picture.
  /// @param socket  of open_port(), in this process or in the one that started it; closed by this object
  /// @param picture  returns the JPEG of a camera and count, "" if it does not exist
  /// @param hosts  names, in lower case, by which the page may be requested in addition to those of this machine
  PageServer(
      int socket, std::function<std::string()> history,
      Picture picture = [](std::int32_t, std::int64_t) { return std::string(); }, std::vector<std::string> hosts = {});
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
