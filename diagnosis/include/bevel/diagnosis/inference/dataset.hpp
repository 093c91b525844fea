// SPDX-License-Identifier: MIT
/// @file
/// Measured time series per recording and channel, independent of the model that is fitted to them.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace bevel::inference {

/// Measurements of one channel in one recording, in order of time. All non-empty vectors have the same length.
struct Series {
  std::vector<std::size_t> message;  ///< Index of each measurement's message; an outlier removes the whole message.
  std::vector<double> time_s;        ///< Time since the start of the recording, in s.
  std::vector<double> measured;      ///< Measured values, in the channel's unit.
  std::vector<double> relative_sd;   ///< Claimed standard deviation divided by the channel's median, dimensionless.
  /// Standard deviation caused by uncertain model inputs, independent between measurements, in standard deviations of
  /// the channel's noise. Empty: zero.
  std::vector<double> input_sd;
  /// Precision of each innovation relative to normal noise, for noise with heavy tails (heavy_tails.hpp). Empty: 1.
  std::vector<double> precision;
};

/// All measurements of one recording.
struct SeriesSet {
  std::vector<Series> series;  ///< One per channel; a series may be empty.
  std::size_t messages = 0;    ///< Number of messages in the recording.
  double duration_s = 0;       ///< Duration of the recording, in s.
  /// Counts the measurements of all channels. All computations order the rows channel after channel, each in time.
  /// @return Number of rows.
  Eigen::Index rows() const {
    std::size_t count = 0;
    for (const auto& one : series) count += one.time_s.size();
    return static_cast<Eigen::Index>(count);
  }
};

/// Measurements of all recordings.
struct Dataset {
  std::vector<double> claimed_sd;     ///< Claimed standard deviation of each channel, in the channel's unit.
  std::vector<SeriesSet> recordings;  ///< One set of series per recording.
  double frame_s = 0;                 ///< Median time between two measurements of a channel, in s.
  /// Counts the measurements of all recordings.
  /// @return Number of rows.
  Eigen::Index rows() const {
    Eigen::Index count = 0;
    for (const auto& one : recordings) count += one.rows();
    return count;
  }
};

/// One value per measurement, indexed by recording, channel and position in the series.
using ByReading = std::vector<std::vector<std::vector<double>>>;

/// Message indices, one list per recording.
using Readings = std::vector<std::vector<std::size_t>>;

/// Splits a vector over all rows of a recording into one vector per channel.
/// @param set Recording that defines the number of rows of each channel.
/// @param rows Values of all rows, channel after channel; length set.rows().
/// @return One vector per channel, in the unit of \p rows.
std::vector<Eigen::VectorXd> by_channel(const SeriesSet& set, const Eigen::VectorXd& rows);

/// Removes the measurements of the given messages from a dataset.
/// @param data Dataset.
/// @param readings Messages to remove, ascending; one list per recording of \p data.
/// @return Copy of \p data without the measurements of these messages; message indices do not change.
Dataset without(const Dataset& data, const Readings& readings);
/// Lists the rows of a dataset that without() keeps.
/// @param data Dataset.
/// @param readings Messages to remove, ascending; one list per recording of \p data.
/// @return Ascending row indices into \p data, one list per recording.
std::vector<std::vector<Eigen::Index>> rows_left(const Dataset& data, const Readings& readings);

}  // namespace bevel::inference
