// SPDX-License-Identifier: MIT
// The tool under test sees its case and nothing else. Each way out that is tried sealed is tried unsealed as well:
// there it must succeed, or the test would prove nothing.
#include "proof/sandbox.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <thread>

#include "proof/libraries.hpp"
#include "proof/tool_run.hpp"
#include "proof/trial_files.hpp"
#include "tests/proof/script_tool.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::proof {
namespace {

using testing::HasSubstr;
using testing::Not;

bool sandboxes_work() {
  return std::system((std::string(kBubblewrap) + " --unshare-all --ro-bind / / true 2>/dev/null").c_str()) == 0;
}

class Sandbox : public testing::Test {
 protected:
  void SetUp() override {
    if (!sandboxes_work()) GTEST_SKIP() << "bubblewrap is not installed, or the kernel lets users make no namespaces";
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

// The seed of a campaign was on the command line of its program, which was /proc/1 inside.
TEST_F(Sandbox, NoCommandLineOfTheCallerIsVisible) {
  const std::string attempt = "for p in /proc/[0-9]*; do tr '\\0' ' ' <$p/cmdline; done";
  EXPECT_THAT(console(attempt, false), HasSubstr("test_proof_runs"));
  const std::string sealed = console(attempt, true);
  EXPECT_THAT(sealed, HasSubstr("bwrap --args 3"));
  EXPECT_THAT(sealed, Not(HasSubstr("test_proof_runs")));
  EXPECT_THAT(sealed, Not(HasSubstr((folder_ / "out").string())));
}

TEST_F(Sandbox, NoVariableOfTheCallerIsVisible) {
  ::setenv("BEVEL_TEST_SECRET", "THE SEED", 1);
  const std::string attempt = "cat /proc/[0-9]*/environ; env";
  // This program's own environment, as /proc shows it, is that of its start: a child has the variable.
  const std::string unsealed = console("cat /proc/[0-9]*/environ", false);
  EXPECT_THAT(unsealed, HasSubstr("LANG=C.UTF-8"));
  const std::string sealed = console(attempt, true);
  EXPECT_THAT(sealed, Not(HasSubstr("THE SEED")));
  EXPECT_THAT(sealed, HasSubstr("HOME=/tmp"));
  for (const char* name : {"PWD=/root", "OLDPWD=/", "USER=", "LOGNAME=", "SHELL=", "LD_", "SSH_", "TERM="})
    EXPECT_THAT(sealed, Not(HasSubstr(name))) << name;
  ::unsetenv("BEVEL_TEST_SECRET");
}

TEST_F(Sandbox, ThereAreNoCapabilitiesAndNoneCanBeGained) {
  const std::string sealed = console("grep -E '^(Cap|NoNewPrivs)' /proc/self/status", true);
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb"})
    EXPECT_THAT(sealed, HasSubstr(std::string(set) + ":\t0000000000000000")) << set;
  EXPECT_THAT(sealed, HasSubstr("NoNewPrivs:\t1"));
}

TEST_F(Sandbox, NoNamespaceWithCapabilitiesCanBeMade) {
  const std::string attempt =
      "unshare -rm sh -c 'mount -o remount,bind,rw /case; echo no > /case/rec01.lcm; "
      "grep CapEff /proc/self/status'";
  const std::string sealed = console(attempt, true);
  EXPECT_THAT(sealed, Not(HasSubstr("CapEff:\t000001ffffffffff")));
  EXPECT_EQ(read_text(folder_ / "case" / "rec01.lcm"), "a log");
}

TEST_F(Sandbox, WhatIsReadOnlyCannotBeMountedWritable) {
  const std::string sealed = console(
      "for at in / /case /usr /etc /tool; do mount -o remount,bind,rw $at && echo REMOUNTED; done; mount -t tmpfs t "
      "/case && echo MOUNTED; echo no > /case/rec01.lcm && echo WRITTEN; touch /usr/bevel-test && echo WRITTEN; touch "
      "/bevel-test && echo WRITTEN",
      true);
  for (const char* done : {"REMOUNTED", "MOUNTED", "WRITTEN"}) EXPECT_THAT(sealed, Not(HasSubstr(done)));
  EXPECT_FALSE(fs::exists("/usr/bevel-test"));
  EXPECT_EQ(read_text(folder_ / "case" / "rec01.lcm"), "a log");
}

// The path of a campaign may tell the number of the trial, or a seed.
TEST_F(Sandbox, MountsDoNotShowThePathOfTheCase) {
  const std::string sealed = console("cat /proc/self/mountinfo /proc/mounts", true);
  EXPECT_THAT(sealed, HasSubstr(" /case "));
  EXPECT_THAT(sealed, Not(HasSubstr((folder_ / "case").string())));
  EXPECT_THAT(sealed, Not(HasSubstr((folder_ / "out").string())));
}

TEST_F(Sandbox, ProcDoesNotDescribeTheMachine) {
  const std::string attempt = "cat /proc/cmdline /proc/keys /proc/sched_debug /proc/modules; ls /proc/acpi /proc/fs";
  EXPECT_NE(console("cat /proc/cmdline", false), "");
  EXPECT_THAT(console("(" + attempt + ") 2>/dev/null", true), testing::MatchesRegex("(/proc/[a-z]*:|\n)*"));
}

// ldd loads the audit library of a program, and runs its code outside.
TEST_F(Sandbox, NoCodeOfTheToolRunsToFindItsLibraries) {
  const fs::path tool = BEVEL_AUDITED_TOOL, mark = BEVEL_AUDIT_MARK;
  fs::remove(mark);
  libraries_of(tool);
  ToolRun run = run_of("true", true);
  run.program = tool;
  const std::atomic<int> stop{0};
  run_tool(run, stop);
  EXPECT_FALSE(fs::exists(mark));
  (void)!std::system(("ldd '" + tool.string() + "' >/dev/null 2>&1").c_str());
  EXPECT_TRUE(fs::exists(mark)) << "or the test proves nothing";
}

TEST_F(Sandbox, AFolderWithinTheSecretIsRefused) {
  const std::atomic<int> stop{0};
  ToolRun run = run_of("true", true);
  run.readable = {folder_ / "sealed"};
  EXPECT_THAT([&] { run_tool(run, stop); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("which the tool under test can read")));
}

TEST_F(Sandbox, OutputIsCopiedWithoutWhatLinksAndDevicesLeadTo) {
  const std::string truth = secret().string();
  console("ln -s " + truth + " /out/link; mkfifo /out/fifo; mkdir /out/folder; echo yes > /out/folder/file", true);
  EXPECT_TRUE(fs::is_symlink(folder_ / "out" / "link"));
  EXPECT_FALSE(fs::exists(folder_ / "out" / "fifo"));
  EXPECT_EQ(read_text(folder_ / "out" / "folder" / "file"), "yes\n");
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
