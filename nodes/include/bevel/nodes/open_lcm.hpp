// SPDX-License-Identifier: MIT
#pragma once
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <string>

namespace bevel::nodes {

/// Returns "", or a warning about an LCM provider with which messages go to unexpected places: a ttl above 1, which
/// lets motion commands leave the network segment, or a file that LCM writes in place of sending.
/// @param url  LCM provider; empty: LCM_DEFAULT_URL
std::string lcm_url_warning(const std::string& url);

/// Prints lcm_url_warning() on stderr, if there is one.
void warn_of_lcm_url(const std::string& url);

/// Prints the warning of lcm_url_warning() and starts LCM, its receiver included: LCM itself starts the receiver with
/// the first subscription, and crashes where that fails.
/// @param url  LCM provider; empty: LCM_DEFAULT_URL
/// @throws IoError with the remedy
std::unique_ptr<lcm::LCM> open_lcm(const std::string& url);

}  // namespace bevel::nodes
