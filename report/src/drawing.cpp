// SPDX-License-Identifier: MIT
#include <bevel/report/drawing.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <bevel/report/html_text.hpp>
#include <bevel/report/numbers.hpp>

namespace bevel::report {
namespace {

// A tenth of a pixel is as fine as anything is seen.
std::string px(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  std::string out = text;
  if (out.ends_with(".0")) out.resize(out.size() - 2);
  return out == "-0" ? "0" : out;
}

bool drawable(Point p) { return std::isfinite(p.x) && std::isfinite(p.y); }

std::string attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + std::string(value) + "\"";
}

std::string stroke_attributes(const Stroke& stroke) {
  std::string text = attribute("stroke", stroke.colour) + attribute("stroke-width", px(stroke.width));
  if (!stroke.dashes.empty()) text += attribute("stroke-dasharray", stroke.dashes);
  if (stroke.opacity < 1) text += attribute("stroke-opacity", number(stroke.opacity, 2));
  return text;
}

std::string path_of(const std::vector<Point>& points) {
  std::string d;
  bool pen_down = false;
  for (const Point p : points) {
    if (!drawable(p)) {
      pen_down = false;
      continue;
    }
    d += (pen_down ? "L" : "M") + px(p.x) + " " + px(p.y);
    pen_down = true;
  }
  return d;
}

}  // namespace

Drawing& Drawing::line(Point from, Point to, const Stroke& stroke) { return curve({from, to}, stroke); }

Drawing& Drawing::curve(const std::vector<Point>& points, const Stroke& stroke) {
  const std::string d = path_of(points);
  if (!d.empty()) body_ += "<path fill=\"none\"" + attribute("d", d) + stroke_attributes(stroke) + "/>\n";
  return *this;
}

Drawing& Drawing::area(const std::vector<Point>& outline, std::string_view colour, double opacity) {
  const std::string d = path_of(outline);
  if (d.empty()) return *this;
  body_ += "<path" + attribute("d", d + "Z") + attribute("fill", colour) +
           attribute("fill-opacity", number(opacity, 2)) + "/>\n";
  return *this;
}

// One path for all: a line of no length with round ends is a dot.
Drawing& Drawing::dots(const std::vector<Point>& points, double radius, std::string_view colour, double opacity) {
  std::string d;
  for (const Point p : points)
    if (drawable(p)) d += "M" + px(p.x) + " " + px(p.y) + "h0";
  if (d.empty()) return *this;
  body_ += "<path fill=\"none\" stroke-linecap=\"round\"" + attribute("d", d) +
           stroke_attributes({.colour = colour, .width = 2 * radius, .opacity = opacity}) + "/>\n";
  return *this;
}

Drawing& Drawing::rectangle(const Box& box, std::string_view colour, double opacity, std::string_view hint) {
  body_ += "<rect" + attribute("x", px(box.left)) + attribute("y", px(box.top)) + attribute("width", px(box.width)) +
           attribute("height", px(box.height)) + attribute("fill", colour);
  if (opacity < 1) body_ += attribute("fill-opacity", number(opacity, 2));
  body_ += hint.empty() ? "/>\n" : "><title>" + escape_html(hint) + "</title></rect>\n";
  return *this;
}

Drawing& Drawing::text(Point at, std::string_view words, const Lettering& lettering) {
  constexpr const char* kAnchors[] = {"start", "middle", "end"};
  body_ += "<text" + attribute("x", px(at.x)) + attribute("y", px(at.y)) + attribute("fill", lettering.colour);
  if (lettering.size != 12) body_ += attribute("font-size", px(lettering.size));
  if (lettering.anchor != Lettering::Anchor::start)
    body_ += attribute("text-anchor", kAnchors[static_cast<int>(lettering.anchor)]);
  if (lettering.bold) body_ += attribute("font-weight", "600");
  if (lettering.turned_deg != 0)
    body_ += attribute("transform", "rotate(" + px(lettering.turned_deg) + " " + px(at.x) + " " + px(at.y) + ")");
  body_ += ">" + escape_html(words) + "</text>\n";
  return *this;
}

