#include "view/page_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "view/page.hpp"

namespace bevel::view {
namespace {

constexpr auto kPulse = std::chrono::seconds(1);  // a comment, so that a page that is gone is noticed

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

// A page of another site must not read this one through a name that it makes point here.
bool is_this_machine(const std::string& host) {
  const std::string name = host.substr(0, host.rfind(':'));
  return name == "127.0.0.1" || name == "localhost";
}

// httplib opens its ports itself; this one takes over a port that is open.
class OpenServer : public httplib::Server {
 public:
  explicit OpenServer(int socket) { svr_sock_ = socket; }
};

}  // namespace

struct PageServer::Impl {
  Impl(int socket, std::function<std::string()> h, PageServer::Picture p)
      : server(socket), history(std::move(h)), picture(std::move(p)) {}

  OpenServer server;
  std::function<std::string()> history;
  PageServer::Picture picture;
  int port = 0;
  std::mutex mutex;
  std::condition_variable changed;
  std::string snapshot = "{}";
  std::uint64_t version = 0;
  bool ended = false;
  std::atomic<int> pages = 0;
  std::thread thread;

  // One event, as soon as there is one that the page has not had; false when it is over.
  bool serve_event(httplib::DataSink& sink, std::uint64_t& had) {
    std::string text;
    {
      std::unique_lock lock(mutex);
      changed.wait_for(lock, kPulse, [&] { return ended || version != had; });
      if (ended) return false;
      if (version == had) {
        text = ": nothing new\n\n";
      } else {
        had = version;
        text = "id: " + std::to_string(version) + "\ndata: " + snapshot + "\n\n";
      }
    }
    return sink.write(text.data(), text.size());
  }

  void routes() {
    server.set_tcp_nodelay(true);
    server.set_keep_alive_max_count(1);  // an end does not wait for connections that might be used again
    server.new_task_queue = [] { return new httplib::ThreadPool(kThreads - 1); };
    server.set_default_headers({{"Cache-Control", "no-store"}, {"X-Content-Type-Options", "nosniff"}});
    server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
      if (is_this_machine(request.get_header_value("Host"))) return httplib::Server::HandlerResponse::Unhandled;
      response.status = 403;
      response.set_content("This page is for this machine alone.\n", "text/plain");
      return httplib::Server::HandlerResponse::Handled;
    });
    server.set_error_handler([](const httplib::Request& request, httplib::Response& response) {
      if (request.method != "GET" && request.method != "HEAD") response.status = 405;  // it is read, nothing else
    });
    server.Get("/", [](const httplib::Request&, httplib::Response& response) {
      response.set_content(page_html(), "text/html; charset=utf-8");
    });
    server.Get("/state", [this](const httplib::Request&, httplib::Response& response) {
      const std::lock_guard lock(mutex);
      response.set_content(snapshot, "application/json");
    });
    server.Get("/history", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(history(), "application/json");
    });
    server.Get(R"(/picture/(\d{1,9})/(\d{1,18}))",
               [this](const httplib::Request& request, httplib::Response& response) {
                 const std::string jpeg = picture(std::stoi(request.matches[1]), std::stoll(request.matches[2]));
                 if (jpeg.empty())
                   response.status = 404;
                 else
                   response.set_content(jpeg, "image/jpeg");
               });
    server.Get("/events", [this](const httplib::Request&, httplib::Response& response) {
      if (pages.fetch_add(1) >= kMostPages) {
        --pages;
        response.status = 503;
        response.set_content("Too many pages are open.\n", "text/plain");
        return;
      }
      response.set_chunked_content_provider(
          "text/event-stream",
          [this, had = ~std::uint64_t{0}](std::size_t, httplib::DataSink& sink) mutable {
            return serve_event(sink, had);
          },
          [this](bool) { --pages; });
    });
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
  throw std::runtime_error("port " + std::to_string(port) + " of 127.0.0.1 cannot be opened: " + why +
                           "; choose another, or 0 for one that is free");
}

PageServer::PageServer(int socket, std::function<std::string()> history, Picture picture)
    : impl_(std::make_unique<Impl>(socket, std::move(history), std::move(picture))) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  int listens = 0;
  socklen_t listens_size = sizeof listens;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0 || address.sin_family != AF_INET ||
      ::getsockopt(socket, SOL_SOCKET, SO_ACCEPTCONN, &listens, &listens_size) != 0 || listens == 0)
    throw std::runtime_error("file descriptor " + std::to_string(socket) + " is no port that is open");
  ::fcntl(socket, F_SETFD, FD_CLOEXEC);
  impl_->port = ntohs(address.sin_port);
  impl_->routes();
  impl_->thread = std::thread([this] { impl_->server.listen_after_bind(); });
}

PageServer::~PageServer() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ended = true;
  }
  impl_->changed.notify_all();
  // stop() before the thread serves would be lost.
  while (!impl_->server.is_running() && impl_->thread.joinable()) std::this_thread::yield();
  impl_->server.stop();
  impl_->thread.join();
}

void PageServer::publish(std::string snapshot) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->snapshot = std::move(snapshot);
    ++impl_->version;
  }
  impl_->changed.notify_all();
}

std::string PageServer::address() const { return "http://127.0.0.1:" + std::to_string(impl_->port) + "/"; }

}  // namespace bevel::view
