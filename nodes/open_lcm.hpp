#pragma once
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <string>

namespace bevel::nodes {

/// Starts LCM, its receiver included: LCM itself starts the receiver with the first subscription, and crashes where
/// that fails.
/// @param url  LCM provider; empty: LCM_DEFAULT_URL
/// @throws std::runtime_error with the remedy
std::unique_ptr<lcm::LCM> open_lcm(const std::string& url);

}  // namespace bevel::nodes
