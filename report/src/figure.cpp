// SPDX-License-Identifier: MIT
#include <bevel/report/figure.hpp>

#include <algorithm>
#include <cmath>

#include <bevel/error.hpp>
#include <bevel/report/thinned.hpp>

namespace bevel::report {
namespace {

constexpr const char* kNames[kColours] = {"blue", "orange", "green", "purple", "ochre", "grey", "pink"};

void add(Figure& figure, Series::Kind kind, std::string label, std::vector<double> x, std::vector<double> y,
         std::vector<double> y_high, Colour colour) {
  figure.series.push_back({.kind = kind,
                           .label = std::move(label),
                           .x = std::move(x),
                           .y = std::move(y),
                           .y_high = std::move(y_high),
                           .colour = colour});
}

std::vector<double> at(const std::vector<double>& values, const std::vector<std::size_t>& kept) {
  std::vector<double> some;
  if (values.empty()) return some;
  some.reserve(kept.size());
  for (const std::size_t i : kept) some.push_back(values[i]);
  return some;
}

class Range {
 public:
  explicit Range(bool logarithmic) : logarithmic_(logarithmic) {}
  void add(double v) {
    if (!std::isfinite(v) || (logarithmic_ && v <= 0)) return;
    low_ = std::min(low_, v);
    high_ = std::max(high_, v);
  }
  std::pair<double, double> with_room() const {
    if (!(low_ <= high_)) return logarithmic_ ? std::pair(0.1, 10.0) : std::pair(0.0, 1.0);
    if (logarithmic_) return {low_ / 1.3, high_ * 1.3};
    const double room = high_ > low_ ? 0.04 * (high_ - low_) : (low_ != 0 ? std::abs(low_) * 0.5 : 0.5);
    return {low_ - room, high_ + room};
  }

 private:
  bool logarithmic_;
  double low_ = INFINITY, high_ = -INFINITY;
};

}  // namespace

const char* name_of(Colour colour, std::size_t place) {
  const std::size_t index = colour == Colour::automatic ? place : static_cast<std::size_t>(colour);
  return kNames[index % kColours];
}

Figure& Figure::line(std::string label, std::vector<double> x, std::vector<double> y, Colour colour) {
  add(*this, Series::Kind::line, std::move(label), std::move(x), std::move(y), {}, colour);
  return *this;
}
Figure& Figure::dashed(std::string label, std::vector<double> x, std::vector<double> y, Colour colour) {
  add(*this, Series::Kind::dashed, std::move(label), std::move(x), std::move(y), {}, colour);
  return *this;
}
Figure& Figure::points(std::string label, std::vector<double> x, std::vector<double> y, Colour colour) {
  add(*this, Series::Kind::points, std::move(label), std::move(x), std::move(y), {}, colour);
  return *this;
}
Figure& Figure::step(std::string label, std::vector<double> x, std::vector<double> y, Colour colour) {
  add(*this, Series::Kind::step, std::move(label), std::move(x), std::move(y), {}, colour);
  return *this;
}
Figure& Figure::band(std::string label, std::vector<double> x, std::vector<double> low, std::vector<double> high,
                     Colour colour) {
  add(*this, Series::Kind::band, std::move(label), std::move(x), std::move(low), std::move(high), colour);
  return *this;
}
Figure& Figure::bars(std::string label, std::vector<double> x, std::vector<double> low, std::vector<double> high,
                     Colour colour) {
  add(*this, Series::Kind::bars, std::move(label), std::move(x), std::move(low), std::move(high), colour);
  return *this;
}

void check(const Figure& figure) {
  bool something = false;
  for (const Series& s : figure.series) {
    const bool two_ends = s.kind == Series::Kind::band || s.kind == Series::Kind::bars;
    const std::string who =
        "figure \"" + figure.title + "\", series \"" + s.label + "\": " + std::to_string(s.x.size());
    if (s.x.size() != s.y.size()) throw ArgumentError(who + " x for " + std::to_string(s.y.size()) + " y");
    if (s.y_high.size() != (two_ends ? s.x.size() : 0))
      throw ArgumentError(who + " x for " + std::to_string(s.y_high.size()) + " upper ends");
    if (!s.key.empty() && s.key.size() != s.x.size())
      throw ArgumentError(who + " x for " + std::to_string(s.key.size()) + " keys");
    for (std::size_t i = 0; i < s.x.size(); ++i)
      something = something || (std::isfinite(s.x[i]) && std::isfinite(s.y[i]));
  }
  if (!something) throw ArgumentError("figure \"" + figure.title + "\": nothing finite to show");
}

Figure thinned(Figure figure, std::size_t most) {
  for (Series& s : figure.series) {
    if (s.x.size() <= most) continue;
    // Of a band or of bars the lower end's lows and the upper end's highs.
    const auto kept =
        s.y_high.empty() ? thinned(s.y, most) : joined(thinned(s.y, most / 2), thinned(s.y_high, most / 2));
    s.x = at(s.x, kept);
    s.y = at(s.y, kept);
    s.y_high = at(s.y_high, kept);
    s.key = at(s.key, kept);
  }
  return figure;
}

std::pair<double, double> range_of_x(const Figure& figure) {
  if (figure.x_range) return *figure.x_range;
  Range range(figure.log_x);
  for (const Series& s : figure.series)
    for (std::size_t i = 0; i < s.x.size(); ++i)
      if (std::isfinite(s.y[i])) range.add(s.x[i]);
  return range.with_room();
}

std::pair<double, double> range_of_y(const Figure& figure) {
  if (figure.y_range) return *figure.y_range;
  Range range(figure.log_y);
  for (const Series& s : figure.series) {
    for (const double y : s.y) range.add(y);
    for (const double y : s.y_high) range.add(y);
  }
  for (const Reference& r : figure.references)
    if (r.axis == Reference::Axis::horizontal) range.add(r.at);
  return range.with_room();
}

void check(const Space& space) {
  bool something = false;
  for (const SpacePath& p : space.paths) {
    if (!p.key.empty() && p.key.size() != p.points_mm.size())
      throw ArgumentError("path \"" + p.label + "\": " + std::to_string(p.points_mm.size()) + " points for " +
                          std::to_string(p.key.size()) + " keys");
    for (const auto& at : p.points_mm)
      something = something || (std::isfinite(at[0]) && std::isfinite(at[1]) && std::isfinite(at[2]));
  }
  if (!something) throw ArgumentError("paths in space: nothing finite to show");
}

Space thinned(Space space, std::size_t most) {
  for (SpacePath& p : space.paths) {
    if (p.points_mm.size() <= most) continue;
    std::vector<std::size_t> kept;
    for (const std::size_t axis : {0, 1, 2}) {
      std::vector<double> values;
      for (const auto& point : p.points_mm) values.push_back(point.at(axis));
      kept = joined(kept, thinned(values, most / 3));
    }
    std::vector<std::array<double, 3>> points_mm;
    for (const std::size_t i : kept) points_mm.push_back(p.points_mm[i]);
    p.key = at(p.key, kept);
    p.points_mm = std::move(points_mm);
  }
  return space;
}

}  // namespace bevel::report
