// Plots as inline SVG, drawn by gnuplot. Say what is shown; how it looks is decided here, once.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bevel::io {

struct Series {
  enum class Kind { line, dashed, points, step, band };
  Kind kind = Kind::line;
  std::string label;  // in the legend; "" keeps it out
  std::vector<double> x;
  std::vector<double> y;       // NaN makes a gap
  std::vector<double> y_high;  // band only: y is its lower edge
  int colour = -1;             // index into the palette; -1: by the series' place in the plot
};

struct ReferenceLine {
  enum class Axis { horizontal, vertical };
  Axis axis = Axis::horizontal;
  double at = 0.0;
  std::string label;
};

struct Plot {
  enum class Legend { top_left, top_right, bottom_left, bottom_right, below, none };
  std::string title;
  std::string x_label;  // with the unit: "depth (mm)"
  std::string y_label;
  std::vector<Series> series;
  std::vector<ReferenceLine> references;
  std::optional<std::pair<double, double>> x_range;
  std::optional<std::pair<double, double>> y_range;
  bool equal_aspect = false;  // one mm is as long on either axis: for paths
  bool log_x = false;
  bool log_y = false;
  Legend legend = Legend::top_right;
  int width_px = 640;
  int height_px = 360;

  // For chaining: plot.line("data", x, y).band("99 %", x, low, high).
  Plot& line(std::string label, std::vector<double> x, std::vector<double> y, int colour = -1);
  Plot& dashed(std::string label, std::vector<double> x, std::vector<double> y, int colour = -1);
  Plot& points(std::string label, std::vector<double> x, std::vector<double> y, int colour = -1);
  Plot& step(std::string label, std::vector<double> x, std::vector<double> y, int colour = -1);
  Plot& band(std::string label, std::vector<double> x, std::vector<double> low, std::vector<double> high,
             int colour = -1);
};

// An <svg> element to put into a page; ids are unique to the plot's contents, so several fit into one page.
// Throws std::invalid_argument if a series' lengths differ or nothing finite is there to show, std::runtime_error if
// gnuplot is missing or fails (with its own words).
std::string render_svg(const Plot& plot);

// The gnuplot script with the data in it: for looking into a plot by hand, and for tests.
std::string gnuplot_script(const Plot& plot);

}  // namespace bevel::io
