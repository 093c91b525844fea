// SPDX-License-Identifier: MIT
#include <bevel/report/figure_svg.hpp>

#include <algorithm>
#include <cmath>
#include <functional>

#include <bevel/report/drawing.hpp>
#include <bevel/report/label_place.hpp>

namespace bevel::report {
namespace {

std::string ink_of(Colour colour, std::size_t place) { return std::string("var(--") + name_of(colour, place) + ")"; }

// A staircase: a value holds until the next.
void draw_steps(Panel& panel, const Series& s, const Stroke& stroke) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (i > 0) {
      x.push_back(s.x[i]);
      y.push_back(s.y[i - 1]);
    }
    x.push_back(s.x[i]);
    y.push_back(s.y[i]);
  }
  panel.curve(x, y, stroke);
}

// One area for each unbroken stretch, a bar where a sample stands alone.
void draw_band(Drawing& drawing, Panel& panel, const Series& s, const std::string& colour) {
  std::vector<double> x, low, high;
  for (std::size_t i = 0; i <= s.x.size(); ++i) {
    if (i < s.x.size() && std::isfinite(s.y[i]) && std::isfinite(s.y_high[i])) {
      x.push_back(s.x[i]);
      low.push_back(s.y[i]);
      high.push_back(s.y_high[i]);
      continue;
    }
    if (x.size() == 1)
      drawing.line(panel.at(x[0], low[0]), panel.at(x[0], high[0]), {.colour = colour, .width = 5, .opacity = 0.3});
    if (x.size() > 1) panel.band(x, low, high, colour);
    x.clear(), low.clear(), high.clear();
  }
}

void draw_series(Drawing& drawing, Panel& panel, const Series& s, const std::string& colour) {
  switch (s.kind) {
    case Series::Kind::line:
      panel.curve(s.x, s.y, {.colour = colour, .width = 1.8});
      break;
    case Series::Kind::dashed:
      panel.curve(s.x, s.y, {.colour = colour, .width = 1.6, .dashes = "6,4"});
      break;
    case Series::Kind::points:
      panel.points(s.x, s.y, colour, s.faint ? 0.25 : 0.9, s.faint ? 1.1 : s.x.size() > 60 ? 1.6 : 3);
      break;
    case Series::Kind::step:
      draw_steps(panel, s, {.colour = colour, .width = 1.6});
      break;
    case Series::Kind::band:
      draw_band(drawing, panel, s, colour);
      break;
    case Series::Kind::bars:
      for (std::size_t i = 0; i < s.x.size(); ++i)
        drawing.line(panel.at(s.x[i], s.y[i]), panel.at(s.x[i], s.y_high[i]),
                     {.colour = colour, .width = 3, .opacity = 0.55});
      break;
  }
}

// What of a series a name should not lie over. A band is its two edges: on its colour a name is read well.
void add_edges(const Series& s, const Panel& panel, std::vector<Edge>& edges) {
  const auto add = [&](Point from, Point to) {
    if (std::isfinite(from.x + from.y + to.x + to.y)) edges.emplace_back(from, to);
  };
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const Point here = panel.at(s.x[i], s.y[i]);
    const bool ranged = s.kind == Series::Kind::bars || s.kind == Series::Kind::band;
    if (s.kind == Series::Kind::points || ranged) add(here, ranged ? panel.at(s.x[i], s.y_high[i]) : here);
    if (s.kind == Series::Kind::points || s.kind == Series::Kind::bars || i == 0) continue;
    const Point before = panel.at(s.x[i - 1], s.y[i - 1]);
    if (s.kind == Series::Kind::step) {
      add(before, {here.x, before.y});
      add({here.x, before.y}, here);
    } else {
      add(before, here);
      if (ranged) add(panel.at(s.x[i - 1], s.y_high[i - 1]), panel.at(s.x[i], s.y_high[i]));
    }
  }
}

// The names of the references, each where nothing is drawn, if there is such a place on its line.
void name_references(Drawing& drawing, const Panel& panel, const Box& plot, const Figure& figure) {
  std::vector<Edge> edges;
  for (const Series& s : figure.series) add_edges(s, panel, edges);
  for (const Reference& r : figure.references) {
    if (r.label.empty()) continue;
    const bool level = r.axis == Reference::Axis::horizontal;
    const Point on = level ? panel.at(range_of_x(figure).first, r.at) : panel.at(r.at, range_of_y(figure).first);
    const Box place = least_crossed(places_on(plot, level, level ? on.y : on.x, width_of(r.label, 11)), edges);
    drawing.text({place.left, place.bottom() - 2}, r.label, {.size = 11, .colour = ink::kSoft});
    edges.push_back({{place.left, place.top}, {place.right(), place.bottom()}});
    edges.push_back({{place.left, place.bottom()}, {place.right(), place.top}});
  }
}

// Rows of names as wide as the picture; gives the height that they take.
double draw_legend(Drawing* drawing, const std::vector<Key>& keys, double left, double width) {
  double x = left, y = 14;
  for (const Key& key : keys) {
    const double wide = 46 + width_of(key.name);
    if (x > left && x + wide > left + width) {
      x = left;
      y += 18;
    }
    if (drawing != nullptr) draw_keys(*drawing, {x, y}, {key});
    x += wide;
  }
  return keys.empty() ? 0 : y + 6;
}

}  // namespace

