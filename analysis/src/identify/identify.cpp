// SPDX-License-Identifier: MIT
#include <bevel/analysis/identify/identify.hpp>

#include <algorithm>
#include <filesystem>
#include <ostream>

#include <bevel/cli/exit_status.hpp>
#include <bevel/error.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/io/recording.hpp>
#include <bevel/io/result_file.hpp>
#include <bevel/io/second_insertion.hpp>

namespace bevel::analysis {

namespace fs = std::filesystem;
using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace): the tool speaks of nothing else

namespace {

FitOptions fit_options(const IdentifyOptions& options, const model::NeedleParameters& start) {
  FitOptions fit;
  fit.start = start;
  if (options.prior == "table1-agar") fit.priors = table_one_agar();
  if (options.prior == "table1-plastisol") fit.priors = table_one_plastisol();
  fit.fitted[kNeedleWheelbase] = options.fit_wheelbase;
  if (options.square_loss) fit.loss = Loss::square;
  fit.entry_sigma(kEntryTiltX) = fit.entry_sigma(kEntryTiltY) = options.entry_tilt_rad;
  fit.entry_sigma(kEntryRoll) = options.entry_roll_rad;
  fit.entry_sigma(kEntryOffsetX) = fit.entry_sigma(kEntryOffsetY) = options.entry_offset_mm;
  fit.entry_sigma(kLateEntry) = options.late_entry_mm;
  fit.fit_slip_in_plane = options.fit_slip_in_plane;
  return fit;
}

Insertion read_insertion(const std::string& path, const std::string& name, std::ostream& err,
                         std::vector<std::string>& faults) {
  io::Recording recording = io::read_recording(path);
  const std::string remarks = recording.remarks(path);
  if (!remarks.empty()) faults.push_back(remarks.substr(0, remarks.size() - 1));
  err << remarks;
  io::require_usable(path, recording);
  io::require_one_insertion(path, recording.actuators);
  const auto by_time = [](const auto& a, const auto& b) { return a.utime < b.utime; };
  std::stable_sort(recording.actuators.begin(), recording.actuators.end(), by_time);
  std::stable_sort(recording.tips.begin(), recording.tips.end(), by_time);
  return make_insertion(name, recording.actuators, recording.tips);
}

}  // namespace

Identification identify(const IdentifyOptions& options, std::ostream& err) {
  const io::ModelFile model = io::load_model_file(options.model_path);
  if (!model.effects.empty())
    throw ConfigurationError(options.model_path + ": has [[effect]] \"" + model.effects.front().name +
                             "\"; identification fits [needle] alone, bevel-diagnose fits effects");
  if (!model.discrepancies.empty())
    throw ConfigurationError(options.model_path + ": has [[discrepancy]] in \"" +
                             std::string(model::info_of(model.discrepancies.front().component).name) +
                             "\"; identification fits [needle] alone, bevel-diagnose fits discrepancies");
  if (model.variation)
    throw ConfigurationError(options.model_path +
                             ": has [variation]; identification takes all insertions for the same needle, "
                             "bevel-diagnose fits how they differ");
  Identification result;
  result.start = model.needle;
  result.method = options.method;
  result.prior = options.prior;
  const auto logs = io::find_logs(options.logs);
  const auto names = io::result_names(logs);
  for (std::size_t i = 0; i < logs.size(); ++i)
    result.insertions.push_back(read_insertion(logs[i], names[i], err, result.faults));

  const FitOptions fit = fit_options(options, model.needle);
  result.candidates = fit_candidates(result.insertions, fit);
  result.preferred = options.bicycle ? 0 : preferred(result.candidates);
  if (!result.candidates[result.preferred].possible)
    throw DomainError("bicycle: " + result.candidates[result.preferred].why);
  result.fit = result.candidates[result.preferred].fit;
  result.chosen = result.fit.needle;
  try {
    result.angle_rate = fit_angle_rate(result.insertions, model.needle);
  } catch (const ArgumentError& e) {
    result.angle_rate_refusal = e.what();
  }
  if (options.method == "angle-rate") {
    if (!result.angle_rate_refusal.empty()) throw DomainError(result.angle_rate_refusal);
    if (const auto violation = model::find_domain_violation(result.angle_rate.needle))
      throw DomainError("angle-rate fit leaves the model's domain: " + model::describe(*violation));
    result.chosen = result.angle_rate.needle;
  }
  try {
    result.before = error_figures(result.insertions, model.needle, Compare::same_insertion);
  } catch (const DomainError&) {  // the start need not be able to follow the data
  }
  const bool trajectory = options.method == "trajectory";
  result.after = error_figures(result.insertions, result.chosen, Compare::same_insertion,
                               trajectory ? result.fit.entries : std::vector<Entry>{});
  return result;
}

int run(const IdentifyOptions& options, std::ostream& out, std::ostream& err) {
  const Identification result = identify(options, err);
  print_table(out, result);
  if (!options.out_folder.empty()) {
    const fs::path folder(options.out_folder);
    fs::create_directories(folder);
    io::save_model_file({result.chosen, {}}, (folder / "model.toml").string());
    io::write_result_file((folder / "figures.json").string(), figures_json(result));
    save_report(result, (folder / "report.html").string());
    out << "\nwritten: " << (folder / "model.toml").string() << ", figures.json, report.html\n";
  }
  if (!result.fit.converged) return cli::kFailed;
  return result.faults.empty() ? cli::kOk : cli::kDamagedInput;
}

}  // namespace bevel::analysis
