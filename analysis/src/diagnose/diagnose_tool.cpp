// SPDX-License-Identifier: MIT
#include <bevel/analysis/diagnose/diagnose_tool.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <ostream>
#include <stdexcept>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/progress.hpp>
#include <bevel/analysis/diagnose/read_case.hpp>
#include <bevel/analysis/diagnose/report.hpp>
#include <bevel/analysis/diagnose/result_files.hpp>
#include <bevel/analysis/diagnose/steered.hpp>
#include <bevel/analysis/diagnose/verdict_json.hpp>
#include <bevel/cli/exit_status.hpp>
#include <bevel/diagnosis/mismatch/diagnose.hpp>
#include <bevel/diagnosis/mismatch/effect_source.hpp>
#include <bevel/diagnosis/statistics/quantiles.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/io/sha256.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace): the tool speaks of nothing else

namespace {

void print_parameter(std::ostream& out, const FoundParameter& p, const std::string& log) {
  out << "    " << in_words(p.name) << (log.empty() ? "" : " in " + log) << ": " << with_error(p.value, p.std_error)
      << ", 95 % " << interval(p.ci95) << (p.at_bound ? ", at its bound" : "") << '\n';
}

// What a fitted needle says of itself that nobody should take on trust.
std::vector<std::string> remarks_on_needle(const Findings& f) {
  if (f.two_groups) return {};
  const NeedleEstimate& n = f.needle;
  std::vector<std::string> remarks;
  const std::string k = with_error(n.value.curvature_per_mm, n.curvature_sd_per_mm) + " 1/mm";
  if (std::abs(n.value.curvature_per_mm) < k95 * n.curvature_sd_per_mm)
    remarks.push_back("k " + k +
                      ": its 95 % interval holds zero, so these recordings do not say to which side the "
                      "needle bends. Record insertions in which the base does not turn.");
  else if (n.value.curvature_per_mm * f.model_file.curvature_per_mm < 0)
    remarks.push_back("k " + k + " has the other sign than in the model file, " +
                      number(f.model_file.curvature_per_mm) +
                      " 1/mm: the bevel faces the other way than the model file has it (a roll of pi at the start), or "
                      "these recordings hardly show it. Do not steer by model.toml before that is known.");
  return remarks;
}

}  // namespace

std::string usage_fault(const DiagnoseOptions& options) {
  if (options.baseline.empty() != options.changed.empty()) return "--baseline and --changed: one needs the other";
  if (options.changed.empty() == options.logs.empty())
    return "recordings are given either as LOG..., or in two groups by --baseline and --changed";
  return "";
}

Found find(const DiagnoseOptions& options, std::ostream& err) {
  DiagnosisProgress progress(options.quiet ? nullptr : stderr);
  io::ModelFile model = io::load_model_file(options.model_path);
  const auto logs = io::find_logs(options.logs);  // folders among them
  progress.say(options.changed.empty()
                   ? "reading " + std::to_string(logs.size()) + (logs.size() == 1 ? " log" : " logs")
                   : "reading two groups of logs");
  ReadCase input = options.changed.empty() ? read_case(logs) : read_groups(options.baseline, options.changed);
  for (const auto& remark : input.remarks) err << remark << std::endl;  // before the minutes of work
  const double reading_s = progress.seconds();
  DiagnosisOptions how;
  how.threads = options.threads;
  how.known.elsewhere = io::active_effects(model, "");
  for (const auto& recording : input.recorded.recordings)
    how.known.in_recording.push_back(io::active_effects(model, recording.name));
  how.progress = [&](const std::string& text) { progress.say(text); };
  Findings findings = diagnosis::diagnose(input.recorded, model.needle, how);
  const double diagnosed_s = progress.seconds();
  if (options.targets > 0 && !findings.two_groups && adopts_a_model(findings.verdict))
    progress.say("steering to targets");
  steer_to_targets(input.recorded, model, model_of(findings, model), {options.targets, options.threads}, findings);
  if (findings.steered) findings.times.push_back({"steering to targets", progress.seconds() - diagnosed_s});
  findings.remarks.insert(findings.remarks.begin(), input.remarks.begin(), input.remarks.end());
  const auto on_needle = remarks_on_needle(findings);
  findings.remarks.insert(findings.remarks.end(), on_needle.begin(), on_needle.end());
  findings.times.insert(findings.times.begin(), {"reading the logs", reading_s});
  Provenance made_of{
      BEVEL_VERSION,
      {std::filesystem::path(options.model_path).filename().string(), io::sha256_of_file(options.model_path)},
      std::move(input.files)};
  return {std::move(findings), std::move(model), std::move(made_of), !input.remarks.empty()};
}

