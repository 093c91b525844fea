// SPDX-License-Identifier: MIT
// What a page draws, as plain values: a figure of y over x, and a path in space. How it looks, in a browser and on
// paper, is decided in this room, once.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bevel::report {

// Told apart by people with colour blindness (after Okabe and Ito), on white and on black.
enum class Colour { automatic = -1, blue, orange, green, purple, ochre, grey, pink };
inline constexpr int kColours = 7;
// "blue" for blue, and for what is automatic the colour of that place in the figure.
const char* name_of(Colour colour, std::size_t place);

struct Series {
  enum class Kind { line, dashed, points, step, band, bars };
  Kind kind = Kind::line;
  std::string label;                // in the legend; "" keeps it out
  std::vector<double> x;            // NaN: known by its key, but not seen here
  std::vector<double> y;            // NaN makes a gap
  std::vector<double> y_high = {};  // band and bars: y is the lower end
  Colour colour = Colour::automatic;
  bool faint = false;  // points so many that each is to be seen through
  // What a sample is known by in linked figures, one per sample; empty: its x.
  std::vector<double> key = {};
};

struct Reference {
  enum class Axis { horizontal, vertical };
  Axis axis = Axis::horizontal;
  double at = 0.0;
  std::string label;
};

struct Span {
  double from = 0.0, to = 0.0;
};

struct Figure {
  std::string title;
  std::string x_label;  // with the unit: "depth (mm)"
  std::string y_label;
  std::vector<Series> series;
  std::vector<Reference> references;
  std::vector<Span> spans;  // shaded stretches of x
  std::optional<std::pair<double, double>> x_range;
  std::optional<std::pair<double, double>> y_range;
  bool log_x = false;
  bool log_y = false;
  // Figures of one name point at the same sample when the pointer rests on one of them: in each that whose key is
  // nearest. Those without keys, whose samples are known by their x, share their stretch of x as well.
  std::string link;
  int height_px = 300;

  // For chaining: figure.line("data", x, y).band("99 %", x, low, high).
  Figure& line(std::string label, std::vector<double> x, std::vector<double> y, Colour colour = Colour::automatic);
  Figure& dashed(std::string label, std::vector<double> x, std::vector<double> y, Colour colour = Colour::automatic);
  Figure& points(std::string label, std::vector<double> x, std::vector<double> y, Colour colour = Colour::automatic);
  Figure& step(std::string label, std::vector<double> x, std::vector<double> y, Colour colour = Colour::automatic);
  Figure& band(std::string label, std::vector<double> x, std::vector<double> low, std::vector<double> high,
               Colour colour = Colour::automatic);
  Figure& bars(std::string label, std::vector<double> x, std::vector<double> low, std::vector<double> high,
               Colour colour = Colour::automatic);
};

// Throws ArgumentError, naming figure and series, if lengths differ or nothing finite is there to show.
void check(const Figure& figure);

// As it is shown: series longer than a picture has room for are thinned (thinned.hpp).
Figure thinned(Figure figure, std::size_t most = 1500);

// What the axes must hold: the given range, or all finite values with a little room; on a logarithmic axis those above
// zero.
std::pair<double, double> range_of_x(const Figure& figure);
std::pair<double, double> range_of_y(const Figure& figure);

// Paths of the tip in {A}, mm; z, the way in, is drawn to the right. All three axes have one scale.
struct SpacePath {
  enum class Kind { line, dashed, points };
  Kind kind = Kind::line;
  std::string label;
  std::vector<std::array<double, 3>> points_mm;
  Colour colour = Colour::automatic;
  std::vector<double> key = {};  // as in Series; empty: linked to nothing
};
struct Space {
  std::vector<SpacePath> paths;
  std::string link = {};
  int height_px = 380;
};
void check(const Space& space);
Space thinned(Space space, std::size_t most = 800);

}  // namespace bevel::report
