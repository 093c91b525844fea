// SPDX-License-Identifier: MIT
#include <bevel/view/page_server.hpp>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <list>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <bevel/error.hpp>
#include <bevel/view/http_request.hpp>
#include <bevel/view/page.hpp>

namespace bevel::view {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPulse = std::chrono::seconds(1);  // a comment, so that a page that is gone is noticed
constexpr auto kLinger = std::chrono::seconds(1);
constexpr std::size_t kMostDiscarded_bytes = 65'536;  // of a body that was refused
constexpr int kTick_ms = 100;                         // resolution of all time limits

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

struct Answer {
  int status = 404;
  std::string type = "text/plain", body = "There is no such page.\n";
};

std::string head_of(int status, const std::string& type, std::optional<std::size_t> length) {
  std::string head = "HTTP/1.1 " + std::to_string(status) + " " + reason_phrase(status) + "\r\nContent-Type: " + type +
                     "\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n"
                     "Cross-Origin-Resource-Policy: same-origin\r\n";
  if (length) head += "Content-Length: " + std::to_string(*length) + "\r\n";
  return head + "\r\n";
}

/// Reads the number that follows `prefix` in `path`, and removes both; of 1 to `digits` digits.
template <class Integer>
bool take_number(std::string_view& path, std::string_view prefix, std::size_t digits, Integer& value) {
  if (!path.starts_with(prefix)) return false;
  path.remove_prefix(prefix.size());
  const std::size_t size = std::min(path.find_first_not_of("0123456789"), path.size());
  if (size == 0 || size > digits) return false;
  const bool is_read = std::from_chars(path.data(), path.data() + size, value).ec == std::errc{};
  path.remove_prefix(size);
  return is_read;
}

struct Connection {
  enum class State { reads, writes, follows, lingers };  // follows: server-sent events; lingers: until the peer closes
  int fd = -1;
  in_addr_t peer = 0;
  State state = State::reads;
  std::string in, out;
  std::size_t sent = 0, discarded = 0;
  Clock::time_point deadline;  // of the request, of progress in writing, or of lingering
  Clock::time_point spoke;     // newest event or comment
  std::uint64_t had = ~std::uint64_t{0};
  bool is_over = false;
};

}  // namespace

struct PageServer::Impl {
  Impl(int socket, std::function<std::string()> h, PageServer::Picture p, std::vector<std::string> names)
      : listener(socket), history(std::move(h)), picture(std::move(p)), hosts(std::move(names)) {}

  int listener, wake = -1, port = 0;
  std::function<std::string()> history;
  PageServer::Picture picture;
  std::vector<std::string> hosts;
  std::mutex mutex;  // of the three that follow
  std::string snapshot = "{}";
  std::uint64_t version = 0;
  bool ended = false;
  std::list<Connection> connections;
  std::thread thread;

  Answer answer(const std::string& path) {
    if (path == "/") return {200, "text/html; charset=utf-8", page_html()};
    if (path == "/history") return {200, "application/json", history()};
    if (path == "/state") {
      const std::lock_guard lock(mutex);
      return {200, "application/json", snapshot};
    }
    std::int32_t camera = 0;
    std::int64_t count = 0;
    std::string_view rest = path;
    if (!take_number(rest, "/picture/", 9, camera) || !take_number(rest, "/", 18, count) || !rest.empty()) return {};
    std::string jpeg = picture(camera, count);
    return jpeg.empty() ? Answer{} : Answer{200, "image/jpeg", std::move(jpeg)};
  }

  void send_answer(Connection& c, const Answer& a, bool with_body = true) const {
    c.out = head_of(a.status, a.type, a.body.size());
    if (with_body) c.out += a.body;
    begin_to_write(c, Connection::State::writes);
  }
  static void begin_to_write(Connection& c, Connection::State state) {
    c.state = state;
    c.in.clear();
    c.deadline = Clock::now() + kLongestWrite;
  }

