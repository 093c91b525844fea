// SPDX-License-Identifier: MIT
#include "recording_tables.hpp"

#include <string>
#include <utility>

#include <bevel/model/samples.hpp>
#include "arrays.hpp"

namespace bevel::python {
namespace {

template <class Row>
Eigen::VectorXd times_of(const Table<Row>& table) {
  Eigen::VectorXd times(static_cast<Eigen::Index>(table.rows->size()));
  for (std::size_t i = 0; i < table.rows->size(); ++i)
    times[static_cast<Eigen::Index>(i)] = static_cast<double>((*table.rows)[i].utime - table.start_utime) * 1e-6;
  return times;
}

// Registers what all tables have.
template <class Row>
nb::class_<Table<Row>> bind_table(nb::module_& m, const char* name, const char* doc, std::vector<std::string> columns) {
  nb::class_<Table<Row>> table(m, name, doc);
  table.def("__len__", [](const Table<Row>& t) { return t.rows->size(); })
      .def_prop_ro("time_s", &times_of<Row>, "Time since the first axis sample of the recording, s, shape (n,).")
      .def_prop_ro(
          "utime",
          [](nb::handle self) {
            const auto& rows = *nb::cast<const Table<Row>&>(self).rows;
            return view_of(self, rows, rows.empty() ? nullptr : &rows.front().utime);
          },
          nb::sig("def utime(self) -> numpy.typing.NDArray[numpy.int64]"), "Time, us since the epoch, shape (n,).")
      .def(
          "to_pandas",
          [columns = std::move(columns)](nb::handle self) {
            nb::dict frame;
            for (const std::string& column : columns) {
              nb::object values = self.attr(column.c_str());
              if (nb::cast<int>(values.attr("ndim")) == 1) {
                frame[column.c_str()] = values;
                continue;
              }
              const auto width = nb::cast<std::size_t>(values.attr("shape").attr("__getitem__")(1));
              static constexpr std::array<const char*, 4> kVector{"x", "y", "z", ""}, kQuaternion{"w", "x", "y", "z"};
              const auto& suffix = width == kQuaternion.size() ? kQuaternion : kVector;
              for (std::size_t i = 0; i < width; ++i) {
                const nb::object all = nb::module_::import_("builtins").attr("slice")(nb::none());
                frame[(column + "_" + suffix[i]).c_str()] = values[nb::make_tuple(all, i)];
              }
            }
            return nb::module_::import_("pandas").attr("DataFrame")(frame);
          },
          nb::sig("def to_pandas(self) -> typing.Any"),
          "Returns a pandas.DataFrame; vectors take a column for each component, matrices are left out.\n\n"
          "Raises:\n"
          "    ImportError: pandas is not installed.");
  return table;
}

// A property with a read-only view of one member.
template <class Row, class Get>
void column(nb::class_<Table<Row>>& table, const char* name, const char* type, Get first,
            std::initializer_list<std::size_t> extents, const char* doc) {
  const std::string signature = std::string("def ") + name + "(self) -> numpy.typing.NDArray[numpy." + type + "]";
  const std::vector<std::size_t> shape(extents);
  table.def_prop_ro(
      name,
      [first, shape](nb::handle self) {
        const auto& rows = *nb::cast<const Table<Row>&>(self).rows;
        using Scalar = std::remove_const_t<std::remove_pointer_t<decltype(first(rows.front()))>>;
        const Scalar* data = rows.empty() ? nullptr : first(rows.front());
        switch (shape.size()) {
          case 0:
            return view_of(self, rows, data);
          case 1:
            return view_of(self, rows, data, {shape[0]});
          default:
            return view_of(self, rows, data, {shape[0], shape[1]});
        }
      },
      nb::sig(signature.c_str()), doc);
}

void bind_positions(nb::module_& m) {
  using Row = model::TipMeasurement;
  auto table = bind_table<Row>(m, "Positions", "Measured positions of the tip. The arrays are read-only views.",
                               {"time_s", "utime", "camera", "status", "position_mm"});
  column(
      table, "camera", "int32", [](const Row& r) { return &r.camera; }, {}, "Number of the camera, shape (n,).");
  column(
      table, "status", "int32", [](const Row& r) { return &r.status; }, {}, "0: usable, shape (n,).");
  column(
      table, "position_mm", "float64", [](const Row& r) { return r.position_mm.data(); }, {3},
      "Tip in {A}, mm, shape (n, 3).");
  column(
      table, "information_per_mm2", "float64", [](const Row& r) { return r.information_per_mm2.data(); }, {3, 3},
      "Inverse covariance, 1/mm^2, shape (n, 3, 3); singular along an axis that was not measured.");
}

void bind_headings(nb::module_& m) {
  using Row = model::TipHeading;
  auto table = bind_table<Row>(m, "Headings", "Measured headings of the tip. The arrays are read-only views.",
                               {"time_s", "utime", "camera", "status", "heading"});
  column(
      table, "camera", "int32", [](const Row& r) { return &r.camera; }, {}, "Number of the camera, shape (n,).");
  column(
      table, "status", "int32", [](const Row& r) { return &r.status; }, {}, "0: usable, shape (n,).");
  column(
      table, "heading", "float64", [](const Row& r) { return r.heading.data(); }, {3},
      "Unit vectors in {A}, shape (n, 3).");
  column(
      table, "information_per_rad2", "float64", [](const Row& r) { return r.information_per_rad2.data(); }, {3, 3},
      "Inverse covariance, 1/rad^2, shape (n, 3, 3); zero along the heading.");
}

void bind_axes(nb::module_& m) {
  using Row = model::ActuatorState;
  auto table = bind_table<Row>(
      m, "Axes", "Samples of the two axes. The arrays are read-only views.",
      {"time_s", "utime", "insertion_mm", "insertion_rate_mm_s", "rotation_rad", "rotation_rate_rad_s"});
  column(
      table, "insertion_mm", "float64", [](const Row& r) { return &r.insertion_mm; }, {}, "Insertion, mm, shape (n,).");
  column(
      table, "insertion_rate_mm_s", "float64", [](const Row& r) { return &r.insertion_rate_mm_s; }, {},
      "Insertion rate, mm/s, shape (n,).");
  column(
      table, "rotation_rad", "float64", [](const Row& r) { return &r.rotation_rad; }, {}, "Rotation, rad, shape (n,).");
  column(
      table, "rotation_rate_rad_s", "float64", [](const Row& r) { return &r.rotation_rate_rad_s; }, {},
      "Rotation rate, rad/s, shape (n,).");
  column(
      table, "axis_status", "int32", [](const Row& r) { return r.axis_status.data(); }, {2},
      "Status of insertion and rotation, shape (n, 2): 0 off, 1 ready, 2 enabled, 3 quick stop, 4 fault.");
}

void bind_commands(nb::module_& m) {
  using Row = model::MotionCommand;
  auto table = bind_table<Row>(m, "Commands", "Commands to the axes. The arrays are read-only views.",
                               {"time_s", "utime", "mode", "insertion_rate_mm_s", "rotation_rate_rad_s"});
  column(
      table, "mode", "int32", [](const Row& r) { return &r.mode; }, {}, "0 stop, 1 run, shape (n,).");
  column(
      table, "insertion_rate_mm_s", "float64", [](const Row& r) { return &r.insertion_rate_mm_s; }, {},
      "Insertion rate, mm/s, shape (n,).");
  column(
      table, "rotation_rate_rad_s", "float64", [](const Row& r) { return &r.rotation_rate_rad_s; }, {},
      "Rotation rate, rad/s, shape (n,).");
}

void bind_states(nb::module_& m) {
  using Row = ::bevel::needle_state_t;
  auto table = bind_table<Row>(m, "States",
                               "Recorded states of the needle: estimates, or truths of a simulated rig. The arrays are "
                               "read-only views.",
                               {"time_s", "utime", "position_mm", "orientation_wxyz", "curvature_per_mm",
                                "lambda1_per_rad", "lambda2", "test_ratio", "health", "reset_count"});
  column(
      table, "position_mm", "float64", [](const Row& r) { return &r.position_mm[0]; }, {3},
      "Tip in {A}, mm, shape (n, 3).");
  column(
      table, "orientation_wxyz", "float64", [](const Row& r) { return &r.orientation_wxyz[0]; }, {4},
      "Unit quaternion of {B} in {A}, w first, shape (n, 4).");
  column(
      table, "curvature_per_mm", "float64", [](const Row& r) { return &r.curvature_per_mm; }, {},
      "k, 1/mm, shape (n,).");
  column(
      table, "lambda1_per_rad", "float64", [](const Row& r) { return &r.lambda1_per_rad; }, {},
      "lambda1, 1/rad, shape (n,).");
  column(
      table, "lambda2", "float64", [](const Row& r) { return &r.lambda2; }, {}, "lambda2, shape (n,).");
  column(
      table, "covariance", "float64", [](const Row& r) { return &r.covariance[0]; }, {9, 9},
      "Covariance, shape (n, 9, 9): position and rotation in {B} (mm, rad), k, lambda1, lambda2.");
  column(
      table, "test_ratio", "float64", [](const Row& r) { return &r.test_ratio; }, {},
      "Squared Mahalanobis distance of the newest position over its gate, shape (n,).");
  column(
      table, "health", "int32", [](const Row& r) { return &r.health; }, {}, "Health bits, 0 healthy, shape (n,).");
  column(
      table, "reset_count", "int32", [](const Row& r) { return &r.reset_count; }, {}, "Resets so far, shape (n,).");
}

}  // namespace

void bind_tables(nb::module_& m) {
  bind_positions(m);
  bind_headings(m);
  bind_axes(m);
  bind_commands(m);
  bind_states(m);
}

}  // namespace bevel::python
