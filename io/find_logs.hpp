#pragma once
// Which logs are meant by paths.
#include <string>
#include <vector>

namespace bevel::io {

/// Returns files as they are, and of folders the .lcm files in the order of their names.
/// @throws std::runtime_error for a path that does not exist, a folder without a log, or a log whose name without the
///   extension has only dots
std::vector<std::string> find_logs(const std::vector<std::string>& paths);

}  // namespace bevel::io
