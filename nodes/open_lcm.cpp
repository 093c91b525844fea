#include "nodes/open_lcm.hpp"

#include <stdexcept>

namespace bevel::nodes {

std::unique_ptr<lcm::LCM> open_lcm(const std::string& url) {
  auto lcm = std::make_unique<lcm::LCM>(url);
  if (!lcm->good())
    throw std::runtime_error("LCM does not start; is multicast routed, and the provider right? (docs/running.md)");
  if (lcm->getFileno() < 0)
    throw std::runtime_error(
        "LCM cannot receive, see its message above; check the multicast route (docs/running.md) and the limits of open "
        "files and processes (ulimit -n, ulimit -u)");
  return lcm;
}

}  // namespace bevel::nodes
