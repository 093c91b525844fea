// SPDX-License-Identifier: MIT
#include <bevel/model/beam/hermite_beam.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <bevel/error.hpp>

namespace bevel::model {
namespace {

std::size_t count_for(double span_mm, double length_mm) {
  if (!(length_mm > 0.0)) {
    throw ArgumentError("beam: element_length_mm = " + std::to_string(length_mm) + ", allowed: > 0");
  }
  return static_cast<std::size_t>(std::ceil(span_mm / length_mm - 1e-9));
}

// Cubic Hermite functions of the unknowns (w, w') left and (w, w') right.
std::array<double, 4> shape(double xi, double length_mm) {
  const double eta = 1.0 - xi;
  return {eta * eta * (1.0 + 2.0 * xi), length_mm * xi * eta * eta, xi * xi * (1.0 + 2.0 * eta),
          -length_mm * xi * xi * eta};
}

std::array<double, 4> shape_slope(double xi, double length_mm) {
  const double eta = 1.0 - xi;
  return {-6.0 * xi * eta / length_mm, eta * (1.0 - 3.0 * xi), 6.0 * xi * eta / length_mm, xi * (3.0 * xi - 2.0)};
}

Lateral combine(const std::array<double, 4>& weights, const std::array<Lateral, 4>& values) {
  return weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2] + weights[3] * values[3];
}

}  // namespace

Eigen::Vector3d turned_from_axis(Lateral angle_rad) {
  const double angle = std::abs(angle_rad);
  const double share = angle > 1e-6 ? std::sin(angle) / angle : 1.0;
  return {share * angle_rad.real(), share * angle_rad.imag(), std::cos(angle)};
}

HermiteBeam::HermiteBeam(double bending_stiffness_N_mm2, double element_length_mm, double free_span_mm,
                         double max_tip_mm)
    : bending_stiffness_N_mm2_(bending_stiffness_N_mm2),
      element_length_mm_(element_length_mm),
      free_element_mm_(element_length_mm),
      free_elements_(count_for(free_span_mm, element_length_mm)),
      matrix_(2 * (free_elements_ + count_for(max_tip_mm, element_length_mm) + 1)),
      loads_(2 * (free_elements_ + count_for(max_tip_mm, element_length_mm) + 1)),
      solution_(loads_.size()) {
  if (free_elements_ > 0) free_element_mm_ = free_span_mm / static_cast<double>(free_elements_);
  const std::size_t tissue_elements = count_for(max_tip_mm, element_length_mm);
  nodes_mm_.reserve(free_elements_ + tissue_elements + 1);
  for (std::size_t i = 0; i < free_elements_; ++i) {
    nodes_mm_.push_back(-free_span_mm + free_element_mm_ * static_cast<double>(i));
  }
  for (std::size_t i = 0; i <= tissue_elements; ++i) {
    nodes_mm_.push_back(element_length_mm * static_cast<double>(i));
  }
}

void HermiteBeam::set_tip(double tip_mm, double settled_mm) {
  if (!(tip_mm > nodes_mm_.front() && tip_mm <= nodes_mm_.back())) {
    throw DomainError("beam: tip at " + std::to_string(tip_mm) + " mm, allowed above " +
                      std::to_string(nodes_mm_.front()) + " and up to " + std::to_string(nodes_mm_.back()));
  }
  tip_mm_ = tip_mm;
  // A sliver at the end would only spoil the conditioning, so the last whole element swallows it.
  const double last_left_mm = tip_mm - 0.5 * element_length_mm_;
  const auto past = std::upper_bound(nodes_mm_.begin(), nodes_mm_.end(), last_left_mm);
  const std::size_t before = elements_;
  elements_ = std::max<std::size_t>(1, static_cast<std::size_t>(past - nodes_mm_.begin()));
  // Settled elements end at nodes of the mesh in both problems. The node after them has a neighbour that is not.
  const std::size_t inner = std::min(before, elements_);
  settled_ = 0;
  while (settled_ + 1 < inner && nodes_mm_[settled_ + 1] <= settled_mm) ++settled_;
  first_row_ = settled_ > 0 ? 2 * settled_ - 2 : 0;
  matrix_.reset(2 * elements_, first_row_);
  std::fill(loads_.begin() + static_cast<std::ptrdiff_t>(first_row_),
            loads_.begin() + static_cast<std::ptrdiff_t>(2 * elements_), Lateral{});
  for (std::size_t e = settled_ > 0 ? settled_ - 1 : 0; e < elements_; ++e) add_bending(e);
}

