#include "proof/campaign.hpp"

#include <atomic>
#include <csignal>
#include <exception>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <thread>

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
  std::vector<std::thread> threads;
  for (int j = 0; j < jobs; ++j) threads.emplace_back(serve);
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}

// A folder belongs to one seed: trials of two would mix.
void claim_folder(const CampaignOptions& options) {
  const fs::path path = options.out / "campaign.json";
  if (fs::exists(path)) {
    const json before = json::parse(read_text(path));
    if (before.at("seed") != options.seed)
      throw std::runtime_error(options.out.string() + ": holds trials of seed " + before.at("seed").dump() + ", not " +
                               std::to_string(options.seed) + "; take that seed or another folder");
    return;
  }
  write_atomically(path, json{{"seed", options.seed}}.dump(1) + "\n");
}

void write_commitments(const CampaignOptions& options) {
  json all = json::array();
  for (int i = 0; i < options.trials; ++i)
    all.push_back(json::parse(read_text(TrialFolders(options.out, i).commitment)));
  write_atomically(options.out / "commitments.json", all.dump(1) + "\n");
}

}  // namespace

int run_campaign(const CampaignOptions& options, std::ostream& progress) {
  interrupted = 0;
  const SignalGuard guard;
  claim_folder(options);
  std::mutex mutex;
  const auto say = [&](const std::string& line) {
    const std::scoped_lock lock(mutex);
    progress << line << std::endl;
  };
  in_parallel(options.trials, options.jobs, [&](int i) {
    if (prepare_trial(options.out, options.seed, i)) say(trial_name(i) + " drawn and sealed");
  });
  if (interrupted != 0) {
    say("interrupted; the same command goes on from here");
    return 130;
  }
  write_commitments(options);
  return 0;
}

}  // namespace bevel::proof
