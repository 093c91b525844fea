// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Start of LCM with warnings about its provider.
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <string>

namespace bevel::nodes {

/// Checks an LCM provider.
/// @param url LCM provider; empty: LCM_DEFAULT_URL
/// @return "", or a warning about a provider with which messages go to unexpected places: a ttl above 1, which
///   lets motion commands leave the network segment, or a file that LCM writes in place of sending
std::string lcm_url_warning(const std::string& url);

/// Prints lcm_url_warning() on stderr, if there is one.
/// @param url LCM provider; empty: LCM_DEFAULT_URL
void warn_of_lcm_url(const std::string& url);

/// Prints the warning of lcm_url_warning() and starts LCM with its receiver. LCM itself starts the receiver with the
/// first subscription, and crashes if that fails.
/// @param url LCM provider; empty: LCM_DEFAULT_URL
/// @return LCM, ready for subscriptions
/// @throws IoError with the remedy
std::unique_ptr<lcm::LCM> open_lcm(const std::string& url);

}  // namespace bevel::nodes
