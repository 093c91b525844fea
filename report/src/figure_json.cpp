// SPDX-License-Identifier: MIT
#include <bevel/report/figure_json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include <bevel/report/numbers.hpp>

namespace bevel::report {
namespace {

using Json = nlohmann::ordered_json;

// By decimals, or where the axis is logarithmic or shows hardly anything by significant digits.
Json rounded(const std::vector<double>& values, double extent, bool logarithmic) {
  const bool significant = logarithmic || extent < 1e-4;
  const int decimals = decimals_for(extent * 1e-5, 1);
  const double scale = std::pow(10.0, decimals);
  Json out = Json::array();
  for (const double v : values) {
    if (!std::isfinite(v))
      out.push_back(nullptr);
    else if (significant)
      out.push_back(std::strtod(format_significant(v, 6).c_str(), nullptr));
    else
      out.push_back(std::round(v * scale) / scale + 0.0);  // no -0
  }
  return out;
}

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double v : values)
    if (std::isfinite(v)) most = std::max(most, std::abs(v));
  return most;
}

Json pair_of(const std::pair<double, double>& range) { return Json::array({range.first, range.second}); }

}  // namespace

std::size_t NumberLists::place_of(std::string list) {
  const auto [at, is_new] = places_.try_emplace(list, lists_.size());
  if (is_new) lists_.push_back(std::move(list));
  return at->second;
}

std::string NumberLists::json() const {
  std::string all = "[";
  for (const std::string& list : lists_) all.append(all.size() > 1 ? ",\n" : "").append(list);
  return all + "]";
}

std::string figure_json(const Figure& whole, NumberLists& lists) {
  check(whole);
  const Figure figure = thinned(whole);
  const auto x_range = range_of_x(figure), y_range = range_of_y(figure);
  constexpr const char* kKinds[] = {"line", "dashed", "points", "step", "band", "bars"};
  Json json;
  json["title"] = figure.title;
  json["x"] = figure.x_label;
  json["y"] = figure.y_label;
  json["x_range"] = pair_of(x_range);
  json["y_range"] = pair_of(y_range);
  if (figure.log_x) json["log_x"] = true;
  if (figure.log_y) json["log_y"] = true;
  json["height"] = figure.height_px;
  if (!figure.link.empty()) json["link"] = figure.link;
  const double wide = x_range.second - x_range.first, high = y_range.second - y_range.first;
  json["series"] = Json::array();
  for (std::size_t i = 0; i < figure.series.size(); ++i) {
    const Series& s = figure.series[i];
    Json one;
    one["kind"] = kKinds[static_cast<int>(s.kind)];
    one["label"] = s.label;
    one["colour"] = name_of(s.colour, i);
    if (s.faint) one["faint"] = true;
    one["x"] = lists.place_of(text_of(rounded(s.x, wide, figure.log_x)));
    one["y"] = lists.place_of(text_of(rounded(s.y, high, figure.log_y)));
    if (!s.y_high.empty()) one["high"] = lists.place_of(text_of(rounded(s.y_high, high, figure.log_y)));
    if (!s.key.empty()) one["key"] = lists.place_of(text_of(rounded(s.key, largest(s.key), false)));
    json["series"].push_back(std::move(one));
  }
  for (const Reference& r : figure.references)
    json["references"].push_back({{"level", r.axis == Reference::Axis::horizontal}, {"at", r.at}, {"label", r.label}});
  for (const Span& span : figure.spans) json["spans"].push_back(Json::array({span.from, span.to}));
  return text_of(json);
}

std::string space_json(const Space& whole, NumberLists& lists) {
  check(whole);
  const Space space = thinned(whole);
  constexpr const char* kKinds[] = {"line", "dashed", "points"};
  Json json;
  json["space"] = true;
  json["height"] = space.height_px;
  if (!space.link.empty()) json["link"] = space.link;
  json["paths"] = Json::array();
  for (std::size_t i = 0; i < space.paths.size(); ++i) {
    const SpacePath& p = space.paths[i];
    Json one;
    one["kind"] = kKinds[static_cast<int>(p.kind)];
    one["label"] = p.label;
    one["colour"] = name_of(p.colour, i);
    for (const std::size_t axis : {0, 1, 2}) {
      std::vector<double> values;
      values.reserve(p.points_mm.size());
      for (const auto& at : p.points_mm) values.push_back(at.at(axis));
      one["at"].push_back(lists.place_of(text_of(rounded(values, 100, false))));
    }
    if (!p.key.empty()) one["key"] = lists.place_of(text_of(rounded(p.key, largest(p.key), false)));
    json["paths"].push_back(std::move(one));
  }
  return text_of(json);
}

}  // namespace bevel::report
