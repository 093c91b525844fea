// SPDX-License-Identifier: MIT
// The files of a result, all of them or none.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace bevel::analysis {

struct ResultFile {
  std::string name;
  std::optional<std::string> text;  // nothing: these results have no such file, and an older one of that name goes
};

// Asked before the long work: throws IoError naming the folder if files could not be made in it (or it could
// not be made itself). Leaves nothing behind.
void check_writable(const std::filesystem::path& folder);

// Each is written whole under another name, then all take their places. The last one is taken away first and comes
// last: where it is, the others belong to it, and none is left over from before. Throws IoError naming the
// file and the reason, with the folder as it was unless the disk fails in the act of renaming.
void write_together(const std::filesystem::path& folder, const std::vector<ResultFile>& files);

// From here on SIGINT and SIGTERM end the program at once, with a message and status 1, and no file half-written: while
// results take their places they wait. Work that only computes has nothing to clean up.
void end_on_signals(const char* program);

}  // namespace bevel::analysis