  void handle(Connection& c, std::string_view head) {
    const auto parsed = parse_request(head, hosts);
    if (const auto* refusal = std::get_if<HttpRefusal>(&parsed))
      return send_answer(c, {refusal->status, "text/plain", refusal->reason + "\n"});
    const auto& request = std::get<HttpRequest>(parsed);
    if (request.path != "/events" || !request.has_body_in_answer)
      return send_answer(c, answer(request.path), request.has_body_in_answer);
    const auto open = std::ranges::count(connections, Connection::State::follows, &Connection::state);
    if (open >= kMostPages)
      return send_answer(c, {503, "text/plain", "16 pages are open; allowed: at most 16. Close one.\n"});
    c.out = head_of(200, "text/event-stream", {});
    begin_to_write(c, Connection::State::follows);
  }

  void receive(Connection& c) {
    char bytes[4096];
    const ssize_t size = ::recv(c.fd, bytes, sizeof bytes, 0);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (size <= 0) {
      c.is_over = true;
      return;
    }
    if (c.state != Connection::State::reads) {  // whatever a peer sends after its request is discarded
      c.discarded += static_cast<std::size_t>(size);
      c.is_over = c.discarded > kMostDiscarded_bytes;
      return;
    }
    c.in.append(bytes, static_cast<std::size_t>(size));
    const auto end = c.in.find("\r\n\r\n");
    if (end != std::string::npos && end + 4 <= kLargestHead_bytes)
      handle(c, c.in.substr(0, end + 4));
    else if (c.in.size() > kLargestHead_bytes)
      send_answer(c, {431, "text/plain", "The request has more than 8192 bytes; allowed: at most 8192.\n"});
  }

  // One event, once the page has received the one before: a slow page gets the newest snapshot.
  void add_event(Connection& c) {
    const std::lock_guard lock(mutex);
    if (version != c.had) {
      c.had = version;
      c.out = "id: " + std::to_string(version) + "\ndata: " + snapshot + "\n\n";
    } else if (Clock::now() - c.spoke >= kPulse) {
      c.out = ": nothing new\n\n";
    } else {
      return;
    }
    c.spoke = Clock::now();
    c.deadline = c.spoke + kLongestWrite;
  }

  void transmit(Connection& c) {
    if (c.state == Connection::State::follows && c.out.empty()) add_event(c);
    if (c.out.empty()) return;
    const ssize_t size = ::send(c.fd, c.out.data() + c.sent, c.out.size() - c.sent, MSG_NOSIGNAL);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (size < 0) {
      c.is_over = true;
      return;
    }
    c.sent += static_cast<std::size_t>(size);
    if (size > 0) c.deadline = Clock::now() + kLongestWrite;
    if (c.sent < c.out.size()) return;
    c.out.clear();
    c.sent = 0;
    if (c.state != Connection::State::writes) return;
    // Closed with unread input, the connection would be reset, and the peer could lose the answer.
    ::shutdown(c.fd, SHUT_WR);
    c.state = Connection::State::lingers;
    c.deadline = Clock::now() + kLinger;
  }

  void check_time(Connection& c) const {
    const bool waits_for_peer = c.state != Connection::State::follows || !c.out.empty();
    if (!waits_for_peer || Clock::now() < c.deadline) return;
    if (c.state == Connection::State::reads)
      send_answer(c, {408, "text/plain", "The request was not complete after 5 s.\n"});
    else
      c.is_over = true;
  }