void print_verdict(std::ostream& out, const Findings& f) {
  out << headline_of(f.verdict, f.two_groups) << ": " << f.sentence << "\n\n";
  if (adopts_a_model(f.verdict))
    for (const std::string& reason : f.reasons) out << "  " << reason << '\n';
  for (const auto& effect : f.effects) {
    out << "  " << effect.name << "  probability " << probability(effect.probability)
        << (effect.ambiguous_with.empty() ? "" : ", or " + listed(effect.ambiguous_with, ", ")) << "; "
        << moved_in_words(effect.moved_at_depth_mm) << " at the deepest readings\n";
    for (const auto& p : effect.parameters) print_parameter(out, p, "");
    for (const auto& r : effect.recordings)
      for (const auto& p : r.parameters) print_parameter(out, p, r.log);
  }
  if (const ProposedForm* form = proposed_form(f)) {
    const ProposedForm& p = *form;
    out << (p.log_bayes_factor > 0 ? "  an equation that would do: "
                                   : "  the nearest of simple equations, less likely than the curve: ")
        << info_of(p.component).meaning << " by " << p.equation << ", x " << in_words(model::name_of(p.covariate))
        << "; a " << with_error(p.amplitude, p.amplitude_sd) << ' ' << unit_of(p.component, p.covariate) << ", s "
        << number(p.shape) << " (95 % " << number(p.shape_low) << " to " << number(p.shape_high)
        << "), log Bayes factor against all curves " << log_factor(p.log_bayes_factor) << "; as an effect, "
        << effect_source(p).name << ", in " << kProposedEffectFile << '\n';
  }
  const auto& n = f.needle;
  if (!f.two_groups)
    out << "  needle: k " << with_error(n.value.curvature_per_mm, n.curvature_sd_per_mm) << " 1/mm, lambda1 "
        << with_error(n.value.lambda1_per_rad, n.lambda1_sd_per_rad) << ", lambda2 "
        << with_error(n.value.lambda2, n.lambda2_sd)
        << (n.slip_determined ? "" : " (lambda is not determined: the shaft does not turn; as in the model file)")
        << '\n';
  const HeldOut& h = f.held_out;
  const std::string refitted = f.two_groups ? "by what both share " : "needle refitted ";
  const std::string found = f.two_groups ? "with the change " : "with what was found ";
  out << (f.two_groups ? "  rms error per axis of the second group's recordings, predicted from all others: "
                       : "  rms error per axis of recordings predicted from the others: as it stands " +
                             measured(h.as_it_stands.rmse_mm) + ", ")
      << refitted << measured(h.before.rmse_mm) << ", " << found << measured(h.after.rmse_mm) << ", noise alone "
      << measured(h.noise_floor.rmse_mm) << " mm; chi2 per reading, " << refitted << measured(h.before.chi2_per_dof)
      << ", " << found << measured(h.after.chi2_per_dof) << '\n';
  if (const auto moved = moved_at_depth(f); moved && !f.two_groups && adopts_a_model(f.verdict))
    out << "  what was found moves the tip at the deepest readings by " << measured(moved->from_refitted_mm, 2)
        << " mm (rms over recordings) beside the needle refitted, by " << measured(moved->from_file_mm, 2)
        << " mm from where the model file as it stands has it\n";
  for (const auto& one : f.discrepancies)
    out << "  the discrepancy of the " << info_of(one.curve.component).meaning
        << " moves the tip at the deepest readings by " << measured(one.moved_at_depth_mm, 2) << " mm\n";
  if (f.steered)
    out << "  steered in simulation to targets " << span_mm(*f.steered) << " deep: as it stands "
        << steered_in_words(f.steered->as_it_stands, f.steered->targets) << "; with what was found "
        << steered_in_words(f.steered->found, f.steered->targets)
        << (f.steered->not_known_live.empty() ? ""
                                              : "; neither knows beforehand of " + listed(f.steered->not_known_live))
        << "; " << steering_advice(*f.steered) << '\n';
  if (!f.not_steered.empty()) out << "  not steered to a target in simulation: " << f.not_steered << '\n';
  out << "  insertions differ by (standard deviation):";
  for (const auto& v : f.variation) out << (&v == f.variation.data() ? " " : ", ") << variation_in_words(v);
  out << '\n';
  for (std::size_t i = 0; i < f.where.size() && i < 3; ++i)
    out << "  " << (i == 0 ? "begins to act: " : "               ") << f.where[i].log << " " << f.where[i].channel
        << ", " << number(f.where[i].from_s) << " to " << number(f.where[i].to_s) << " s\n";
  out << "  next experiment: "
      << (!is_experiment_needed(f) ? "none needed"
          : f.next_experiment      ? f.next_experiment->script + "; it separates " + f.next_experiment->separates[0] +
                                    " from " + f.next_experiment->separates[1]
                              : "no motion that was simulated separates the explanations")
      << '\n';
  if (const auto unseen = not_to_be_seen(f); !unseen.empty())
    out << "  not to be seen in these recordings at its usual size: " << listed(unseen, ", ")
        << "; the page says which motions would show it\n";
  if (!f.checks.clean) out << "  " << what_is_left(f.checks) << '\n';
  for (const auto& remark : f.remarks) out << "  - " << remark << '\n';
}

std::vector<ResultFile> result_files(const Findings& findings, const io::ModelFile& augmented,
                                     const Provenance& made_of) {
  ResultFile effect{kProposedEffectFile, {}};
  if (auto proposed = proposed_effect(findings)) effect.text = std::move(proposed->text);
  return {{"report.html", report_html(findings, made_of)},
          {"model.toml", io::to_toml(augmented)},
          std::move(effect),
          {"verdict.json", verdict_json(findings, made_of)}};
}

std::string result_names(const Findings& findings) {
  const std::string always = "verdict.json, report.html, model.toml";
  return proposed_effect(findings) ? always + ", " + kProposedEffectFile : always;
}

int run(const DiagnoseOptions& options, std::ostream& out, std::ostream& err) {
  check_writable(options.out_folder);
  const Found found = find(options, err);
  const Findings& findings = found.findings;
  write_together(options.out_folder, result_files(findings, model_of(findings, found.model), found.made_of));
  print_verdict(out, findings);
  out << "\nwritten: " << options.out_folder << "/" << result_names(findings) << '\n';
  return found.input_damaged ? cli::kDamagedInput : cli::kOk;
}

}  // namespace bevel::analysis
