// SPDX-License-Identifier: MIT
#include <bevel/nodes/open_lcm.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include <bevel/error.hpp>

namespace bevel::nodes {

std::string lcm_url_warning(const std::string& url) {
  const char* environment = std::getenv("LCM_DEFAULT_URL");
  const std::string used = !url.empty() ? url : environment != nullptr ? environment : "";
  const std::string place = url.empty() ? "LCM_DEFAULT_URL" : "LCM provider";
  const auto query = used.find('?');
  if (query == std::string::npos) return "";
  std::string words = used.substr(query + 1);
  std::ranges::replace_if(
      words, [](char c) { return c == '&' || c == ',' || c == ';'; }, '\n');
  std::istringstream options(words);
  for (std::string option; std::getline(options, option);) {
    const auto equals = option.find('=');
    if (equals == std::string::npos) continue;
    const std::string key = option.substr(0, equals), value = option.substr(equals + 1);
    if (key == "ttl" && std::strtol(value.c_str(), nullptr, 10) > 1)
      return place + " is " + used + ": with ttl " + value +
             " messages, commands of motion among them, leave this network segment; allowed without this warning: 0 "
             "(this machine) or 1. Set ttl=1";
    if (used.starts_with("file://") && key == "mode" && !value.starts_with('r'))
      return place + " is " + used +
             ": LCM writes messages into this file and sends none; no other program receives them, and mode=w replaces "
             "the file. Use udpm:// for a running system, mode=r to play a log back";
  }
  return "";
}

void warn_of_lcm_url(const std::string& url) {
  const std::string warning = lcm_url_warning(url);
  if (!warning.empty()) std::fprintf(stderr, "warning: %s\n", warning.c_str());
}

std::unique_ptr<lcm::LCM> open_lcm(const std::string& url) {
  warn_of_lcm_url(url);
  auto lcm = std::make_unique<lcm::LCM>(url);
  if (!lcm->good()) throw IoError("LCM does not start; is multicast routed, and the provider right? (docs/running.md)");
  if (lcm->getFileno() < 0)
    throw IoError(
        "LCM cannot receive, see its message above; check the multicast route (docs/running.md) and the limits of open "
        "files and processes (ulimit -n, ulimit -u)");
  return lcm;
}

}  // namespace bevel::nodes
