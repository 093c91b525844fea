// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/dataset.hpp>

#include <algorithm>

namespace bevel::inference {
namespace {
bool is_left(const std::vector<std::size_t>& gone, std::size_t message) {
  return !std::binary_search(gone.begin(), gone.end(), message);
}
}  // namespace

Dataset without(const Dataset& data, const Readings& readings) {
  Dataset out = data;
  for (std::size_t r = 0; r < out.recordings.size(); ++r)
    for (Series& series : out.recordings[r].series) {
      Series kept;
      for (std::size_t i = 0; i < series.message.size(); ++i) {
        if (!is_left(readings[r], series.message[i])) continue;
        kept.message.push_back(series.message[i]);
        kept.time_s.push_back(series.time_s[i]);
        kept.measured.push_back(series.measured[i]);
        kept.relative_sd.push_back(series.relative_sd[i]);
        if (!series.input_sd.empty()) kept.input_sd.push_back(series.input_sd[i]);
        if (!series.precision.empty()) kept.precision.push_back(series.precision[i]);
      }
      series = std::move(kept);
    }
  return out;
}

std::vector<Eigen::VectorXd> by_channel(const SeriesSet& set, const Eigen::VectorXd& rows) {
  std::vector<Eigen::VectorXd> out;
  Eigen::Index row = 0;
  for (const Series& series : set.series) {
    const auto count = static_cast<Eigen::Index>(series.time_s.size());
    out.emplace_back(rows.segment(row, count));
    row += count;
  }
  return out;
}

std::vector<std::vector<Eigen::Index>> rows_left(const Dataset& data, const Readings& readings) {
  std::vector<std::vector<Eigen::Index>> out(data.recordings.size());
  for (std::size_t r = 0; r < out.size(); ++r) {
    Eigen::Index row = 0;
    for (const Series& series : data.recordings[r].series)
      for (const std::size_t message : series.message) {
        if (is_left(readings[r], message)) out[r].push_back(row);
        ++row;
      }
  }
  return out;
}

}  // namespace bevel::inference