  // False if no further connection can be accepted now.
  bool accept_one() {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const int fd = ::accept4(listener, reinterpret_cast<sockaddr*>(&from), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return false;
    const int yes = 1;
    (void)::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    Connection c;
    c.fd = fd;
    c.peer = from.sin_addr.s_addr;
    c.deadline = Clock::now() + kLongestRequest;
    const auto of_peer = std::ranges::count(connections, c.peer, &Connection::peer);
    if (of_peer >= kMostOfPeer || connections.size() >= static_cast<std::size_t>(kMostConnections)) {
      const std::string text = head_of(503, "text/plain", 0);
      (void)::send(fd, text.data(), text.size(), MSG_NOSIGNAL);
      ::close(fd);
      return true;
    }
    connections.push_back(std::move(c));
    return true;
  }

  void serve() {
    std::vector<pollfd> polled;
    bool accepts = true;
    for (;;) {
      {
        const std::lock_guard lock(mutex);
        if (ended) break;
      }
      polled = {{wake, POLLIN, 0}, {accepts ? listener : -1, POLLIN, 0}};
      for (const Connection& c : connections) {
        int events = c.out.empty() ? POLLIN : POLLIN | POLLOUT;
        if (c.state == Connection::State::writes) events = POLLOUT;  // a peer that has closed its side still reads
        polled.push_back({c.fd, static_cast<short>(events), 0});
      }
      (void)::poll(polled.data(), polled.size(), kTick_ms);
      std::uint64_t woken = 0;
      [[maybe_unused]] const ssize_t taken = ::read(wake, &woken, sizeof woken);
      std::size_t i = 2;
      for (Connection& c : connections) {
        if (polled[i++].revents & (POLLIN | POLLHUP | POLLERR)) receive(c);
        if (!c.is_over) transmit(c);
        if (!c.is_over) check_time(c);
      }
      std::erase_if(connections, [](const Connection& c) { return c.is_over && ::close(c.fd) <= 0; });
      const bool has_news = (polled[1].revents & POLLIN) != 0;
      accepts = true;
      if (has_news) {
        int accepted = 0;
        while (accepted < kMostConnections && accept_one()) ++accepted;
        accepts = accepted > 0;  // without a free descriptor: again after a tick, not at once
      }
    }
    for (const Connection& c : connections) ::close(c.fd);
    connections.clear();
  }

  void wake_up() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake, &one, sizeof one);
  }
};

int PageServer::open_port(int port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);  // handed on to a program that is started: not closed on exec
  const int yes = 1;
  const sockaddr_in address = loopback(port);
  if (socket >= 0 && ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
      ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 && ::listen(socket, 16) == 0)
    return socket;
  const std::string why = std::strerror(errno);
  if (socket >= 0) ::close(socket);
  throw IoError("port " + std::to_string(port) + " of 127.0.0.1 cannot be opened: " + why +
                "; choose another, or 0 for one that is free");
}

PageServer::PageServer(int socket, std::function<std::string()> history, Picture picture,
                       std::vector<std::string> hosts)
    : impl_(std::make_unique<Impl>(socket, std::move(history), std::move(picture), std::move(hosts))) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  int listens = 0;
  socklen_t listens_size = sizeof listens;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0 || address.sin_family != AF_INET ||
      ::getsockopt(socket, SOL_SOCKET, SO_ACCEPTCONN, &listens, &listens_size) != 0 || listens == 0)
    throw IoError("file descriptor " + std::to_string(socket) + " is no port that is open");
  ::fcntl(socket, F_SETFD, FD_CLOEXEC);
  ::fcntl(socket, F_SETFL, O_NONBLOCK);
  impl_->port = ntohs(address.sin_port);
  impl_->wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (impl_->wake < 0) throw IoError(std::string("live page: no event descriptor: ") + std::strerror(errno));
  impl_->thread = std::thread([this] { impl_->serve(); });
}

PageServer::~PageServer() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ended = true;
  }
  impl_->wake_up();
  impl_->thread.join();
  ::close(impl_->wake);
  ::close(impl_->listener);
}

void PageServer::publish(std::string snapshot) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->snapshot = std::move(snapshot);
    ++impl_->version;
  }
  impl_->wake_up();
}

std::string PageServer::address() const { return "http://127.0.0.1:" + std::to_string(impl_->port) + "/"; }

}  // namespace bevel::view
