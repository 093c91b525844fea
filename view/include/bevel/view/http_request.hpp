// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Requests to the live page: parsed and checked, without a socket.
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace bevel::view {

/// Request line and headers; browsers send 1 to 2 kB.
inline constexpr std::size_t kLargestHead_bytes = 8192;
inline constexpr std::size_t kMostHeaders = 64;

struct HttpRequest {
  std::string path;                ///< without the query
  bool has_body_in_answer = true;  ///< false for HEAD
};

struct HttpRefusal {
  int status = 400;
  std::string reason;  ///< one sentence for whoever sent the request
};

/// Parses a request and checks that a page of another site did not send it.
///
/// Host must name this machine (127.0.0.1, localhost, [::1]) or be in \p hosts, with any port, so that another site
/// cannot read the page through a name that it resolves to this machine. Origin, where there is one, must be
/// http:// or https:// with such a host. GET and HEAD without a body are allowed.
/// @param head  up to and including the empty line
/// @param hosts  further names, in lower case
std::variant<HttpRequest, HttpRefusal> parse_request(std::string_view head, const std::vector<std::string>& hosts);

/// Returns the reason phrase of a status: "Not Found".
const char* reason_phrase(int status);

}  // namespace bevel::view
