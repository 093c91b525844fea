// SPDX-License-Identifier: MIT
#include "proof/campaign.hpp"

#include <atomic>
#include <csignal>
#include <exception>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <ostream>
#include <system_error>
#include <thread>

#include <bevel/error.hpp>
#include "proof/commitment.hpp"
#include "proof/page.hpp"
#include "proof/tool_run.hpp"
#include "proof/trial_files.hpp"

namespace bevel::proof {

using nlohmann::json;

namespace {

std::atomic<int> interrupted{0};
static_assert(std::atomic<int>::is_always_lock_free);

void note_signal(int signal) { interrupted = signal; }

// First Ctrl-C ends the campaign between steps; what is on disk stays whole either way.
class SignalGuard {
 public:
  SignalGuard() {
    struct sigaction action {};
    action.sa_handler = note_signal;
    action.sa_flags = static_cast<int>(SA_RESETHAND);  // the second one ends the program at once
    sigaction(SIGINT, &action, &before_int_);
    sigaction(SIGTERM, &action, &before_term_);
  }
  ~SignalGuard() {
    sigaction(SIGINT, &before_int_, nullptr);
    sigaction(SIGTERM, &before_term_, nullptr);
  }
  SignalGuard(const SignalGuard&) = delete;
  SignalGuard& operator=(const SignalGuard&) = delete;

