// SPDX-License-Identifier: MIT
#include "tests/report/example_page.hpp"

#include <cmath>
#include <string>
#include <vector>

namespace bevel::report::testing {
namespace {

constexpr int kSamples = 201;  // over 20 s

// x is 2 t, y is 100 - t: read off at any instant, each tells t.
Figure over_time(const char* name, double start, double slope) {
  std::vector<double> t_s, value, low, high;
  for (int i = 0; i < kSamples; ++i) {
    t_s.push_back(0.1 * i);
    value.push_back(start + slope * t_s.back());
    low.push_back(value.back() - 1);
    high.push_back(value.back() + 1);
  }
  Figure figure;
  figure.x_label = "time (s)";
  figure.y_label = std::string(name) + " (mm)";
  figure.height_px = 120;
  figure.link = "time";
  figure.band("2 sigma", t_s, low, high, Colour::blue).line(name, t_s, value, Colour::blue);
  return figure;
}

// The same readings against two quantities, in another order each.
Figure against(const char* name, double factor) {
  std::vector<double> quantity, residual, reading;
  for (int i = 0; i < 20; ++i) {
    quantity.push_back(factor * ((i * 7) % 20));
    residual.push_back(i / 10.0);
    reading.push_back(i);
  }
  Figure figure;
  figure.title = name;
  figure.x_label = "mm";
  figure.height_px = 120;
  figure.link = "readings";
  figure.points("residual", quantity, residual, Colour::orange);
  figure.series.back().key = reading;
  return figure;
}

}  // namespace

Page example_page() {
  Page page("Example <b>page</b>");
  page.verdict(Tone::good, "All is well </script>", "A sentence.", {{"error", "0.31 mm", "rms"}});
  page.heading("Linked in time").figures({over_time("x", 0, 2), over_time("y", 100, -1)}, 1, "Two panels.");
  SpacePath path{.label = "tip <i>", .points_mm = {}};
  for (int i = 0; i < kSamples; ++i) {
    path.points_mm.push_back({5 * std::sin(0.02 * i), 0.001 * i * i, 0.5 * i});
    path.key.push_back(0.1 * i);
  }
  page.heading("In space").space({.paths = {path}, .link = "time"}, "A path.");
  page.heading("Linked by reading").figures({against("one", 1), against("other", -3)}, 2, "Two panels.");
  page.folded("more", [](Page& inside) {
    Figure folded = Figure{}.step("folded", {1, 2, 3}, {1, 4, 9}, Colour::blue);
    // Its name would stand at the right end, where the step to 9 is.
    folded.references.push_back({Reference::Axis::horizontal, 6.0, "limit of the steps"});
    inside.figure(folded, "Not drawn before it is unfolded.");
  });
  return page;
}

}  // namespace bevel::report::testing