Drawing& Drawing::mark(Point at, double radius, std::string_view colour, std::string_view hint) {
  if (!drawable(at)) return *this;
  body_ += "<circle" + attribute("cx", px(at.x)) + attribute("cy", px(at.y)) + attribute("r", px(radius)) +
           attribute("fill", colour) + "><title>" + escape_html(hint) + "</title></circle>\n";
  return *this;
}

// An inner <svg> cuts off what leaves it, and needs no name that would have to be unique in the page.
Drawing& Drawing::clip(const Box& box) {
  const std::string corner = px(box.left) + " " + px(box.top), size = px(box.width) + " " + px(box.height);
  body_ += "<svg" + attribute("x", px(box.left)) + attribute("y", px(box.top)) + attribute("width", px(box.width)) +
           attribute("height", px(box.height)) + attribute("viewBox", corner + " " + size) + ">\n";
  return *this;
}

Drawing& Drawing::unclip() {
  body_ += "</svg>\n";
  return *this;
}

std::string Drawing::svg() const {
  const std::string size = px(width_) + " " + px(height_);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\"" + attribute("viewBox", "0 0 " + size) +
         attribute("width", px(width_)) + attribute("height", px(height_)) +
         " font-family=\"system-ui, Helvetica, Arial, sans-serif\" font-size=\"12\">\n" + body_ + "</svg>";
}

double width_of(std::string_view words, double size) { return 0.56 * size * static_cast<double>(words.size()); }

Axis axis_around(const std::vector<double>& values, std::string label) {
  double low = INFINITY;
  double high = -INFINITY;
  for (const double v : values)
    if (std::isfinite(v)) {
      low = std::min(low, v);
      high = std::max(high, v);
    }
  if (!(low <= high)) low = high = 0;
  const double room = high > low ? 0.04 * (high - low) : std::max(1.0, std::abs(low)) * 0.5;
  return {low - room, high + room, std::move(label)};
}

std::vector<double> ticks(const Axis& axis, int count) {
  std::vector<double> all;
  if (axis.logarithmic) {
    const int low = static_cast<int>(std::ceil(std::log10(axis.low) - 1e-9));
    const int high = static_cast<int>(std::floor(std::log10(axis.high) + 1e-9));
    const int step = std::max(1, (high - low + count - 1) / count);
    for (int power = low; power <= high; power += step) all.push_back(std::pow(10.0, power));
    return all;
  }
  // Of the round steps, the one whose number of ticks comes nearest.
  const double power = std::pow(10.0, std::floor(std::log10((axis.high - axis.low) / count)));
  double step = power;
  double miss = INFINITY;
  for (const double nice : {1.0, 2.0, 5.0, 10.0}) {
    const double fits = (axis.high - axis.low) / (nice * power);
    if (const double off = std::abs(std::log(fits / count)); off < miss) {
      miss = off;
      step = nice * power;
    }
  }
  for (double i = std::ceil(axis.low / step - 1e-9); i * step <= axis.high + 1e-9 * step; ++i) all.push_back(i * step);
  return all;
}

