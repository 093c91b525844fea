// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Sandbox of one process tree, by bubblewrap: the system's programs and libraries, the given folder read-only, the
/// output folder, and nothing else. Inside, no path leads to the rest of the disk, /proc shows only the processes of
/// the sandbox, and there are no network, no capabilities, no further user namespaces and no variables of the caller.
#include <filesystem>
#include <string>
#include <vector>

namespace bevel::proof {

namespace fs = std::filesystem;

struct SandboxView {
  fs::path program;                // bound at its path, with the libraries that it needs
  fs::path given;                  // seen as /case, read-only
  fs::path output;                 // seen as /out
  std::vector<fs::path> readable;  // folders bound at their paths, read-only
};

/// Program of bubblewrap, a Debian package.
inline constexpr const char* kBubblewrap = "/usr/bin/bwrap";

/// Options for bubblewrap, each ended by a zero byte, as `--args FD` reads them: on a command line they would be
/// visible inside, in /proc/1/cmdline.
/// @param secret  folder whose files must not be visible
/// @throws IoError if bubblewrap is not installed, if the program or a folder does not exist, or if one of
///   them contains \p secret or is in it
std::string sandbox_options(const SandboxView& view, const fs::path& secret);

}  // namespace bevel::proof
