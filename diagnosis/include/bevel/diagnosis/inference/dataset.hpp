// SPDX-License-Identifier: MIT
#pragma once
// What was read, and nothing of what made it: series of readings per recording and channel. Immutable once made.
#include <Eigen/Core>
#include <string>
#include <vector>

namespace bevel::inference {

// One channel in one recording, in order of time.
struct Series {
  std::vector<std::size_t> message;  // which of the recording's messages: an outlier takes all channels of a message
  std::vector<double> time_s;        // from the recording's start
  std::vector<double> measured;      // in the channel's unit
  std::vector<double> relative_sd;   // claimed standard deviation over the channel's median
  // Standard deviation by what the model's inputs are not known to, of each reading by itself, in standard deviations
  // of the channel's noise. Empty: none.
  std::vector<double> input_sd;
  // Of each reading's innovation where the noise has heavy tails (heavy_tails.hpp), relative to normal noise. Empty: 1.
  std::vector<double> precision;
};

struct SeriesSet {
  std::vector<Series> series;  // one per channel; may be empty
  std::size_t messages = 0;
  double duration_s = 0;
  // All channels, one after the other: the order of rows in everything that is computed.
  Eigen::Index rows() const {
    std::size_t count = 0;
    for (const auto& one : series) count += one.time_s.size();
    return static_cast<Eigen::Index>(count);
  }
};

struct Dataset {
  std::vector<double> claimed_sd;  // per channel
  std::vector<SeriesSet> recordings;
  double frame_s = 0;  // median time between readings of a channel
  Eigen::Index rows() const {
    Eigen::Index count = 0;
    for (const auto& one : recordings) count += one.rows();
    return count;
  }
};

// Values of all readings, per recording and channel.
using ByReading = std::vector<std::vector<std::vector<double>>>;

// Readings by their message, per recording.
using Readings = std::vector<std::vector<std::size_t>>;

// Values of all of a recording's rows, a vector per channel.
std::vector<Eigen::VectorXd> by_channel(const SeriesSet& set, const Eigen::VectorXd& rows);

// The dataset without those readings (ascending), and which of the old rows are left, per recording.
Dataset without(const Dataset& data, const Readings& readings);
std::vector<std::vector<Eigen::Index>> rows_left(const Dataset& data, const Readings& readings);

}  // namespace bevel::inference
