// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Shared libraries of a program, read from its ELF headers. Nothing of the program is run: ldd would load its audit
/// libraries (DT_AUDIT) and run their code outside the sandbox.
#include <filesystem>
#include <vector>

namespace bevel::proof {

/// Returns the libraries outside the system's folders that the dynamic linker loads for \p program, by DT_NEEDED,
/// DT_RPATH and DT_RUNPATH of the program and of each library. Empty for a script or a damaged file.
std::vector<std::filesystem::path> libraries_of(const std::filesystem::path& program);

/// Whether a path is in /usr, /bin, /sbin, /lib or /lib64.
bool is_system_path(const std::filesystem::path& path);

}  // namespace bevel::proof