 private:
  struct sigaction before_int_ {};
  struct sigaction before_term_ {};
};

// work(i) for i in [0, count), `jobs` at a time, until done, interrupted or one throws (which is thrown again here).
void in_parallel(int count, int jobs, const std::function<void(int)>& work) {
  std::atomic<int> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto serve = [&] {
    while (interrupted == 0) {
      const int i = next++;
      if (i >= count) return;
      try {
        work(i);
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    try {
      for (int j = 0; j < jobs; ++j) threads.emplace_back(serve);
    } catch (const std::system_error&) {  // a thread is refused: the others do its work
      if (threads.empty()) throw;
    }
  }
  if (failure) std::rethrow_exception(failure);
}

// A folder belongs to one seed, one share of varied trials and one edition: trials of two would mix.
void claim_folder(const CampaignOptions& options) {
  const fs::path path = options.out / "campaign.json";
  if (fs::exists(path)) {
    const json before = json::parse(read_text(path));
    if (before.at("seed") != options.seed)
      throw ConfigurationError(options.out.string() + ": holds trials of seed " + before.at("seed").dump() + ", not " +
                               std::to_string(options.seed) + "; take that seed or another folder");
    const double varied = before.value("varied", 0.0);  // campaigns before there was any
    if (varied != options.population.varied)
      throw ConfigurationError(options.out.string() + ": holds trials of which a share of " + json(varied).dump() +
                               " is varied, not " + json(options.population.varied).dump() +
                               "; take that share or another folder");
    const int edition = before.value("edition", 1);  // campaigns before there were two
    if (edition != options.population.edition)
      throw ConfigurationError(options.out.string() + ": holds trials of edition " + std::to_string(edition) +
                               ", not " + std::to_string(options.population.edition) +
                               "; take that edition or another folder");
    if (before.value("nulls", false) != options.population.nulls)
      throw ConfigurationError(
          options.out.string() +
          (options.population.nulls ? ": holds trials with physics concealed" : ": holds nulls only") +
          "; take another folder");
    if (before.value("two_groups", false) != options.population.two_groups)
      throw ConfigurationError(options.out.string() + ": holds trials of " +
                               (options.population.two_groups ? "one group" : "two groups") +
                               " of recordings; take another folder");
    return;
  }
  write_atomically(path, json{{"seed", options.seed},
                              {"varied", options.population.varied},
                              {"edition", options.population.edition},
                              {"nulls", options.population.nulls},
                              {"two_groups", options.population.two_groups}}
                                 .dump(1) +
                             "\n");
}

void write_commitments(const CampaignOptions& options) {
  json all = json::array();
  for (int i = 0; i < options.trials; ++i)
    all.push_back(json::parse(read_text(TrialFolders(options.out, i).commitment)));
  write_atomically(options.out / "commitments.json", all.dump(1) + "\n");
}

// Results of two tools must not mix.
std::string claim_tool(const CampaignOptions& options) {
  std::string sha256 = io::sha256_of_file(options.diagnose.string());
  const fs::path path = options.out / "tool.json";
  if (fs::exists(path)) {
    const std::string before = json::parse(read_text(path)).at("sha256");
    if (before != sha256)
      throw ConfigurationError(options.out.string() + ": holds verdicts of another program (sha256 " +
                               before.substr(0, 12) + "..., now " + sha256.substr(0, 12) +
                               "...); take another --out, or remove tool.json and trials/*/run.json there");
  } else {
    write_atomically(path, json{{"sha256", sha256}}.dump(1) + "\n");
  }
  return sha256;
}

void check_inputs(const TrialFolders& folders) {
  const json commitment = json::parse(read_text(folders.commitment));
  for (const auto& [name, sha256] : commitment.at("sha256_of_inputs").items())
    if (io::sha256_of_file((folders.given / name).string()) != sha256)
      throw ConfigurationError((folders.given / name).string() + ": changed since it was sealed");
}

// False if interrupted before the end: nothing is kept of it then.
bool examine(const CampaignOptions& options, const fs::path& program, int number, const std::string& tool_sha256) {
  const TrialFolders folders(options.out, number);
  check_inputs(folders);
  const fs::path unfinished = folders.trial / "out.unfinished";
  fs::remove_all(unfinished);
  fs::create_directories(unfinished);
  ToolRun run{program,
              fs::absolute(folders.given),
              fs::absolute(unfinished),
              fs::absolute(options.out),
              fs::absolute(folders.trial / "console.txt"),
              {},
              options.limit_s,
              !options.unsealed};
  for (const std::string& folder : options.also_readable) run.readable.push_back(fs::canonical(folder));
  const ToolEnd end = run_tool(run, interrupted);
  if (end.stopped) {
    fs::remove_all(unfinished);
    return false;
  }
  fs::remove_all(folders.tool_output);
  fs::rename(unfinished, folders.tool_output);
  const fs::path verdict = folders.tool_output / "verdict.json";
  write_atomically(folders.run, json{{"exit_status", end.exit_status},
                                     {"seconds", end.seconds},
                                     {"out_of_time", end.out_of_time},
                                     {"sealed", !options.unsealed},
                                     {"tool_sha256", tool_sha256},
                                     {"verdict_sha256", fs::is_regular_file(fs::symlink_status(verdict))
                                                            ? json(io::sha256_of_file(verdict.string()))
                                                            : json(nullptr)}}
                                        .dump(1) +
                                    "\n");
  return true;
}

// All verdicts in one file, before any truth is opened.
std::string write_verdicts(const CampaignOptions& options) {
  json all = json::object();
  for (int i = 0; i < options.trials; ++i) {
    const TrialFolders folders(options.out, i);
    const json run = json::parse(read_text(folders.run));
    const fs::path verdict = folders.tool_output / "verdict.json";
    all[trial_name(i)] = {{"sha256", run.at("verdict_sha256")}, {"verdict", nullptr}};
    if (!run.at("verdict_sha256").is_null())
      all[trial_name(i)]["verdict"] = json::parse(read_text(verdict), nullptr, false);
    if (all[trial_name(i)]["verdict"].is_discarded()) all[trial_name(i)]["verdict"] = "not JSON";
  }
  const std::string text = all.dump(1) + "\n";
  write_atomically(options.out / "verdicts.json", text);
  return io::sha256_hex(text);
}

TrialScore score_trial(const CampaignOptions& options, int number) {
  const TrialFolders folders(options.out, number);
  const OpenedTruth truth = parse_truth(open_truth(folders));
  const json run = json::parse(read_text(folders.run));
  const auto judge = [&]() -> TrialScore {
    if (run.at("out_of_time")) return score_abstention(truth, "out of time");
    if (run.at("exit_status") != 0) return score_abstention(truth, "exit status " + run.at("exit_status").dump());
    if (run.at("verdict_sha256").is_null()) return score_abstention(truth, "no verdict.json");
    const fs::path path = folders.tool_output / "verdict.json";
    if (io::sha256_of_file(path.string()) != run.at("verdict_sha256"))
      throw ConfigurationError(path.string() + ": changed since the tool wrote it");
    try {
      return score_verdict(truth, parse_verdict(read_text(path)));
    } catch (const Error& e) {
      return score_abstention(truth, e.what());
    }
  };
  TrialScore score = judge();
  score.seconds = run.at("seconds");
  write_atomically(folders.score, as_json(score).dump(1) + "\n");
  return score;
}

bool all_sealed(const CampaignOptions& options) {
  for (int i = 0; i < options.trials; ++i)
    if (!json::parse(read_text(TrialFolders(options.out, i).run)).at("sealed")) return false;
  return true;
}

}  // namespace

int run_campaign(const CampaignOptions& options, std::ostream& progress) {
  interrupted = 0;
  const SignalGuard guard;
  if (!options.generate_only && !fs::is_regular_file(options.diagnose))
    throw ConfigurationError(options.diagnose.string() + ": there is no such program (the tool under test)");
  claim_folder(options);
  std::mutex mutex;
  const auto say = [&](const std::string& line) {
    const std::scoped_lock lock(mutex);
    if (options.watch.make_room) options.watch.make_room();
    progress << line << std::endl;
  };
  const auto stopped = [&] {
    if (interrupted != 0) say("interrupted; the same command goes on from here");
    return interrupted != 0;
  };
  const CampaignWatch& watch = options.watch;
  // What is on disk from an earlier run is no piece of this one's, or it would be taken for quick work.
  const auto begin = [&](const std::string& what, const auto& is_to_do) {
    std::size_t pieces = 0;
    for (int i = 0; i < options.trials; ++i) pieces += is_to_do(i) ? 1 : 0;
    if (watch.begin) watch.begin(what, pieces, static_cast<std::size_t>(options.jobs));
  };
  const auto one_done = [&](const std::string& line) {
    say(line);
    if (watch.one_done) watch.one_done();
  };
  begin("trials drawn", [&](int i) { return !fs::exists(TrialFolders(options.out, i).commitment); });
  in_parallel(options.trials, options.jobs, [&](int i) {
    if (prepare_trial(options.out, options.seed, i, options.population)) one_done(trial_name(i) + " drawn and sealed");
  });
  if (watch.end) watch.end();
  if (stopped()) return 130;
  write_commitments(options);
  if (options.generate_only) return 0;

  CampaignFacts facts;
  facts.seed = options.seed;
  facts.commitments_sha256 = io::sha256_of_file((options.out / "commitments.json").string());
  facts.tool_sha256 = claim_tool(options);
  const fs::path program = fs::canonical(options.diagnose);
  begin("trials examined", [&](int i) { return !fs::exists(TrialFolders(options.out, i).run); });
  in_parallel(options.trials, options.jobs, [&](int i) {
    if (fs::exists(TrialFolders(options.out, i).run)) return;
    if (examine(options, program, i, facts.tool_sha256)) one_done(trial_name(i) + " examined");
  });
  if (watch.end) watch.end();
  if (stopped()) return 130;

  facts.verdicts_sha256 = write_verdicts(options);
  facts.sealed = all_sealed(options);
  std::vector<TrialScore> scores;
  for (int i = 0; i < options.trials; ++i) scores.push_back(score_trial(options, i));
  const Tally sums = tally(scores);
  json results{{"seed", options.seed},
               {"varied", options.population.varied},
               {"edition", options.population.edition},
               {"nulls", options.population.nulls},
               {"two_groups", options.population.two_groups},
               {"sealed", facts.sealed},
               {"tool_sha256", facts.tool_sha256},
               {"commitments_sha256", facts.commitments_sha256},
               {"verdicts_sha256", facts.verdicts_sha256},
               {"summary", as_json(sums)},
               {"trials", json::array()}};
  for (const TrialScore& score : scores) results["trials"].push_back(as_json(score));
  write_atomically(options.out / "results.json", results.dump(1) + "\n");
  write_atomically(options.out / "results.html", results_page(facts, sums, scores));
  const Share visible = sums.strict.contains("visible") ? sums.strict.at("visible") : Share{};
  say(std::to_string(visible.hits) + " of " + std::to_string(visible.of) + " visible sets exactly right, " +
      std::to_string(sums.false_alarms.hits) + " false alarms in " + std::to_string(sums.false_alarms.of) + " nulls, " +
      std::to_string(sums.abstentions) + " abstentions: " + (options.out / "results.html").string());
  return 0;
}

}  // namespace bevel::proof