Panel::Panel(Drawing& drawing, const Box& box, Axis x, Axis y, std::string_view title)
    : drawing_(drawing), box_(box), x_(std::move(x)), y_(std::move(y)) {
  const Lettering small{.anchor = Lettering::Anchor::middle, .size = 11, .colour = ink::kSoft};
  const int across = std::max(3, static_cast<int>(box_.width / 60));
  const int upward = std::max(3, static_cast<int>(box_.height / 28));
  for (const double v : ticks(x_, across)) {
    const double left = at(v, y_.low).x;
    drawing_.line({left, box_.top}, {left, box_.bottom()}, {.colour = ink::kGrid});
    drawing_.text({left, box_.bottom() + 14}, number(v, 4), small);
  }
  double widest = 0;
  for (const double v : y_.ruled ? ticks(y_, upward) : std::vector<double>{}) {
    const double top = at(x_.low, v).y;
    drawing_.line({box_.left, top}, {box_.right(), top}, {.colour = ink::kGrid});
    if (!y_.numbered) continue;
    widest = std::max(widest, width_of(number(v, 4), 11));
    drawing_.text({box_.left - 5, top + 4}, number(v, 4),
                  {.anchor = Lettering::Anchor::end, .size = 11, .colour = ink::kSoft});
  }
  drawing_.curve({{box_.left, box_.top}, {box_.left, box_.bottom()}, {box_.right(), box_.bottom()}},
                 {.colour = ink::kFaint});
  if (!x_.label.empty()) drawing_.text({box_.left + box_.width / 2, box_.bottom() + 29}, x_.label, small);
  if (!y_.label.empty()) {
    Lettering turned = small;
    turned.turned_deg = -90;
    drawing_.text({box_.left - 13 - widest, box_.top + box_.height / 2}, y_.label, turned);
  }
  if (!title.empty()) drawing_.text({box_.left, box_.top - 7}, title, {.size = 12, .bold = true});
}

double Panel::fraction(double value, const Axis& axis) const {
  if (axis.logarithmic) return (std::log(value) - std::log(axis.low)) / (std::log(axis.high) - std::log(axis.low));
  return (value - axis.low) / (axis.high - axis.low);
}

Point Panel::at(double x, double y) const {
  return {box_.left + box_.width * fraction(x, x_), box_.bottom() - box_.height * fraction(y, y_)};
}

Panel& Panel::span(double from, double to) {
  const double left = std::clamp(at(from, y_.low).x, box_.left, box_.right());
  const double right = std::clamp(at(to, y_.low).x, box_.left, box_.right());
  drawing_.rectangle({left, box_.top, std::max(right - left, 2.0), box_.height}, ink::kSpan, 0.75);
  return *this;
}

Panel& Panel::band(const std::vector<double>& x, const std::vector<double>& low, const std::vector<double>& high,
                   std::string_view colour) {
  std::vector<Point> outline;
  for (std::size_t i = 0; i < x.size(); ++i) outline.push_back(at(x[i], std::clamp(high[i], y_.low, y_.high)));
  for (std::size_t i = x.size(); i-- > 0;) outline.push_back(at(x[i], std::clamp(low[i], y_.low, y_.high)));
  std::erase_if(outline, [](Point p) { return !drawable(p); });
  drawing_.area(outline, colour, 0.22);
  return *this;
}

Panel& Panel::points(const std::vector<double>& x, const std::vector<double>& y, std::string_view colour,
                     double opacity, double radius) {
  std::vector<Point> inside;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (x[i] >= x_.low && x[i] <= x_.high && y[i] >= y_.low && y[i] <= y_.high) inside.push_back(at(x[i], y[i]));
  drawing_.dots(inside, radius, colour, opacity);
  return *this;
}

Panel& Panel::curve(const std::vector<double>& x, const std::vector<double>& y, const Stroke& stroke) {
  std::vector<Point> all;
  for (std::size_t i = 0; i < x.size(); ++i) all.push_back(at(x[i], std::clamp(y[i], y_.low, y_.high)));
  drawing_.curve(all, stroke);
  return *this;
}

void draw_keys(Drawing& drawing, Point at, const std::vector<Key>& keys) {
  for (const Key& key : keys) {
    drawing.line({at.x, at.y - 4}, {at.x + 18, at.y - 4},
                 {.colour = key.colour, .width = 3, .dashes = key.dashed ? "4,3" : ""});
    drawing.text({at.x + 24, at.y}, key.name);
    at.x += 24 + width_of(key.name) + 22;
  }
}

}  // namespace bevel::report
