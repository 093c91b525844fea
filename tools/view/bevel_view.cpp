// SPDX-License-Identifier: MIT
// bevel-view: a running loop, or a log that is played back, on a live page.
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>

#include <bevel/cli/command_line.hpp>
#include <bevel/cli/limits.hpp>
#include <bevel/error.hpp>
#include <bevel/nodes/open_lcm.hpp>
#include <bevel/nodes/runtime.hpp>
#include <bevel/view/view_node.hpp>

namespace {

/// Splits "rig.lan,bench" at its commas, in lower case.
std::vector<std::string> names_in(const std::string& text) {
  std::vector<std::string> names;
  std::istringstream words(text);
  for (std::string name; std::getline(words, name, ',');) {
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

// A program in another network, as the demo's, cannot open a port here: it is given one that is open.
constexpr const char* kSocket = "BEVEL_VIEW_SOCKET";

int start_with_port(const std::vector<std::string>& command, int socket) {
  ::setenv(kSocket, std::to_string(socket).c_str(), 1);
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  ::execvp(words[0], words.data());
  throw bevel::IoError("cannot start " + command[0] + ": " + std::strerror(errno));
}

}  // namespace

int main(int argc, char** argv) {
  using namespace bevel;
  int port = 8402, parent = 0;
  std::string lcm_url, hosts;
  std::vector<std::string> command;
  cli::CommandLine command_line("bevel-view", "Shows a running loop, or a log that is played back, on a live page.");
  command_line.option("--port", port, "on 127.0.0.1; 0 for one that is free", 0, 65535)
      .option("--lcm-url", lcm_url, "LCM provider; default: LCM_DEFAULT_URL")
      .option("--allow-host", hosts,
              "names, separated by commas, by which a browser may request the page, of a proxy for instance; "
              "127.0.0.1 and localhost always are")
      .option("--end-with", parent, "id of the process that started this one: end when it is gone", 0,
              std::numeric_limits<int>::max())
      .arguments("COMMAND", command, "after --: started with the port open, for a bevel-view that it starts", false)
      .example("bevel-view --port 8402");
  return command_line.run(argc, argv, [&] {
    const char* given = std::getenv(kSocket);
    const int socket = given ? std::atoi(given) : view::PageServer::open_port(port);
    if (!command.empty()) return start_with_port(command, socket);
    nodes::catch_signals();
    if (parent != 0) nodes::end_with(parent);
    const auto opened = nodes::open_lcm(lcm_url);
    lcm::LCM& lcm = *opened;
    cli::require_threads(view::PageServer::kThreads);
    view::ViewNode node(lcm, socket, names_in(hosts));
    std::printf("watch at %s\n", node.address().c_str());
    std::fflush(stdout);
    nodes::run_periodic(lcm, {0.05, [&](const nodes::Now& now) { node.tell_time(now); },
                              [&](const nodes::Now& now, double) {
                                node.step(now);
                                return true;
                              }});
    return 0;
  });
}
