// The tool under test sees its case and nothing else. Each way out that is tried sealed is tried unsealed as well:
// there it must succeed, or the test would prove nothing.
#include "proof/sandbox.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "proof/tool_run.hpp"
#include "proof/trial_files.hpp"
#include "tests/proof/script_tool.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::proof {
namespace {

using testing::HasSubstr;
using testing::Not;

bool namespaces_work() {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(::unshare(CLONE_NEWUSER | CLONE_NEWNS | CLONE_NEWPID) == 0 ? 0 : 1);
  int status = 1;
  ::waitpid(child, &status, 0);
  return status == 0;
}

class Sandbox : public testing::Test {
 protected:
  void SetUp() override {
    if (!namespaces_work()) GTEST_SKIP() << "this kernel does not let users make namespaces";
    fs::create_directories(folder_ / "case");
    fs::create_directories(folder_ / "out");
    write_atomically(folder_ / "case" / "rec01.lcm", "a log");
    write_atomically(folder_ / "case" / "model.toml", "a model");
    write_atomically(secret(), "THE TRUTH");
  }
  fs::path secret() const { return folder_ / "sealed" / "t0000.json"; }

  ToolRun run_of(const std::string& body, bool sealed) {
    return {write_tool(folder_.path(), body),
            folder_ / "case",
            folder_ / "out",
            folder_ / "sealed",
            folder_ / "console.txt",
            {},
            30.0,
            sealed};
  }
  // What the tool prints.
  std::string console(const std::string& body, bool sealed) {
    const std::atomic<int> stop{0};
    run_tool(run_of(body, sealed), stop);
    return read_text(folder_ / "console.txt");
  }

  test::TemporaryFolder folder_;
};

TEST_F(Sandbox, TheCaseIsThereReadOnlyAndTheOutputIsKept) {
  const std::string said = console(
      "echo \"$@\"; cat /case/rec01.lcm /case/model.toml; echo yes > /out/verdict.json; "
      "echo no > /case/rec01.lcm; rm /case/model.toml",
      true);
  EXPECT_THAT(said, HasSubstr("--model /case/model.toml --out /out /case/rec01.lcm"));
  EXPECT_THAT(said, HasSubstr("a log"));
  EXPECT_EQ(read_text(folder_ / "out" / "verdict.json"), "yes\n");
  EXPECT_EQ(read_text(folder_ / "case" / "rec01.lcm"), "a log");
  EXPECT_EQ(read_text(folder_ / "case" / "model.toml"), "a model");
}

TEST_F(Sandbox, TheTruthCannotBeOpenedByItsName) {
  const std::string attempt = "cat '" + secret().string() + "'; cat /case/../sealed/t0000.json; cat ../sealed/*";
  EXPECT_THAT(console(attempt, false), HasSubstr("THE TRUTH"));
  EXPECT_THAT(console(attempt, true), Not(HasSubstr("THE TRUTH")));
}

TEST_F(Sandbox, TheTruthIsNowhereOnTheVisibleDisk) {
  const std::string found_unsealed = console("find '" + folder_.path().string() + "' -name 't0000.json'", false);
  EXPECT_THAT(found_unsealed, HasSubstr("t0000.json"));
  EXPECT_THAT(console("find / -name 't0000.json' 2>/dev/null", true), Not(HasSubstr("t0000.json")));
}

TEST_F(Sandbox, NoOtherProcessIsInSight) {
  const std::string attempt = "for p in /proc/[0-9]*; do cat $p/root" + secret().string() +
                              " 2>/dev/null; done; "
                              "echo processes $(ls -d /proc/[0-9]* | wc -l)";
  EXPECT_THAT(console(attempt, false), HasSubstr("THE TRUTH"));
  const std::string sealed = console(attempt, true);
  EXPECT_THAT(sealed, Not(HasSubstr("THE TRUTH")));
  // Its own init, the shell, the subshell and what counts in it.
  EXPECT_LE(std::stoi(sealed.substr(sealed.find("processes ") + 10)), 6) << sealed;
}

TEST_F(Sandbox, NoOpenFileLeadsToTheTruth) {
  const int leak = ::open(secret().c_str(), O_RDONLY);  // without O_CLOEXEC  NOLINT
  ASSERT_GT(leak, 2);
  const std::string sealed = console("for f in 3 4 5 6 7 8 9; do cat <&$f; done; ls /proc/self/fd", true);
  EXPECT_THAT(sealed, Not(HasSubstr("THE TRUTH")));
  EXPECT_THAT(sealed, Not(HasSubstr(std::to_string(leak) + "\n" + std::to_string(leak + 1))));
  ::close(leak);
}

TEST_F(Sandbox, ThereIsNoNetwork) {
  const std::string devices = "tail -n +3 /proc/net/dev | cut -d: -f1";
  EXPECT_THAT(console(devices, true), testing::MatchesRegex("[ \n]*lo[ \n]*([a-z0-9]*tunl0|gre0|sit0|[ \n])*"));
}

TEST_F(Sandbox, TheOldRootCannotBeMountedAgain) {
  const std::string sealed = console("mkdir /tmp/m; mount -t proc p /tmp/m && cat /tmp/m/1/root" + secret().string() +
                                         "; umount /case; umount -l /; cat /case/../sealed/t0000.json; ls /.old",
                                     true);
  EXPECT_THAT(sealed, Not(HasSubstr("THE TRUTH")));
}

TEST_F(Sandbox, ExitStatusComesThrough) {
  const std::atomic<int> stop{0};
  EXPECT_EQ(run_tool(run_of("exit 7", true), stop).exit_status, 7);
  EXPECT_EQ(run_tool(run_of("kill -SEGV $$", true), stop).exit_status, 128 + SIGSEGV);
  EXPECT_EQ(run_tool(run_of("exit 7", false), stop).exit_status, 7);
}

TEST_F(Sandbox, WhenTimeIsOverNothingOfTheToolStaysBehind) {
  const std::atomic<int> stop{0};
  for (const bool sealed : {true, false}) {
    ToolRun run = run_of(std::string(kFindOut) + "(sleep 1.5; touch \"$out/late\") & sleep 100", sealed);
    run.limit_s = 0.4;
    const ToolEnd end = run_tool(run, stop);
    EXPECT_TRUE(end.out_of_time);
    EXPECT_LT(end.seconds, 20.0);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(1600));
  EXPECT_FALSE(fs::exists(folder_ / "out" / "late"));
}

TEST_F(Sandbox, ATruthInSightOfTheToolIsRefused) {
  const std::atomic<int> stop{0};
  ToolRun run = run_of("true", true);
  run.readable = {folder_.path()};
  EXPECT_THAT([&] { run_tool(run, stop); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("which the tool under test can read")));
}

TEST_F(Sandbox, AMissingToolIsNamed) {
  const std::atomic<int> stop{0};
  ToolRun run = run_of("true", true);
  run.program = "/nowhere/bevel-diagnose";
  EXPECT_THAT([&] { run_tool(run, stop); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("/nowhere/bevel-diagnose")));
}

// A program linked to libraries outside the system's folders finds them inside: here bevel-blindtrial itself, which
// does not know a tool's options and says so.
TEST_F(Sandbox, LibrariesOfTheToolAreBound) {
  ToolRun run = run_of("true", true);
  run.program = fs::path(BEVEL_BINARY_DIR) / "bin" / "bevel-blindtrial";
  const std::atomic<int> stop{0};
  EXPECT_EQ(run_tool(run, stop).exit_status, 2);
  EXPECT_THAT(read_text(run.console), HasSubstr("--model"));
}

}  // namespace
}  // namespace bevel::proof
