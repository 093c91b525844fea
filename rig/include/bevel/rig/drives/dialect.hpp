// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <bevel/rig/drives/object_dictionary.hpp>

namespace bevel::rig {

/// How a maker's drive differs from the simulated drive's own way. The values are those of public manuals and issue
/// trackers; each difference is a case that a master must handle or refuse.
struct DriveDialect {
  double boot_s = 0.0;  ///< from a reset to the boot-up message; a reset meanwhile begins the boot anew
  /// Unit of velocities and accelerations, coded as 0x60A9, of a drive without 0x6096; 0: position units per second,
  /// scaled by 0x6096.
  std::uint32_t velocity_unit = 0;
  bool states_unit = true;                         ///< false: the unit is fixed, and no object states it
  bool needs_bit_30 = false;                       ///< of the COB-ID of a TPDO
  bool rejects_bit_30 = false;                     ///< of any COB-ID
  bool shows_mode_only_enabled = false;            ///< 0x6061 is 0 before
  std::vector<ObjectDictionary::Key> lacks;        ///< objects that it does not have
  std::map<ObjectDictionary::Key, Abort> rejects;  ///< objects whose writing it aborts, and how
};

}  // namespace bevel::rig
