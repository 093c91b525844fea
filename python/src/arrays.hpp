// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Conversions between NumPy arrays and the plain structures of the libraries.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <vector>

namespace bevel::python {

namespace nb = nanobind;
using namespace nb::literals;  // NOLINT(google-build-using-namespace): "name"_a

using Column = nb::DRef<const Eigen::VectorXd>;
using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Vector3 = std::array<double, 3>;

inline Eigen::Vector3d to_eigen(const Vector3& v) { return {v[0], v[1], v[2]}; }

/// Stacks points as rows.
/// @return n x 3
inline Rows3 stack(const std::vector<Eigen::Vector3d>& points) {
  Rows3 rows(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) rows.row(static_cast<Eigen::Index>(i)) = points[i];
  return rows;
}

/// Makes a read-only NumPy view of one member of all elements of a vector, without a copy.
/// @param owner Python object that keeps \p rows alive
/// @param first the member of the first element, or its first number
/// @param extents shape of the member, row by row; empty for a number
template <class Row, class Scalar>
nb::object view_of(nb::handle owner, const std::vector<Row>& rows, const Scalar* first,
                   std::initializer_list<std::size_t> extents = {}) {
  static_assert(sizeof(Row) % sizeof(Scalar) == 0, "NumPy strides are whole numbers of scalars here");
  static const Scalar kEmpty{};
  std::vector<std::size_t> shape{rows.size()};
  shape.insert(shape.end(), extents);
  std::vector<std::int64_t> strides(shape.size(), 1);
  for (std::size_t i = shape.size() - 1; i > 1; --i) strides[i - 1] = strides[i] * static_cast<std::int64_t>(shape[i]);
  strides[0] = static_cast<std::int64_t>(sizeof(Row) / sizeof(Scalar));
  return nb::cast(nb::ndarray<nb::numpy, const Scalar>(rows.empty() ? &kEmpty : first, shape.size(), shape.data(),
                                                       owner, strides.data()),
                  nb::rv_policy::reference);
}

}  // namespace bevel::python
