// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Resource limits of a process, checked before anything is started. liblcm and GLib crash or abort when a descriptor,
/// a thread or memory is refused to them; a program that checks first prints which limit to raise.

namespace bevel::cli {

/// Checks that this process can open 48 more files, start a thread and map 64 MiB. Raises the soft limit of open files
/// up to its hard limit where that is needed.
/// @throws IoError naming the limit, its value and the remedy
void require_limits();

/// Checks that this process can run \p count more threads at once.
/// @throws IoError as above
void require_threads(int count);

}  // namespace bevel::cli
