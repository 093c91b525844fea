// SPDX-License-Identifier: MIT
#include "recording.hpp"

#include <nanobind/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <tuple>
#include <utility>

#include <bevel/io/csv_export.hpp>
#include <bevel/io/csv_import.hpp>
#include <bevel/io/recording_clock.hpp>
#include "arrays.hpp"
#include "io_error.hpp"
#include "module.hpp"
#include "motion.hpp"
#include "recording_tables.hpp"

namespace bevel::python {
namespace {

namespace fs = std::filesystem;

template <class Row>
Table<Row> table_of(const Recording& recording, std::vector<Row> io::Recording::*rows) {
  return {recording.data, &((*recording.data).*rows), recording.start_utime};
}

Recording read_log(const fs::path& path) {
  const nb::gil_scoped_release release;
  return with_io_errors([&] {
    io::Recording recording = io::read_recording(path.string());
    io::require_usable(path.string(), recording);
    std::string remarks = recording.remarks(path.string()) + recording.order_note(path.string());
    return Recording(path.filename().string(), std::move(recording), std::move(remarks));
  });
}

Recording import_csv(const fs::path& csv, const fs::path& columns, const std::optional<fs::path>& base) {
  const nb::gil_scoped_release release;
  return with_io_errors([&] {
    const io::ColumnMap map = io::load_column_map(columns.string());
    io::ImportedRecording imported = io::import_csv(csv.string(), map, base ? base->string() : "");
    std::string remarks = imported.remarks(csv.string()) + io::summary(imported);
    io::Recording recording;
    if (!imported.has_clock) recording.config = io::kNoClockConfig;
    recording.tips = std::move(imported.tips);
    recording.headings = std::move(imported.headings);
    recording.actuators = std::move(imported.actuators);
    order_by_time(recording);
    recording.events = std::ssize(recording.arrivals);
    return Recording(csv.stem().string() + ".lcm", std::move(recording), std::move(remarks));
  });
}

AxisMotion motion_of(const Recording& recording) {
  std::vector<model::ActuatorState> states = recording.data->actuators;
  std::ranges::stable_sort(states, {}, &model::ActuatorState::utime);
  const auto n = static_cast<Eigen::Index>(states.size());
  AxisMotion motion{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const model::ActuatorState& state = states[static_cast<std::size_t>(i)];
    motion.time_s[i] = recording.time_s(state.utime);
    motion.insertion_mm[i] = state.insertion_mm;
    motion.rotation_rad[i] = state.rotation_rad;
  }
  motion.validate();
  return motion;
}

std::string repr_of(const Recording& recording) {
  const io::Recording& data = *recording.data;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), ": %zu positions, %zu headings, %zu axis samples>", data.tips.size(),
                data.headings.size(), data.actuators.size());
  return "<Recording '" + recording.name + "'" + text.data();
}

}  // namespace

Recording::Recording(std::string name_, io::Recording recording, std::string remarks_)
    : name(std::move(name_)), remarks(std::move(remarks_)) {
  std::int64_t first = 0;
  const auto take = [&first](const auto& rows) {
    for (const auto& row : rows)
      if (first == 0 || row.utime < first) first = row.utime;
  };
  take(recording.actuators);
  if (first == 0) take(recording.tips);
  start_utime = first;
  data = std::make_shared<const io::Recording>(std::move(recording));
}

void order_by_time(io::Recording& recording) {
  using Channel = io::Arrival::Channel;
  struct Placed {
    std::int64_t utime;
    int rank;  // axis samples first: a measurement is taken where the axes are
    io::Arrival arrival;
  };
  std::vector<Placed> all;
  const auto add = [&all](const auto& rows, int rank, Channel channel) {
    for (std::size_t i = 0; i < rows.size(); ++i) all.push_back({rows[i].utime, rank, {channel, i}});
  };
  add(recording.actuators, 0, Channel::actuator);
  add(recording.tips, 1, Channel::tip);
  add(recording.headings, 2, Channel::heading);
  std::ranges::stable_sort(all, {}, [](const Placed& one) { return std::tuple(one.utime, one.rank); });
  recording.arrivals.clear();
  std::ranges::transform(all, std::back_inserter(recording.arrivals), &Placed::arrival);
}

void bind_recording(nb::module_& m) {
  bind_tables(m);
  nb::class_<Recording>(m, "Recording", "One recorded insertion. Its arrays are read-only views of the recording.")
      .def_ro("name", &Recording::name, "File name of the log.")
      .def_prop_ro(
          "positions", [](const Recording& r) { return table_of(r, &io::Recording::tips); }, "Measured positions.")
      .def_prop_ro(
          "headings", [](const Recording& r) { return table_of(r, &io::Recording::headings); }, "Measured headings.")
      .def_prop_ro(
          "axes", [](const Recording& r) { return table_of(r, &io::Recording::actuators); }, "Samples of the axes.")
      .def_prop_ro(
          "commands", [](const Recording& r) { return table_of(r, &io::Recording::commands); }, "Commands to the axes.")
      .def_prop_ro(
          "estimates", [](const Recording& r) { return table_of(r, &io::Recording::estimates); },
          "Estimates that the estimator published during the insertion.")
      .def_prop_ro(
          "truths", [](const Recording& r) { return table_of(r, &io::Recording::truths); },
          "True states, of a simulated rig.")
      .def_prop_ro("motion", &motion_of, "Motion of the axes, in order of time.")
      .def_prop_ro(
          "config", [](const Recording& r) { return r.data->config; }, "Text of the configuration in the log, or ''.")
      .def_prop_ro(
          "has_clock", [](const Recording& r) { return io::has_clock(*r.data); },
          "False for stepwise insertions without time stamps: times are an order only.")
      .def_prop_ro(
          "intact", [](const Recording& r) { return r.data->intact(); },
          "Whether no byte and no message of the log was lost or rejected.")
      .def_ro("remarks", &Recording::remarks, "Damaged or implausible parts, one line each; '' for none.")
      .def(
          "named",
          [](const Recording& r, const std::string& name) {
            Recording other = r;
            other.name = name;
            return other;
          },
          "name"_a, "Returns the same recording under another name, without a copy of its data.")
      .def(
          "save",
          [](const Recording& r, const fs::path& path) {
            const nb::gil_scoped_release release;
            with_io_errors([&] { io::write_log(*r.data, path.string()); });
          },
          "path"_a, "Writes the recording as an LCM log.")
      .def("__repr__", &repr_of);
  m.def("read_log", &read_log, "path"_a,
        "Reads an LCM log.\n\n"
        "Damaged parts are skipped; Recording.intact and Recording.remarks report them.\n\n"
        "Raises:\n"
        "    IoError: the file cannot be read, or nothing in it can be used.");
  m.def("import_csv", &import_csv, "path"_a, "columns"_a, "base"_a = nb::none(),
        "Imports a recording from CSV by a column map.\n\n"
        "Recording.remarks lists the figures that show a wrong unit, sign or column: duration, rates, extents.\n\n"
        "Args:\n"
        "    path: CSV file with the columns of the tip.\n"
        "    columns: the column map, a TOML file (docs/import.md).\n"
        "    base: CSV file with the columns of the axes, where the map has a section [base].\n\n"
        "Raises:\n"
        "    ConfigurationError: the map is invalid.\n"
        "    IoError: a file cannot be read or used; the message has line and column.");
}

}  // namespace bevel::python
