// SPDX-License-Identifier: MIT
#include <bevel/io/csv_import.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/error.hpp>
#include <bevel/io/csv_table.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include <bevel/io/motion_gap.hpp>
#include <bevel/io/recording_clock.hpp>
#include <bevel/io/second_insertion.hpp>
#include "csv_checks.hpp"
#include "csv_held.hpp"
#include "csv_rows.hpp"

namespace bevel::io {
namespace {

constexpr std::size_t kRemarks = 10;

PlacedReadings placed(const std::vector<CsvRow>& rows, const std::vector<BaseReading>& base) {
  PlacedReadings out;
  for (const BaseReading& reading : base) out.base.push_back({reading.axes, reading.line});
  for (const CsvRow& row : rows) {
    if (row.tip) {
      out.tips.push_back({*row.tip, row.line});
      out.tips.back().sample.utime = row.utime;
    }
    if (row.heading) {
      out.headings.push_back({*row.heading, row.line});
      out.headings.back().sample.utime = row.utime;
    }
  }
  return out;
}

std::string span_s(std::int64_t first_us, std::int64_t last_us) {
  return format_number(static_cast<double>(first_us) * 1e-6) + " to " +
         format_number(static_cast<double>(last_us) * 1e-6) + " s";
}

// Where the base was is not known before its first reading nor after its last.
int leave_out_without_base(PlacedReadings& readings, const std::string& tip_path, const std::string& base_path) {
  if (readings.base.empty())
    throw ParseError(base_path + ": no row tells where the base was (insertion, rotation) by this column map");
  if (readings.tips.empty() && readings.headings.empty())
    throw ParseError(tip_path + ": no row tells where the tip was by this column map");
  const std::int64_t first = readings.base.front().sample.utime, last = readings.base.back().sample.utime;
  const auto outside = [&](const auto& p) { return p.sample.utime < first || p.sample.utime > last; };
  const auto& tips = readings.tips;
  const std::string tip_span = tips.empty() ? "" : span_s(tips.front().sample.utime, tips.back().sample.utime);
  const auto gone = std::erase_if(readings.tips, outside) + std::erase_if(readings.headings, outside);
  if (readings.tips.empty() && readings.headings.empty())
    throw ParseError(tip_path + ": the tip was read at " + tip_span + ", the base at " + span_s(first, last) + " (" +
                     base_path + "): they have no time in common. Are the units and clocks the same? " +
                     "offset_s in [time] or [base.time] is added to a clock");
  return static_cast<int>(gone);
}

void require_one_insertion(const PlacedReadings& readings, const std::string& base_path) {
  std::vector<model::ActuatorState> base;
  for (const auto& p : readings.base) base.push_back(p.sample);
  const auto second = second_insertion(base);
  if (second)
    throw ParseError(base_path + ":" + std::to_string(readings.base[*second].line) +
                     ": a second insertion begins: here the needle is back at the entry point, and below it is "
                     "inserted again by more than " +
                     format_number(kInserted_mm) +
                     " mm. Allowed: one insertion in each file. Cut the file at this row");
}

template <class Sample>
std::vector<Sample> samples_of(const std::vector<Placed<Sample>>& placed) {
  std::vector<Sample> out;
  for (const auto& p : placed) out.push_back(p.sample);
  return out;
}

// Estimates {A} and moves tips and headings into it.
EntryFrame move_to_entry_frame(PlacedReadings& readings, const ColumnMap& map, const std::string& tip_path) {
  EntryFrame frame;
  try {
    frame = fit_entry_frame(samples_of(readings.base), samples_of(readings.tips));
  } catch (const Error& e) {
    throw ParseError(tip_path + ": " + e.what());
  }
  for (auto& tip : readings.tips) tip.sample.position_mm = frame.to_A * (tip.sample.position_mm - frame.origin_mm);
  const double information_per_rad2 = 1 / (map.heading_sd_rad * map.heading_sd_rad);
  for (auto& heading : readings.headings) {
    const model::TipHeading turned = heading_along(frame.to_A * heading.sample.heading, information_per_rad2);
    heading.sample.heading = turned.heading;
    heading.sample.information_per_rad2 = turned.information_per_rad2;
  }
  return frame;
}

// Gaps in the base's motion, and its lag relative to the tip.
void examine_times(const PlacedReadings& readings, const ColumnMap& map, const std::string& base_path,
                   ImportedRecording& out) {
  const auto base = samples_of(readings.base);
  if (const auto gap = find_motion_gap(base))
    out.motion_gap = base_path + ":" + std::to_string(readings.base[gap->after].line) + ": " + gap->what() +
                     ". bevel-diagnose refuses the log";
  out.lag = estimate_base_lag(base, samples_of(readings.tips));
  if (!out.lag) return;
  const double offset_s = (map.base_time ? map.base_time->offset_s : map.base_offset_s) - out.lag->lag_s;
  out.lag_setting = std::string(map.base_time ? "[base.time]" : "[base]") +
                    " offset_s = " + format_number(std::round(offset_s * 100) / 100);
}

template <class Sample>
void require_readable(const Placed<Sample>& placed, const std::string& path) {
  if (const auto error = check_fields(to_message(placed.sample)))
    throw ParseError(path + ":" + std::to_string(placed.line) +
                     ": readers would refuse the message made of this row (" + describe(*error) + ")");
}

// Moved to a time after 0, numbered, with rates; into `out`.
void finish(PlacedReadings& readings, const ColumnMap& map, const std::string& tip_path, const std::string& base_path,
            ImportedRecording& out) {
  const std::int64_t begin = readings.base.front().sample.utime;  // no tip is earlier
  const std::int64_t shift_us = begin > 0 ? 0 : kOwnEpoch_us - begin;
  out.time_shift_s = static_cast<double>(shift_us) * 1e-6;
  // Counted here: a row that was left out is no message that was lost.
  const auto take = [&](auto& from, auto& to, const std::string& path, auto&& complete) {
    for (auto& p : from) {
      p.sample.utime += shift_us;
      p.sample.seq = std::ssize(to);
      complete(p.sample);
      require_readable(p, path);
      to.push_back(p.sample);
    }
  };
  take(readings.base, out.actuators, base_path, [&](model::ActuatorState& a) {
    if (out.actuators.empty() || map.stops) return;
    const double dt_s = static_cast<double>(a.utime - out.actuators.back().utime) * 1e-6;
    a.insertion_rate_mm_s = (a.insertion_mm - out.actuators.back().insertion_mm) / dt_s;
    a.rotation_rate_rad_s = (a.rotation_rad - out.actuators.back().rotation_rad) / dt_s;
  });
  take(readings.tips, out.tips, tip_path, [](auto&) {});
  take(readings.headings, out.headings, tip_path, [](auto&) {});
}

void write_messages(const ImportedRecording& recording, LogWriter& log) {
  if (!recording.has_clock && !recording.actuators.empty())
    log.write_text(recording.actuators.front().utime, channel::kConfig, kNoClockConfig);
  std::size_t tip = 0, heading = 0;
  // At one instant the base comes first: a reading of the tip is taken of where the base is.
  const auto write_tips_before = [&](std::int64_t utime) {
    for (;;) {
      const bool has_tip = tip < recording.tips.size() && recording.tips[tip].utime < utime;
      const bool has_heading = heading < recording.headings.size() && recording.headings[heading].utime < utime;
      if (!has_tip && !has_heading) return;
      if (has_tip && (!has_heading || recording.tips[tip].utime <= recording.headings[heading].utime)) {
        const auto& m = recording.tips[tip++];
        log.write_message(m.utime, channel::kTipMeasurement, to_message(m));
      } else {
        const auto& m = recording.headings[heading++];
        log.write_message(m.utime, channel::kTipHeading, to_message(m));
      }
    }
  };
  for (const model::ActuatorState& a : recording.actuators) {
    write_tips_before(a.utime);
    log.write_message(a.utime, channel::kActuatorState, to_message(a));
  }
  write_tips_before(std::numeric_limits<std::int64_t>::max());
}

}  // namespace

ImportedRecording import_csv(const std::string& csv_path, const ColumnMap& map, const std::string& base_path) {
  if (base_path.empty() == map.base_time.has_value())
    throw ParseError(csv_path + (base_path.empty() ? ": the column map has [base], and no file for it is given"
                                                   : ": a file for the base is given (" + base_path +
                                                         "), and the column map has no [base.time]"));
  const bool one_file = base_path.empty();
  const std::string& base_file = one_file ? csv_path : base_path;
  ImportedRecording out;
  CsvTable table(csv_path);
  CsvRows tip = read_rows(table, map, map.time, {.tip = true, .base = one_file});
  out.format = table.format();
  out.rows = tip.read;
  out.rows_without_data = tip.without_data;
  out.rows_unsettled = tip.unsettled;
  out.has_clock = map.has_clock();
  std::vector<CsvRow> base_rows;
  if (one_file) {
    base_rows = tip.rows;
    for (CsvRow& row : base_rows) row.utime += std::llround(map.base_offset_s * 1e6);
  } else {
    CsvTable base_table(base_path);
    CsvRows base = read_rows(base_table, map, *map.base_time, {.tip = false, .base = true});
    out.base_rows = base.read;
    base_rows = std::move(base.rows);
  }
  const bool has_rotation = !map.rotation.empty();
  if (out.has_clock) out.held = remove_held_values(tip.rows, base_rows, has_rotation);
  PlacedReadings readings = placed(tip.rows, base_motion(base_rows, has_rotation));
  out.rows_without_base = leave_out_without_base(readings, csv_path, base_file);
  leave_out_the_implausible(readings, csv_path, base_file, one_file && map.base_offset_s == 0, out.left_out);
  out.rows_implausible = static_cast<int>(out.left_out.size());
  out.rows_without_base += leave_out_without_base(readings, csv_path, base_file);
  require_one_insertion(readings, base_file);
  if (map.frame == TipFrame::from_straight_insertion) out.frame = move_to_entry_frame(readings, map, csv_path);
  out.far_tips = require_tip_follows_base(readings, csv_path);
  if (out.has_clock) examine_times(readings, map, base_file, out);
  finish(readings, map, csv_path, base_file, out);
  return out;
}

std::string ImportedRecording::remarks(const std::string& name) const {
  std::string text;
  for (std::size_t i = 0; i < std::min(left_out.size(), kRemarks); ++i) text += left_out[i] + "\n";
  if (left_out.size() > kRemarks)
    text += name + ": and " + std::to_string(left_out.size() - kRemarks) + " more such rows\n";
  if (!far_tips.empty()) text += far_tips + "\n";
  if (!motion_gap.empty()) text += motion_gap + "\n";
  if (rows_without_base > 0)
    text += name + ": " + std::to_string(rows_without_base) +
            " of the tip's readings are from before the base's first or after its last; left out\n";
  if (time_shift_s != 0)
    text += name + ": time starts at " + format_number(1e-6 * static_cast<double>(kOwnEpoch_us) - time_shift_s) +
            " s, and messages need a time after 0; shifted by " + format_number(time_shift_s) + " s\n";
  return text;
}

void write_log(const ImportedRecording& recording, const std::string& log_path) {
  write_whole_log(log_path, [&](LogWriter& log) { write_messages(recording, log); });
}

}  // namespace bevel::io
