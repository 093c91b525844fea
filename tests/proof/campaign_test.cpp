// SPDX-License-Identifier: MIT
// A whole campaign with stub tools: it goes on where it was, ends clean, and does not mix.
#include "proof/campaign.hpp"

#include <gmock/gmock.h>

#include <csignal>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "proof/commitment.hpp"
#include "proof/trial_files.hpp"
#include "tests/proof/script_tool.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::proof {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr const char* kSayNothing = "echo '{\"verdict\": \"nothing-missing\", \"effects\": []}' > $out/verdict.json\n";

class Campaign : public testing::Test {
 protected:
  // Unsealed, so that the stubs can leave traces beside the campaign's folder.
  CampaignOptions options(const std::string& tool_body, int trials = 2) {
    CampaignOptions o;
    o.trials = trials;
    o.seed = 4;
    o.out = folder_ / "campaign";
    o.diagnose = write_tool(folder_.path(), std::string(kFindOut) + tool_body);
    o.unsealed = true;
    return o;
  }
  int run(const CampaignOptions& o) {
    std::ostringstream progress;
    const int status = run_campaign(o, progress);
    said_ = progress.str();
    return status;
  }
  int calls() const {
    const fs::path path = folder_ / "calls";
    if (!fs::exists(path)) return 0;
    const std::string text = read_text(path);
    return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
  }
  std::string count_call() const { return "echo called >> '" + (folder_ / "calls").string() + "'\n"; }

  test::TemporaryFolder folder_;
  std::string said_;
};

// What was there before is no piece of a run: it would be taken for quick work.
TEST_F(Campaign, WhoWatchesIsToldOfEachPieceThatThisRunDoes) {
  CampaignOptions o = options(kSayNothing, 3);
  std::mutex mutex;
  std::vector<std::string> told;
  const auto tell = [&](const std::string& text) {
    const std::scoped_lock lock(mutex);
    told.push_back(text);
  };
  o.jobs = 1;
  o.watch = {.begin = [&](const auto& what, auto of, auto) { tell(what + " " + std::to_string(of)); },
             .one_done = [&] { tell("one"); },
             .make_room = {},
             .end = [&] { tell("end"); }};
  o.trials = 1;
  run(o);
  EXPECT_THAT(told, testing::ElementsAre("trials drawn 1", "one", "end", "trials examined 1", "one", "end"));
  told.clear();
  o.trials = 3;
  run(o);
  EXPECT_THAT(told,
              testing::ElementsAre("trials drawn 2", "one", "one", "end", "trials examined 2", "one", "one", "end"));
}

TEST_F(Campaign, OfTwoGroupsBothAreHandedOverByName) {
  const std::string asked = (folder_ / "asked").string();
  CampaignOptions o = options("");
  o.diagnose = write_tool(folder_.path(),
                          "echo \"$@\" >> '" + asked + "'\n" + kFindOut +
                              "echo '{\"verdict\": \"unchanged\", \"changes\": []}' > $out/verdict.json\n",
                          "two_groups");
  o.population.two_groups = true;
  o.trials = 1;
  ASSERT_EQ(run(o), 0);
  EXPECT_THAT(read_text(asked), testing::ContainsRegex("--baseline [^ ]*before/rec05.lcm .*before/rec08.lcm --changed "
                                                       "[^ ]*after/rec01.lcm .*after/rec04.lcm"));
  o.population.two_groups = false;
  EXPECT_THAT([&] { run(o); }, ThrowsMessage<std::runtime_error>(HasSubstr("holds trials of two groups")));
}

