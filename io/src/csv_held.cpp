// SPDX-License-Identifier: MIT
#include "csv_held.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include <bevel/io/base_lag.hpp>
#include <bevel/io/held_values.hpp>

namespace bevel::io {
namespace {

struct HeldColumn {
  std::vector<std::size_t> rows;  // that have the value
  HeldValues held;
};

/// Detects held values among the rows that have a value. same(a, b): whether two rows have the same one.
template <class Has, class Same>
std::optional<HeldColumn> find_held(const std::vector<CsvRow>& rows, Has&& has, Same&& same) {
  HeldColumn column;
  std::vector<std::int64_t> times_us;
  std::vector<bool> is_new;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!has(rows[i])) continue;
    is_new.push_back(column.rows.empty() || !same(rows[column.rows.back()], rows[i]));
    column.rows.push_back(i);
    times_us.push_back(rows[i].utime);
  }
  auto held = find_held_values(times_us, is_new);
  if (!held) return std::nullopt;
  column.held = std::move(*held);
  return column;
}

template <class Clear>
void clear_repeated(std::vector<CsvRow>& rows, const HeldColumn& column, Clear&& clear) {
  for (std::size_t i = 0; i < column.rows.size(); ++i)
    if (!column.held.is_update[i]) clear(rows[column.rows[i]]);
}

std::string sentence(const char* name, const HeldColumn& column, const char* what) {
  std::array<char, 300> text;
  std::snprintf(text.data(), text.size(),
                "%s: a new value every %.3g s, rows every %.3g s; %zu of %zu rows repeat a value%s", name,
                column.held.period_s, column.held.row_interval_s, column.held.repeated, column.rows.size(), what);
  return text.data();
}

std::vector<model::ActuatorState> states_of(const std::vector<CsvRow>& rows, bool has_rotation) {
  std::vector<model::ActuatorState> states;
  for (const BaseReading& reading : base_motion(rows, has_rotation)) states.push_back(reading.axes);
  return states;
}

std::vector<model::TipMeasurement> tips_of(const std::vector<CsvRow>& rows) {
  std::vector<model::TipMeasurement> tips;
  for (const CsvRow& row : rows)
    if (row.tip) {
      tips.push_back(*row.tip);
      tips.back().utime = row.utime;
    }
  return tips;
}

}  // namespace

std::vector<std::string> remove_held_values(std::vector<CsvRow>& tip_rows, std::vector<CsvRow>& base_rows,
                                            bool has_rotation) {
  constexpr const char* kLeftOut = ", which is left out";
  std::vector<std::string> sentences;
  const auto tip = find_held(
      tip_rows, [](const CsvRow& row) { return row.tip.has_value(); },
      [](const CsvRow& a, const CsvRow& b) { return a.tip->position_mm == b.tip->position_mm; });
  if (tip) {
    clear_repeated(tip_rows, *tip, [](CsvRow& row) { row.tip.reset(); });
    sentences.push_back(sentence("tip", *tip, kLeftOut));
  }
  const auto heading = find_held(
      tip_rows, [](const CsvRow& row) { return row.heading.has_value(); },
      [](const CsvRow& a, const CsvRow& b) { return a.heading->heading == b.heading->heading; });
  if (heading) {
    clear_repeated(tip_rows, *heading, [](CsvRow& row) { row.heading.reset(); });
    sentences.push_back(sentence("heading", *heading, kLeftOut));
  }
  const auto insertion = find_held(
      base_rows, [](const CsvRow& row) { return row.insertion_mm.has_value(); },
      [](const CsvRow& a, const CsvRow& b) { return a.insertion_mm == b.insertion_mm; });
  if (!insertion) return sentences;
  std::vector<CsvRow> updates = base_rows;
  clear_repeated(updates, *insertion, [](CsvRow& row) { row.insertion_mm.reset(); });
  const auto rotation = find_held(
      base_rows, [](const CsvRow& row) { return row.rotation_rad.has_value(); },
      [](const CsvRow& a, const CsvRow& b) { return a.rotation_rad == b.rotation_rad; });
  const bool together =
      rotation && std::abs(rotation->held.period_s - insertion->held.period_s) <= insertion->held.row_interval_s;
  if (together) clear_repeated(updates, *rotation, [](CsvRow& row) { row.rotation_rad.reset(); });
  const auto tips = tips_of(tip_rows);
  const auto as_given = estimate_base_lag(states_of(base_rows, has_rotation), tips);
  const auto interpolated = estimate_base_lag(states_of(updates, has_rotation), tips);
  // With two rows in a period both are the same but for a lag; steps that are real leave much less than this.
  constexpr double kShareOfRealSteps = 0.8;
  if (!as_given || !interpolated) {
    sentences.push_back(sentence("insertion", *insertion, "; not interpolated: too few tips to compare with"));
  } else if (as_given->rms_mm < kShareOfRealSteps * interpolated->rms_mm) {
    sentences.push_back(sentence("insertion", *insertion, "; not interpolated: the tip moves in the same steps"));
  } else {
    base_rows = std::move(updates);
    sentences.push_back(sentence("insertion", *insertion, "; interpolated between the new values"));
    if (together) sentences.push_back(sentence("rotation", *rotation, "; interpolated between the new values"));
  }
  return sentences;
}

}  // namespace bevel::io
