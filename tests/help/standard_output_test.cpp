// SPDX-License-Identifier: MIT
// Exit status of a program whose standard output cannot be written.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include <bevel/cli/command_line.hpp>
#include <bevel/cli/exit_status.hpp>

namespace bevel::cli {
namespace {

// Exit status of a program with its standard output in that file.
int status_of(const char* output, std::vector<std::string> arguments, const std::function<int()>& body) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (std::freopen(output, "w", stdout) == nullptr) ::_exit(99);
    CommandLine command_line("program", "For a test.");
    arguments.insert(arguments.begin(), "program");
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(argument.data());
    ::_exit(command_line.run(static_cast<int>(words.size()), words.data(), body));
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

struct Body {
  const char* name;
  int status;
  std::function<int()> run;
};

TEST(StandardOutput, ThatCannotBeWrittenIsAFailure) {
  const std::string much(1'000'000, 'x');
  const std::vector<Body> bodies = {
      {"a line by printf", kOk, [] { return std::printf("a line\n"), kOk; }},
      {"much by printf", kOk, [&] { return std::printf("%s\n", much.c_str()), kOk; }},
      {"a line by cout", kOk, [] { return std::cout << "a line\n", kOk; }},
      {"much by cout", kOk, [&] { return std::cout << much << '\n', kOk; }},
      {"of damaged input", kDamagedInput, [] { return std::cout << "a line\n", kDamagedInput; }},
  };
  for (const Body& body : bodies) {
    EXPECT_EQ(status_of("/dev/full", {}, body.run), kFailed) << body.name;
    EXPECT_EQ(status_of("/dev/null", {}, body.run), body.status) << body.name;
  }
  for (const char* argument : {"--help", "--version"}) {
    EXPECT_EQ(status_of("/dev/full", {argument}, [] { return kOk; }), kFailed) << argument;
    EXPECT_EQ(status_of("/dev/null", {argument}, [] { return kOk; }), kOk) << argument;
  }
}

TEST(StandardOutput, KeepsAStatusThatReportsMore) {
  EXPECT_EQ(status_of("/dev/full", {}, [] { return std::cout << "a line\n", 130; }), 130);
  EXPECT_EQ(status_of("/dev/full", {"--none"}, [] { return kOk; }), kUsage);
  EXPECT_EQ(status_of("/dev/full", {}, [] { return kOk; }), kOk) << "nothing was printed";
}

}  // namespace
}  // namespace bevel::cli