std::string figure_svg(const Figure& whole, double width_px) {
  check(whole);
  const Figure figure = thinned(whole);
  const auto [x_low, x_high] = range_of_x(figure);
  const auto [y_low, y_high] = range_of_y(figure);
  constexpr double kLeft = 62, kRight = 12, kBelow = 38;
  std::vector<std::string> inks;
  std::vector<Key> keys;
  inks.reserve(figure.series.size());
  for (std::size_t i = 0; i < figure.series.size(); ++i) {
    const Series& s = figure.series[i];
    inks.push_back(ink_of(s.colour, i));
    if (!s.label.empty()) keys.push_back({inks.back(), s.label, s.kind == Series::Kind::dashed});
  }
  const double legend = draw_legend(nullptr, keys, kLeft, width_px - kLeft - kRight);
  const double top = legend + (figure.title.empty() ? 8 : 24);
  Drawing drawing(width_px, top + figure.height_px + kBelow);
  draw_legend(&drawing, keys, kLeft, width_px - kLeft - kRight);
  const Box box{kLeft, top, width_px - kLeft - kRight, static_cast<double>(figure.height_px)};
  Panel panel(drawing, box, {x_low, x_high, figure.x_label, figure.log_x},
              {y_low, y_high, figure.y_label, figure.log_y}, figure.title);
  drawing.clip(box);
  for (const Span& span : figure.spans) panel.span(span.from, span.to);
  for (const Reference& r : figure.references) {
    const bool level = r.axis == Reference::Axis::horizontal;
    const Point from = level ? panel.at(x_low, r.at) : panel.at(r.at, y_low);
    const Point to = level ? panel.at(x_high, r.at) : panel.at(r.at, y_high);
    drawing.line(from, to, {.colour = ink::kSoft, .width = 1, .dashes = "3,3"});
  }
  for (std::size_t i = 0; i < figure.series.size(); ++i) draw_series(drawing, panel, figure.series[i], inks[i]);
  name_references(drawing, panel, box, figure);
  drawing.unclip();
  return drawing.svg();
}

std::string space_svg(const Space& whole, double width_px) {
  check(whole);
  const Space space = thinned(whole);
  // The page's script turns the same way (report.js): z to the right, x towards the eye, y up, turned and tilted.
  constexpr double kTurn_rad = -0.6, kTilt_rad = 0.45;
  const double c = std::cos(kTurn_rad), s = std::sin(kTurn_rad);
  const double ct = std::cos(kTilt_rad), st = std::sin(kTilt_rad);
  const auto turned = [&](const std::array<double, 3>& p) {
    return Point{c * p[2] - s * p[0], ct * p[1] - st * (s * p[2] + c * p[0])};
  };
  std::array<double, 3> low{0, 0, 0}, high{0, 0, 0};
  for (const SpacePath& path : space.paths)
    for (const auto& p : path.points_mm)
      for (std::size_t i = 0; i < 3; ++i)
        if (std::isfinite(p.at(i))) {
          low.at(i) = std::min(low.at(i), p.at(i));
          high.at(i) = std::max(high.at(i), p.at(i));
        }
  const double across = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  const double radius_mm = std::max(0.55 * across, 1e-6);
  const double height_px = space.height_px;
  const double px_per_mm = 0.5 * std::min(width_px, 1.9 * height_px) / radius_mm;
  const Point middle = turned({(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2});
  const auto at = [&](const std::array<double, 3>& p) {
    const Point flat = turned(p);
    return Point{width_px / 2 + px_per_mm * (flat.x - middle.x), height_px / 2 - px_per_mm * (flat.y - middle.y) + 20};
  };
  std::vector<Key> keys;
  std::vector<std::string> inks;
  inks.reserve(space.paths.size());  // keys look into them
  for (std::size_t i = 0; i < space.paths.size(); ++i) {
    inks.push_back(ink_of(space.paths[i].colour, i));
    if (!space.paths[i].label.empty())
      keys.push_back({inks.back(), space.paths[i].label, space.paths[i].kind == SpacePath::Kind::dashed});
  }
  Drawing drawing(width_px, height_px + 20);
  draw_legend(&drawing, keys, 12, width_px - 24);
  const double side = std::max({10.0, -low[0], high[0], -low[1], high[1]});
  const auto draw_axis = [&](const std::array<double, 3>& tip, const std::string& name) {
    drawing.line(at({0, 0, 0}), at(tip), {.colour = ink::kFaint});
    drawing.text({at(tip).x + 4, at(tip).y + 4}, name, {.size = 11, .colour = ink::kSoft});
  };
  const auto in_mm = [](double mm) { return std::to_string(std::lround(mm)) + " mm"; };
  draw_axis({side, 0, 0}, "x " + in_mm(side));
  draw_axis({0, side, 0}, "y " + in_mm(side));
  draw_axis({0, 0, high[2]}, "z " + in_mm(high[2]));
  for (std::size_t i = 0; i < space.paths.size(); ++i) {
    const SpacePath& path = space.paths[i];
    std::vector<Point> points;
    for (const auto& p : path.points_mm) points.push_back(at(p));
    if (path.kind == SpacePath::Kind::points)
      drawing.dots(points, points.size() > 60 ? 1.3 : 4, inks[i], 0.9);
    else
      drawing.curve(points,
                    {.colour = inks[i], .width = 1.8, .dashes = path.kind == SpacePath::Kind::dashed ? "6,4" : ""});
  }
  return drawing.svg();
}

}  // namespace bevel::report
