// SPDX-License-Identifier: MIT
#include <bevel/analysis/diagnose/verdict_json.hpp>

#include <cmath>
#include <nlohmann/json.hpp>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/diagnosis/mismatch/effect_source.hpp>
#include <bevel/model/effects/effect.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace): the tool speaks of nothing else
// Keys in the order in which they are read.
using json = nlohmann::ordered_json;

namespace {

json figure(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json figures(const std::vector<double>& values) {
  json list = json::array();
  for (const double v : values) list.push_back(figure(v));
  return list;
}

json as_json(const std::vector<FoundParameter>& parameters) {
  json all = json::object();
  for (const auto& p : parameters)
    all[p.name] = {{"value", figure(p.value)},
                   {"std_error", figure(p.std_error)},
                   {"ci95", {figure(p.ci95[0]), figure(p.ci95[1])}},
                   {"at_bound", p.at_bound},
                   {"none", figure(p.none)}};
  return all;
}

json as_json(const FoundEffect& effect) {
  json one = {{"name", effect.name},
              {"probability", figure(effect.probability)},
              {"joint_probability", figure(effect.joint_probability)},
              {"ambiguous_with", effect.ambiguous_with},
              {"parameters", as_json(effect.parameters)}};
  for (const auto& r : effect.recordings) one["recordings"][r.log] = as_json(r.parameters);
  one["meaning"] = effect.meaning;
  one["log_bayes_factor"] = figure(effect.log_bayes_factor);
  one["visible_sigmas"] = figure(effect.visible_sigmas);
  one["moved_at_depth_mm"] = figure(effect.moved_at_depth_mm);
  return one;
}

json as_json(const Location& w) {
  return {{"log", w.log},
          {"channel", w.channel},
          {"from_s", figure(w.from_s)},
          {"to_s", figure(w.to_s)},
          {"covariate", w.covariate},
          {"range", {figure(w.range[0]), figure(w.range[1])}},
          {"share", figure(w.share)}};
}

json as_json(const FitFigures& f) {
  return {{"rmse_mm", figure(f.rmse_mm)},         {"rmse_std_error_mm", figure(f.rmse_se_mm)},
          {"max_mm", figure(f.max_mm)},           {"chi2_per_dof", figure(f.chi2_per_dof)},
          {"log_density", figure(f.log_density)}, {"log_density_std_error", figure(f.log_density_se)}};
}

json as_json(const PredictionFigures& f, const Findings& of) {
  json channels = json::object();
  for (std::size_t c = 0; c < f.channels.size(); ++c)
    channels[of.channels[c]] = {{"rmse", figure(f.channels[c].rmse)},
                                {"unit", of.units[c]},
                                {"share_in_95", figure(f.channels[c].share_in_95)}};
  return {{"readings", f.readings},
          {"rmse_mm", figure(f.rmse_mm)},
          {"log_density", figure(f.log_density)},
          {"share_in_95", figure(f.share_in_95)},
          {"channels", channels}};
}

json as_json(const InsertionPredicted& p, const Findings& of) {
  return {{"new_insertion", as_json(p.whole, of)},
          {"beyond_first_third", {{"new_insertion", as_json(p.beyond, of)}, {"continued", as_json(p.continued, of)}}}};
}

json as_json(const HeldOut& held_out, const Findings& of) {
  json fit = {{"held_out", "leave-one-recording-out"},
              {"as_it_stands", as_json(held_out.as_it_stands)},
              {"before", as_json(held_out.before)},
              {"after", as_json(held_out.after)},
              {"noise_floor", as_json(held_out.noise_floor)},
              {"gain", figure(held_out.gain)},
              {"predicted",
               {{"before", as_json(held_out.predicted_before, of)}, {"after", as_json(held_out.predicted_after, of)}}},
              {"recordings", json::object()}};
  for (const auto& r : held_out.recordings)
    fit["recordings"][r.log] = {
        {"before", as_json(r.before)},
        {"after", as_json(r.after)},
        {"predicted", {{"before", as_json(r.predicted_before, of)}, {"after", as_json(r.predicted_after, of)}}}};
  return fit;
}

json as_json(const NeedleEstimate& n) {
  return {{"curvature_per_mm", {{"value", n.value.curvature_per_mm}, {"std_error", figure(n.curvature_sd_per_mm)}}},
          {"lambda1_per_rad", {{"value", n.value.lambda1_per_rad}, {"std_error", figure(n.lambda1_sd_per_rad)}}},
          {"lambda2", {{"value", n.value.lambda2}, {"std_error", figure(n.lambda2_sd)}}},
          {"slip_determined", n.slip_determined},
          {"wheelbase_mm", n.value.wheelbase_mm}};
}

json as_json(const std::vector<TriedEffect>& tried) {
  json all = json::array();
  for (const auto& t : tried) {
    json parameters = json::object();
    for (const auto& [name, value] : t.parameters) parameters[name] = figure(value);
    all.push_back({{"name", t.name},
                   {"beside", t.beside},
                   {"log_bayes_factor", t.log_bayes_factor ? figure(*t.log_bayes_factor) : json(nullptr)},
                   {"with_discrepancy", t.with_discrepancy},
                   {"fitted", t.fitted},
                   {"likelier", t.likelier},
                   {"parameters", parameters}});
  }
  return all;
}

json detectable_json(const std::vector<DetectableSize>& sizes) {
  json all = json::object();
  for (const auto& d : sizes) all[d.effect][d.parameter] = figure(d.size);
  return all;
}

json absorption_json(const std::vector<DetectableSize>& sizes) {
  json all = json::object();
  for (const auto& d : sizes) {
    all[d.effect][d.parameter] = {{"absorbed", figure(d.absorbed)}, {"typical", figure(d.typical)}};
    if (!d.experiment.empty()) all[d.effect][d.parameter]["experiment"] = d.experiment;
  }
  return all;
}

json as_json(const std::vector<Discrepancy>& discrepancies) {
  json all = json::array();
  for (const auto& d : discrepancies)
    all.push_back({{"component", info_of(d.curve.component).name},
                   {"meaning", info_of(d.curve.component).meaning},
                   {"unit", unit_of(d.curve.component, d.curve.covariate)},
                   {"covariate", model::name_of(d.curve.covariate)},
                   {"periodic", d.curve.periodic},
                   {"at", figures(d.curve.at)},
                   {"values", figures(d.curve.values)},
                   {"std_errors", figures(d.curve.std_errors)},
                   {"log_bayes_factor", figure(d.log_bayes_factor)},
                   {"visible_size", figure(d.visible_size)},
                   {"moved_at_depth_mm", figure(d.moved_at_depth_mm)}});
  return all;
}

json as_json(const std::vector<ProposedForm>& proposals) {
  json all = json::array();
  for (const auto& p : proposals)
    all.push_back({{"discrepancy", p.discrepancy},
                   {"component", info_of(p.component).name},
                   {"unit", unit_of(p.component, p.covariate)},
                   {"covariate", model::name_of(p.covariate)},
                   {"form", name_of(p.form)},
                   {"equation", p.equation},
                   {"a", {{"value", figure(p.amplitude)}, {"std_error", figure(p.amplitude_sd)}}},
                   {"s", {{"value", figure(p.shape)}, {"range95", {figure(p.shape_low), figure(p.shape_high)}}}},
                   {"log_bayes_factor", figure(p.log_bayes_factor)}});
  return all;
}

json as_json(const std::optional<EffectSource>& proposed) {
  if (!proposed) return nullptr;
  return {{"name", proposed->name}, {"file", kProposedEffectFile}};
}

json as_json(const std::vector<Explanation>& explanations) {
  json all = json::array();
  for (const auto& e : explanations)
    all.push_back({{"effects", e.effects},
                   {"probability", figure(e.probability)},
                   {"with_discrepancy", figure(e.with_discrepancy)}});
  return all;
}

json as_json(const std::vector<VariationEstimate>& variation) {
  json all = json::object();
  for (const auto& v : variation)
    all[v.name] = {{"unit", v.unit},
                   {"standard_deviation", figure(v.sd)},
                   {"range95", {figure(v.low), figure(v.high)}},
                   {"at_end", v.at_end},
                   {"probability_of_none", figure(v.none)}};
  return all;
}

json as_json(const std::vector<InsertionValues>& insertions) {
  json all = json::object();
  for (const auto& insertion : insertions) {
    json& own = all[insertion.log] = json::object();
    for (const auto& v : insertion.values)
      own[v.name] = {{"value", figure(v.value)},
                     {"std_error", figure(v.std_error)},
                     {"ci95", {figure(v.ci95[0]), figure(v.ci95[1])}}};
  }
  return all;
}

json experiment_json(const Findings& f) {
  if (!is_experiment_needed(f)) return "none needed";
  if (!f.next_experiment) return nullptr;
  const NextExperiment& next = *f.next_experiment;
  return {{"script", next.script},
          {"separates", {next.separates[0], next.separates[1]}},
          {"expected_gain", figure(next.expected_gain)}};
}

json as_json(const SteeredFigures& s) {
  json stopped = json::array();
  for (const auto& one : s.stopped)
    stopped.push_back({{"reason", one.reason},
                       {"count", one.count},
                       {"value", {figure(one.value[0]), figure(one.value[1])}},
                       {"limit", one.limit > 0 ? figure(one.limit) : json()},
                       {"unit", one.unit},
                       {"depth_mm", {figure(one.depth_mm[0]), figure(one.depth_mm[1])}}});
  return {{"arrived", s.arrived},
          {"stopped", stopped},
          {"median_mm", figure(s.median_mm)},
          {"worst_mm", figure(s.worst_mm)},
          {"stopped_by", s.stopped_by}};
}

json steered_json(const Findings& f) {
  if (!f.not_steered.empty()) return {{"why_not", f.not_steered}};
  if (!f.steered) return nullptr;
  return {{"targets", f.steered->targets},
          {"seed", f.steered->seed},
          {"depth_mm", {figure(f.steered->depth_mm[0]), figure(f.steered->depth_mm[1])}},
          {"as_it_stands", as_json(f.steered->as_it_stands)},
          {"found", as_json(f.steered->found)},
          {"paired",
           {{"targets", f.steered->paired.targets},
            {"farther_mm", figure(f.steered->paired.farther_mm)},
            {"std_error_mm", figure(f.steered->paired.std_error_mm)}}},
          {"advice", name_of(steering_with(*f.steered))},
          {"not_known_live", f.steered->not_known_live}};
}

json confusion_json(const Findings& f) {
  json rows = json::array();
  for (Eigen::Index i = 0; i < f.confusion.rows(); ++i)
    rows.push_back(figures({f.confusion.row(i).begin(), f.confusion.row(i).end()}));
  return {{"names", f.confusion_names}, {"cosine", rows}};
}

json checks_json(const Checks& c) {
  return {{"chi2_per_dof", figure(c.chi2_per_dof)},
          {"band99", {figure(c.band[0]), figure(c.band[1])}},
          {"ljung_box_p", figure(c.ljung_box_p)},
          {"clean", c.clean}};
}

}  // namespace

std::string verdict_json(const Findings& f, const Provenance& made_of) {
  json j = {{"verdict", name_of(f.verdict, f.two_groups)},
            {"sentence", f.sentence},
            {"probability", figure(f.probability)},
            {"reasons", f.reasons},
            {"effects", json::array()}};
  if (f.two_groups) j["changes"] = json::array();
  for (const auto& effect : f.effects) j[f.two_groups ? "changes" : "effects"].push_back(as_json(effect));
  j["where"] = json::array();
  for (const auto& location : f.where) j["where"].push_back(as_json(location));
  j["noise"] = {{"sigma_mm", figures(f.noise.sigma)},
                {"ar1", figure(f.noise.ar1)},
                {"ar2", figure(f.noise.ar2)},
                {"tail_degrees", figure(f.noise.tails.degrees)},
                {"outlier_share", figure(f.noise.outlier_share)},
                {"channels", f.channels},
                {"units", f.units},
                {"frame_s", figure(f.noise.frame_s)}};
  for (std::size_t c = 0; c < f.scatter.size(); ++c)
    if (const auto& scatter = f.scatter[c]; scatter.length_mm > 0)
      j["noise"]["near_entry"][f.channels[c]] = {{"sd_factor", figure(scatter.sd_at_entry())},
                                                 {"length_mm", figure(scatter.length_mm)}};
  j["fit"] = as_json(f.held_out, f);
  j["detectable"] = detectable_json(f.detectable);
  j["next_experiment"] = experiment_json(f);
  if (!f.two_groups)  // else it is held by the common errors, not measured
    j["needle"] = {{"before", as_json(f.base)}, {"after", as_json(f.needle)}};
  j["steered"] = steered_json(f);
  j["posterior"] = {{"nothing_missing", figure(f.nothing_probability)},
                    {"discrepancy", figure(f.discrepancy_probability)},
                    {"discrepancy_visible_sigmas", figure(f.discrepancy_sigmas)},
                    {"not_fitted", figure(f.not_visited)},
                    {"explanations", as_json(f.explanations)}};
  j["variation"] = as_json(f.variation);
  j["insertions"] = as_json(f.insertions);
  j["discrepancies"] = as_json(f.discrepancies);
  j["proposals"] = as_json(f.proposals);
  j["proposed_effect"] = as_json(proposed_effect(f));
  j["checks"] = checks_json(f.checks);
  j["tried"] = as_json(f.tried);
  j["tried_beside"] = as_json(f.beside);
  j["absorption"] = absorption_json(f.detectable);
  j["confusion"] = confusion_json(f);
  j["remarks"] = f.remarks;
  j["measurements"] = {{"used", f.readings}, {"outliers", f.outliers}};
  if (!made_of.version.empty()) {
    json recordings = json::object();
    for (const auto& file : made_of.recordings) recordings[file.name] = file.sha256;
    j["made_of"] = {{"version", made_of.version},
                    {"model", {{"file", made_of.model.name}, {"sha256", made_of.model.sha256}}},
                    {"recordings_sha256", recordings}};
  }
  // Clock times are not here but on the page: the same input gives the same file, to the last bit.
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

namespace {

// A parameter of the needle, as it is in the second group of recordings.
void change(model::NeedleParameters& needle, const FoundEffect& changed) {
  const double by = changed.parameters.front().value;
  if (changed.name == "curvature_per_mm") needle.curvature_per_mm *= 1 + by;
  if (changed.name == "lambda1_per_rad") needle.lambda1_per_rad += by;
  if (changed.name == "lambda2") needle.lambda2 += by;
}

}  // namespace

io::ModelFile model_of(const Findings& findings, const io::ModelFile& in_use) {
  io::ModelFile model = in_use;  // what was known stays
  if (!findings.two_groups) model.needle = findings.needle.value;
  for (const auto& effect : findings.effects) {
    if (model::find_effect(effect.name) == nullptr) {
      change(model.needle, effect);
      continue;
    }
    io::EffectEntry entry{.name = effect.name};
    for (const auto& p : effect.parameters) entry.parameters[p.name] = p.value;
    for (const auto& r : effect.recordings)
      for (const auto& p : r.parameters) entry.recordings[r.log][p.name] = p.value;
    model.effects.push_back(entry);
  }
  for (const auto& discrepancy : findings.discrepancies)
    if (find_fault(discrepancy.curve).empty()) model.discrepancies.push_back(discrepancy.curve);
  const auto sd_of = [&](std::string_view name) {
    for (const auto& v : findings.variation)
      if (v.name == name) return v.sd;
    return 0.0;
  };
  model.variation = {.curvature_relative = sd_of("curvature"),
                     .entry_angle_rad = sd_of("entry_angle"),
                     .entry_point_mm = sd_of("entry_point"),
                     .roll_rad = sd_of("roll")};
  return model;
}

}  // namespace bevel::analysis
