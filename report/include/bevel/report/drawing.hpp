// SPDX-License-Identifier: MIT
// Pictures as inline SVG, drawn straight: figures on paper and where no script runs, and whatever is no plot of y over
// x (bars with names, heat maps). They take a tenth of the bytes of a general plotting program's, and no process.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace bevel::report {

// The page's colours, by name: its style sheet has them for light and for dark ground.
namespace ink {
inline constexpr const char* kText = "var(--ink)";
inline constexpr const char* kSoft = "var(--soft)";
inline constexpr const char* kFaint = "var(--faint)";
inline constexpr const char* kGrid = "var(--grid)";
inline constexpr const char* kGround = "var(--ground)";
inline constexpr const char* kSpan = "var(--span)";
inline constexpr const char* kBlue = "var(--blue)";
inline constexpr const char* kOrange = "var(--orange)";
inline constexpr const char* kGreen = "var(--green)";
inline constexpr const char* kRed = "var(--red)";
}  // namespace ink

struct Point {
  double x = 0, y = 0;
};

struct Box {
  double left = 0, top = 0, width = 0, height = 0;
  double right() const { return left + width; }
  double bottom() const { return top + height; }
};

struct Stroke {
  std::string_view colour = ink::kText;
  double width = 1;
  std::string_view dashes = "";  // "5,4"
  double opacity = 1;
};

struct Lettering {
  enum class Anchor { start, middle, end };
  Anchor anchor = Anchor::start;
  double size = 12;
  std::string_view colour = ink::kText;
  bool bold = false;
  double turned_deg = 0;
};

// Coordinates are pixels of a page 832 wide, y downwards. A point that is not finite breaks a line and is no dot.
class Drawing {
 public:
  Drawing(double width, double height) : width_(width), height_(height) {}

  Drawing& line(Point from, Point to, const Stroke& stroke = {});
  Drawing& curve(const std::vector<Point>& points, const Stroke& stroke);
  Drawing& area(const std::vector<Point>& outline, std::string_view colour, double opacity = 1);
  Drawing& dots(const std::vector<Point>& points, double radius, std::string_view colour, double opacity = 1);
  Drawing& rectangle(const Box& box, std::string_view colour, double opacity = 1, std::string_view hint = "");
  // A dot that tells its value when the pointer rests on it.
  Drawing& mark(Point at, double radius, std::string_view colour, std::string_view hint);
  Drawing& text(Point at, std::string_view words, const Lettering& lettering = {});
  // What is drawn between these two is cut off at the edges of the box.
  Drawing& clip(const Box& box);
  Drawing& unclip();

  double width() const { return width_; }
  std::string svg() const;

 private:
  double width_, height_;
  std::string body_;
};

// About how wide words are set, for margins.
double width_of(std::string_view words, double size = 12);

struct Axis {
  double low = 0, high = 1;
  std::string label;
  bool logarithmic = false;
  bool numbered = true;
  bool ruled = true;  // lines across the panel at its ticks; numbers go with them
};
// Around all finite values, with a little room; of equal values, around them.
Axis axis_around(const std::vector<double>& values, std::string label);
// Round numbers within the axis: about `count`, or powers of ten on a logarithmic one.
std::vector<double> ticks(const Axis& axis, int count = 4);

// One panel of a picture: a frame, ticks and labels, and what is drawn into it, cut off at its edges.
class Panel {
 public:
  // The box is the plotting area; ticks and labels stand outside it, left and below.
  Panel(Drawing& drawing, const Box& box, Axis x, Axis y, std::string_view title = "");

  // Lighter than what is drawn afterwards, so first.
  Panel& span(double from, double to);
  Panel& band(const std::vector<double>& x, const std::vector<double>& low, const std::vector<double>& high,
              std::string_view colour);
  Panel& points(const std::vector<double>& x, const std::vector<double>& y, std::string_view colour, double opacity,
                double radius = 1.1);
  Panel& curve(const std::vector<double>& x, const std::vector<double>& y, const Stroke& stroke);

  Point at(double x, double y) const;

 private:
  double fraction(double value, const Axis& axis) const;
  Drawing& drawing_;
  Box box_;
  Axis x_, y_;
};

// Coloured marks and their names in a row.
struct Key {
  std::string_view colour;
  std::string name;
  bool dashed = false;
};
void draw_keys(Drawing& drawing, Point at, const std::vector<Key>& keys);

}  // namespace bevel::report