void HermiteBeam::add_bending(std::size_t element) {
  const double h = right_mm(element) - nodes_mm_[element];
  const double s = bending_stiffness_N_mm2_ / (h * h * h);
  const std::array<std::array<double, 4>, 4> k{{{12.0 * s, 6.0 * h * s, -12.0 * s, 6.0 * h * s},
                                                {6.0 * h * s, 4.0 * h * h * s, -6.0 * h * s, 2.0 * h * h * s},
                                                {-12.0 * s, -6.0 * h * s, 12.0 * s, -6.0 * h * s},
                                                {6.0 * h * s, 2.0 * h * h * s, -6.0 * h * s, 4.0 * h * h * s}}};
  for (std::size_t a = element == 0 ? 2 : 0; a < 4; ++a) {
    const std::size_t row = 2 * element + a - 2;
    if (row < first_row_) continue;
    for (std::size_t b = element == 0 ? 2 : 0; b <= a; ++b) matrix_.add(row, 2 * element + b - 2, k[a][b]);
  }
}

void HermiteBeam::add_spring(double z_mm, double stiffness_N_mm, Lateral load_N) {
  const Place at = locate(z_mm);
  const auto n = shape(at.xi, at.length_mm);
  for (std::size_t a = at.element == 0 ? 2 : 0; a < 4; ++a) {
    const std::size_t row = 2 * at.element + a - 2;
    if (row < first_row_) continue;
    loads_[row] += n[a] * load_N;
    for (std::size_t b = at.element == 0 ? 2 : 0; b <= a; ++b) {
      matrix_.add(row, 2 * at.element + b - 2, stiffness_N_mm * n[a] * n[b]);
    }
  }
}

void HermiteBeam::solve() {
  matrix_.factor();
  matrix_.forward(loads_);
  std::copy_n(loads_.begin(), 2 * elements_, solution_.begin());
  matrix_.backward(solution_);
}

Lateral HermiteBeam::displacement_mm(double z_mm) const {
  const Place at = locate(z_mm);
  return combine(shape(at.xi, at.length_mm), unknowns(at.element));
}

Lateral HermiteBeam::slope(double z_mm) const {
  const Place at = locate(z_mm);
  return combine(shape_slope(at.xi, at.length_mm), unknowns(at.element));
}

Eigen::Vector3d HermiteBeam::tip_along_shaft_mm() const {
  Eigen::Vector3d sum_mm(0, 0, nodes_mm_.front());
  for (std::size_t e = 0; e < elements_; ++e) {  // Simpson's rule
    const double h = right_mm(e) - nodes_mm_[e];
    const auto u = unknowns(e);
    sum_mm +=
        h / 6.0 *
        (turned_from_axis(u[1]) + 4.0 * turned_from_axis(combine(shape_slope(0.5, h), u)) + turned_from_axis(u[3]));
  }
  return sum_mm;
}

HermiteBeam::Place HermiteBeam::locate(double z_mm) const {
  const double whole = z_mm < 0.0 ? (z_mm - nodes_mm_.front()) / free_element_mm_
                                  : static_cast<double>(free_elements_) + z_mm / element_length_mm_;
  const std::size_t element = std::min(static_cast<std::size_t>(std::max(whole, 0.0)), elements_ - 1);
  const double length_mm = right_mm(element) - nodes_mm_[element];
  return {element, length_mm, (z_mm - nodes_mm_[element]) / length_mm};
}

double HermiteBeam::right_mm(std::size_t element) const {
  return element + 1 == elements_ ? tip_mm_ : nodes_mm_[element + 1];
}

std::array<Lateral, 4> HermiteBeam::unknowns(std::size_t element) const {
  const std::size_t right = 2 * element;
  if (element == 0) return {Lateral{}, Lateral{}, solution_[0], solution_[1]};
  return {solution_[right - 2], solution_[right - 1], solution_[right], solution_[right + 1]};
}

}  // namespace bevel::model