TEST_F(Campaign, GoesOnWhereItWas) {
  CampaignOptions o = options(count_call() + kSayNothing);
  o.generate_only = true;
  ASSERT_EQ(run(o), 0);
  EXPECT_EQ(calls(), 0);
  const TrialFolders first(o.out, 0);
  const std::string commitment = read_text(first.commitment);
  EXPECT_FALSE(fs::exists(o.out / "results.json"));

  o.generate_only = false;
  ASSERT_EQ(run(o), 0);
  EXPECT_EQ(calls(), 2);
  EXPECT_EQ(read_text(first.commitment), commitment);  // not drawn again: a new salt would show
  const json results = json::parse(read_text(o.out / "results.json"));
  EXPECT_EQ(results["summary"]["trials"], 2);
  EXPECT_EQ(results["sealed"], false);
  EXPECT_EQ(results["verdicts_sha256"], io::sha256_hex(read_text(o.out / "verdicts.json")));
  EXPECT_THAT(read_text(o.out / "results.html"), HasSubstr("Blind trial"));

  fs::remove(TrialFolders(o.out, 1).run);
  ASSERT_EQ(run(o), 0);
  EXPECT_EQ(calls(), 3);
  ASSERT_EQ(run(o), 0);
  EXPECT_EQ(calls(), 3);
}

TEST_F(Campaign, DoesNotMixSeedsEditionsOrTools) {
  CampaignOptions o = options(kSayNothing, 1);
  ASSERT_EQ(run(o), 0);
  CampaignOptions other_seed = o;
  other_seed.seed = 5;
  EXPECT_THAT([&] { run(other_seed); }, ThrowsMessage<std::runtime_error>(HasSubstr("seed 4, not 5")));
  CampaignOptions other_edition = o;
  other_edition.population.edition = 1;
  EXPECT_THAT([&] { run(other_edition); }, ThrowsMessage<std::runtime_error>(HasSubstr("edition 4, not 1")));
  CampaignOptions nulls = o;
  nulls.population.nulls = true;
  EXPECT_THAT([&] { run(nulls); }, ThrowsMessage<std::runtime_error>(HasSubstr("holds trials with physics concealed")));
  const CampaignOptions other_tool = options(std::string("true\n") + kSayNothing, 1);
  EXPECT_THAT([&] { run(other_tool); }, ThrowsMessage<std::runtime_error>(HasSubstr("another program")));
}

TEST_F(Campaign, ChangedLogsAndVerdictsAreNoticed) {
  CampaignOptions o = options(kSayNothing, 1);
  ASSERT_EQ(run(o), 0);
  const TrialFolders trial(o.out, 0);
  write_atomically(trial.tool_output / "verdict.json", R"({"verdict": "unknown-effect"})");
  EXPECT_THAT([&] { run(o); }, ThrowsMessage<std::runtime_error>(HasSubstr("verdict.json: changed")));
  fs::remove(trial.run);
  write_atomically(trial.given / "rec02.lcm", "other");
  EXPECT_THAT([&] { run(o); }, ThrowsMessage<std::runtime_error>(HasSubstr("rec02.lcm: changed")));
}

TEST_F(Campaign, FailuresOfTheToolAreAbstentions) {
  for (const char* body :
       {"exit 3", "true", "echo nonsense > $out/verdict.json", "ln -s /etc/passwd $out/verdict.json"}) {
    fs::remove_all(folder_ / "campaign");
    const CampaignOptions o = options(body, 1);
    ASSERT_EQ(run(o), 0) << body;
    EXPECT_EQ(json::parse(read_text(o.out / "results.json"))["summary"]["abstentions"], 1) << body;
  }
}

TEST_F(Campaign, AnInterruptLeavesNothingHalfDone) {
  CampaignOptions o = options("echo half > $out/verdict.json; kill -INT $PPID; sleep 60", 2);
  o.jobs = 1;
  ASSERT_EQ(run(o), 130);
  EXPECT_THAT(said_, HasSubstr("goes on from here"));
  const TrialFolders trial(o.out, 0);
  EXPECT_FALSE(fs::exists(trial.run));
  EXPECT_FALSE(fs::exists(trial.tool_output));
  EXPECT_FALSE(fs::exists(trial.trial / "out.unfinished"));
  EXPECT_FALSE(fs::exists(o.out / "results.json"));
  EXPECT_TRUE(fs::exists(trial.commitment));
}

TEST_F(Campaign, AToolThatDoesNotExistIsNamedBeforeAnythingRuns) {
  CampaignOptions o = options("true", 1);
  o.diagnose = folder_ / "no-such-tool";
  EXPECT_THAT([&] { run(o); }, ThrowsMessage<std::runtime_error>(HasSubstr("no-such-tool")));
}

}  // namespace
}  // namespace bevel::proof
