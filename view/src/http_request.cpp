// SPDX-License-Identifier: MIT
#include <bevel/view/http_request.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

namespace bevel::view {
namespace {

std::string lower(std::string_view text) {
  std::string all(text);
  std::ranges::transform(all, all.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return all;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

bool is_allowed_host(std::string_view host, const std::vector<std::string>& hosts) {
  std::string_view name = host;
  const auto colon = host.rfind(':');
  if (colon != std::string_view::npos && !host.ends_with(']')) {
    const std::string_view port = host.substr(colon + 1);
    if (port.empty() || port.size() > 5 || !std::ranges::all_of(port, [](char c) { return c >= '0' && c <= '9'; }))
      return false;
    name = host.substr(0, colon);
  }
  const std::string given = lower(name);
  constexpr std::array<std::string_view, 3> kLoopback{"127.0.0.1", "localhost", "[::1]"};
  return std::ranges::find(kLoopback, given) != kLoopback.end() || std::ranges::find(hosts, given) != hosts.end();
}

bool is_allowed_origin(std::string_view origin, const std::vector<std::string>& hosts) {
  for (const std::string_view scheme : {"http://", "https://"})
    if (origin.starts_with(scheme)) return is_allowed_host(origin.substr(scheme.size()), hosts);
  return false;
}

using Headers = std::map<std::string, std::string>;

/// Fills \p headers, names in lower case; returns the reason of a refusal or nullptr.
const char* read_headers(std::string_view lines, Headers& headers) {
  while (!lines.empty()) {
    const auto end = lines.find("\r\n");
    if (end == std::string_view::npos) return "A header line has no end.";
    const std::string_view line = lines.substr(0, end);
    lines.remove_prefix(end + 2);
    if (line.empty()) return nullptr;
    const auto colon = line.find(':');
    if (colon == std::string_view::npos || colon == 0 || line.substr(0, colon).find_first_of(" \t") != line.npos)
      return "A header line is not \"Name: value\".";
    if (!headers.emplace(lower(line.substr(0, colon)), trimmed(line.substr(colon + 1))).second &&
        (lower(line.substr(0, colon)) == "host" || lower(line.substr(0, colon)) == "origin"))
      return "Host or Origin occurs twice.";
  }
  return nullptr;
}

}  // namespace

const char* reason_phrase(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 413:
      return "Content Too Large";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

std::variant<HttpRequest, HttpRefusal> parse_request(std::string_view head, const std::vector<std::string>& hosts) {
  const auto line_end = head.find("\r\n");
  if (line_end == std::string_view::npos) return HttpRefusal{400, "The request line has no end."};
  const std::string_view line = head.substr(0, line_end);
  const auto first = line.find(' '), last = line.rfind(' ');
  if (first == std::string_view::npos || last == first || !line.substr(last + 1).starts_with("HTTP/1."))
    return HttpRefusal{400, "The request line is not \"GET /path HTTP/1.1\"."};
  const std::string_view lines = head.substr(line_end + 2);
  if (static_cast<std::size_t>(std::ranges::count(lines, '\n')) > kMostHeaders + 1)
    return HttpRefusal{431, "More than 64 header lines; allowed: at most 64."};
  Headers headers;
  if (const char* fault = read_headers(lines, headers)) return HttpRefusal{400, fault};
  if (!is_allowed_host(headers["host"], hosts))
    return HttpRefusal{403, "Host is not this machine; allowed: 127.0.0.1, localhost, or a name of --allow-host."};
  if (headers.contains("origin") && !is_allowed_origin(headers["origin"], hosts))
    return HttpRefusal{403, "The request comes from a page of another site."};
  const std::string_view method = line.substr(0, first);
  if (method != "GET" && method != "HEAD") return HttpRefusal{405, "This page is read-only; allowed: GET, HEAD."};
  if (headers.contains("transfer-encoding") || (headers.contains("content-length") && headers["content-length"] != "0"))
    return HttpRefusal{413, "A body is not allowed."};
  std::string_view path = line.substr(first + 1, last - first - 1);
  path = path.substr(0, path.find('?'));
  if (!path.starts_with('/')) return HttpRefusal{400, "The path does not begin with /."};
  return HttpRequest{std::string(path), method == "GET"};
}

}  // namespace bevel::view
