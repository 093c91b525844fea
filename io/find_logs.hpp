#pragma once
// Which logs are meant by paths.
#include <string>
#include <vector>

namespace bevel::io {

// Files as they are, folders by the .lcm files in them, in the order of their names. Throws std::runtime_error naming
// what is not there.
std::vector<std::string> find_logs(const std::vector<std::string>& paths);

}  // namespace bevel::io
