// SPDX-License-Identifier: MIT
#pragma once
// A program of this build run to its end, with a limit on its time. Needs BEVEL_BINARY_DIR, which every test has.
#include <sys/wait.h>

#include <chrono>
#include <cstdlib>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace bevel::test {

struct Said {
  int status = -1;  // 124: not done within the limit
  std::string out, err;
  double seconds = 0;
};

// `arguments` as the shell reads them.
inline Said run_program(const TemporaryFolder& folder, const std::string& program, const std::string& arguments,
                        int limit_s = 60) {
  const auto start = std::chrono::steady_clock::now();
  const std::string command = "timeout " + std::to_string(limit_s) + " " + BEVEL_BINARY_DIR + "/bin/" + program + " " +
                              arguments + " >" + (folder / "stdout").string() + " 2>" + (folder / "stderr").string();
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text_of(folder / "stdout"),
          text_of(folder / "stderr"), std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
}

}  // namespace bevel::test
