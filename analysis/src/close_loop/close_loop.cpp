// SPDX-License-Identifier: MIT
#include <bevel/analysis/close_loop/close_loop.hpp>

#include <ostream>
#include <utility>

#include <bevel/analysis/close_loop/report.hpp>
#include <bevel/analysis/diagnose/diagnose_tool.hpp>
#include <bevel/analysis/diagnose/progress.hpp>
#include <bevel/analysis/diagnose/read_case.hpp>
#include <bevel/analysis/diagnose/report.hpp>
#include <bevel/analysis/diagnose/result_files.hpp>
#include <bevel/analysis/diagnose/verdict_json.hpp>
#include <bevel/cli/exit_status.hpp>
#include <bevel/io/estimator_config.hpp>

namespace bevel::analysis {
namespace {

estimator::EstimatorConfig load_estimator(const std::string& path) {
  estimator::EstimatorConfig config;
  io::ConfigFile file = io::ConfigFile::load(path);
  io::read_estimator_config(file.root(), config);
  file.finish();
  return config;
}

}  // namespace

ClosedLoop close_the_loop(const CloseLoopOptions& options, std::ostream& err) {
  const CaseFiles files = find_case(options.folder);
  const estimator::EstimatorConfig estimator = load_estimator(options.estimator_path);
  ClosedLoop loop;
  loop.case_name = files.name;
  DiagnoseOptions diagnosis;
  diagnosis.model_path = files.model_path;
  diagnosis.logs = files.logs;
  diagnosis.threads = options.threads;
  diagnosis.quiet = options.quiet;
  diagnosis.targets = 0;  // many more are steered to below
  Found found = find(diagnosis, err);
  loop.findings = std::move(found.findings);
  loop.made_of = std::move(found.made_of);
  loop.input_damaged = found.input_damaged;
  const diagnosis::Findings& findings = loop.findings;

  // Through the file and back: what is shown is what the other programs will read.
  io::ModelFile refitted = found.model;
  refitted.needle = findings.base.value;
  loop.models = {found.model, refitted,
                 io::parse_model_file(io::to_toml(model_of(findings, found.model)), "model.toml")};
  const diagnosis::RecordedCase recorded = without_outliers(read_case(files.logs).recorded, findings);
  const auto noise = measure_noise(files.logs, loop.models[kAsItCame], estimator);

  const DiagnosisProgress progress(options.quiet ? nullptr : stderr);
  progress.say("the rig with each model; the estimator on each recording");
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    loop.rig[stage] = simulate_rig(recorded, findings.noise, loop.models[stage]);
    const auto& fitted = stage == kAugmented ? findings.needle : findings.base;
    loop.estimator.known[stage] =
        replay_case(files.logs, loop.models[stage], noise, with_needle_known(estimator, fitted));
    loop.estimator.free[stage] = replay_case(files.logs, loop.models[stage], noise, estimator);
  }
  progress.say("steering to targets with each model");
  TargetingOptions targeting = options.targeting;
  targeting.threads = options.threads;
  cli::ProgressLine line(cli::ProgressLine::as_stderr_is(options.quiet));
  targeting.progress = &line;
  loop.targeting = steer_all(loop.models, recorded, findings.noise, targeting);
  progress.say("done");
  return loop;
}

void write_results(const ClosedLoop& loop, const std::string& out_folder) {
  auto files = result_files(loop.findings, loop.models[kAugmented], loop.made_of);
  files.push_back({"close-the-loop.html", page_html(loop)});
  files.push_back({"close-the-loop.json", to_json(loop)});
  write_together(out_folder, files);
}

int run(const CloseLoopOptions& options, std::ostream& out, std::ostream& err) {
  check_writable(options.out_folder);
  const ClosedLoop loop = close_the_loop(options, err);
  write_results(loop, options.out_folder);
  out << table_text(loop) << "\nwritten: " << options.out_folder
      << "/close-the-loop.html, close-the-loop.json, and the diagnosis: " << result_names(loop.findings) << '\n';
  return loop.input_damaged ? cli::kDamagedInput : cli::kOk;
}

}  // namespace bevel::analysis
