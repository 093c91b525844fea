// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// One channel of a recording as a table of NumPy views.
#include <nanobind/nanobind.h>

#include <cstdint>
#include <memory>
#include <vector>

#include <bevel/io/recording.hpp>

namespace bevel::python {

/// Rows of one channel. The recording lives as long as the table and the views of it.
template <class Row>
struct Table {
  std::shared_ptr<const io::Recording> data;
  const std::vector<Row>* rows;
  std::int64_t start_utime;  ///< zero of time_s
};

/// Registers Positions, Headings, Axes, Commands and States.
void bind_tables(nanobind::module_& m);

}  // namespace bevel::python
