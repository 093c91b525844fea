// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Differences between the drives of several makers and the simulated drive.

#include <cstdint>
#include <map>
#include <vector>

#include <bevel/rig/drives/object_dictionary.hpp>

namespace bevel::rig {

/// Deviations of a maker's drive from the default behaviour of the simulated drive. The values are those of public
/// manuals and issue trackers. A master must handle or reject each deviation.
struct DriveDialect {
  /// Time from a reset to the boot-up message, s; a reset in between restarts the boot.
  double boot_s = 0.0;
  /// Unit of velocities and accelerations, coded as 0x60A9, of a drive without 0x6096; 0: position units per second,
  /// scaled by 0x6096.
  std::uint32_t velocity_unit = 0;
  /// false: the unit is fixed, and no object states it.
  bool states_unit = true;
  /// A write to the COB-ID of a TPDO is accepted only with bit 30.
  bool needs_bit_30 = false;
  /// A write to any COB-ID is rejected with bit 30.
  bool rejects_bit_30 = false;
  /// 0x6061 is 0 while the drive is not enabled.
  bool shows_mode_only_enabled = false;
  /// Objects that the drive does not have.
  std::vector<ObjectDictionary::Key> lacks;
  /// Objects that cannot be written, with the abort code.
  std::map<ObjectDictionary::Key, Abort> rejects;
};

}  // namespace bevel::rig
