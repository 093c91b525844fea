// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// A recording in memory, as bevel.Recording holds it.
#include <cstdint>
#include <memory>
#include <string>

#include <bevel/io/recording.hpp>

namespace bevel::python {

struct Recording {
  std::string name;     ///< file name of the log, or one that the user gave
  std::string remarks;  ///< what is damaged or implausible, one line each
  std::shared_ptr<const io::Recording> data;
  std::int64_t start_utime = 0;  ///< of the earliest axis sample; else of the earliest sample of any kind

  Recording(std::string name_, io::Recording recording, std::string remarks_ = {});
  /// Computes the time since the first axis sample, s.
  double time_s(std::int64_t utime) const { return static_cast<double>(utime - start_utime) * 1e-6; }
};

/// Builds io::Recording::arrivals in order of time: axis samples before measurements of the same time.
void order_by_time(io::Recording& recording);

}  // namespace bevel::python
