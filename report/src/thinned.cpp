// SPDX-License-Identifier: MIT
#include <bevel/report/thinned.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace bevel::report {

std::vector<std::size_t> thinned(const std::vector<double>& values, std::size_t most) {
  const std::size_t count = values.size();
  std::vector<std::size_t> kept;
  if (count <= most) {
    for (std::size_t i = 0; i < count; ++i) kept.push_back(i);
    return kept;
  }
  constexpr std::size_t kOfAStretch = 4;
  const std::size_t stretches = std::max<std::size_t>(1, (std::max<std::size_t>(most, 2) - 2) / kOfAStretch);
  kept.push_back(0);
  for (std::size_t k = 0; k < stretches; ++k) {
    const std::size_t from = 1 + k * (count - 2) / stretches, to = 1 + (k + 1) * (count - 2) / stretches;
    // One more, at a place that no period of the series can keep in step with: shares of the golden section.
    const double place = static_cast<double>(k) * 0.6180339887498949;
    const std::size_t wanted =
        from + static_cast<std::size_t>((place - std::floor(place)) * static_cast<double>(to - from));
    std::size_t other = to, low = to, high = to, gap = to;
    for (std::size_t i = from; i < to; ++i) {
      if (!std::isfinite(values[i])) {
        gap = std::min(gap, i);
        continue;
      }
      if (low == to) low = high = i;
      if (other == to && i >= wanted) other = i;
      if (values[i] < values[low]) low = i;
      if (values[i] > values[high]) high = i;
    }
    std::vector<std::size_t> some{other, low, high, gap};
    std::sort(some.begin(), some.end());
    some.erase(std::unique(some.begin(), some.end()), some.end());
    std::copy_if(some.begin(), some.end(), std::back_inserter(kept), [to](std::size_t i) { return i < to; });
  }
  kept.push_back(count - 1);
  return kept;
}

std::vector<std::size_t> joined(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
  std::vector<std::size_t> both;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  return both;
}

}  // namespace bevel::report
