// SPDX-License-Identifier: MIT
#include <nanobind/stl/filesystem.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include <bevel/analysis/diagnose/diagnose_tool.hpp>
#include <bevel/analysis/diagnose/read_case.hpp>
#include <bevel/analysis/diagnose/report.hpp>
#include <bevel/analysis/diagnose/result_files.hpp>
#include <bevel/analysis/diagnose/steered.hpp>
#include <bevel/analysis/diagnose/verdict_json.hpp>
#include <bevel/diagnosis/mismatch/diagnose.hpp>
#include <bevel/io/file_bytes.hpp>
#include <bevel/io/recording_clock.hpp>
#include "arrays.hpp"
#include "interruptible.hpp"
#include "io_error.hpp"
#include "module.hpp"
#include "recording.hpp"
#include "verdict.hpp"

namespace bevel::python {
namespace {

namespace fs = std::filesystem;
using diagnosis::Findings;

struct Question {
  std::vector<Recording> recordings, changed;
  io::ModelFile model;
  int threads = 2, targets = 0;
};

Verdict run(const Question& question, Task& task) {
  std::vector<std::string> remarks;
  std::vector<diagnosis::RawRecording> raw;
  Verdict out;
  out.made_of.version = BEVEL_VERSION;
  out.made_of.model.name = "model";
  const bool two_groups = !question.changed.empty();
  const auto take = [&](const Recording& recording, const std::string& group, bool changed) {
    const std::string name = group + recording.name;
    if (const std::string remark = analysis::judge_damage(name, *recording.data); !remark.empty())
      remarks.push_back(remark);
    raw.push_back({.name = name,
                   .actuators = recording.data->actuators,
                   .tips = recording.data->tips,
                   .headings = recording.data->headings,
                   .has_clock = io::has_clock(*recording.data),
                   .changed = changed});
    out.made_of.recordings.push_back({name, ""});
  };
  for (const Recording& recording : question.recordings) take(recording, two_groups ? "baseline/" : "", false);
  for (const Recording& recording : question.changed) take(recording, "changed/", true);
  const diagnosis::RecordedCase recorded = diagnosis::make_case(std::move(raw));
  diagnosis::DiagnosisOptions options;
  options.threads = question.threads;
  options.known.elsewhere = io::active_effects(question.model, "");
  for (const auto& recording : recorded.recordings)
    options.known.in_recording.push_back(io::active_effects(question.model, recording.name));
  options.progress = [&task](const std::string& text) { task.report(text); };
  out.findings = diagnosis::diagnose(recorded, question.model.needle, options);
  if (question.targets > 0) {
    task.report("steering to targets");
    analysis::steer_to_targets(recorded, question.model, analysis::model_of(out.findings, question.model),
                               {question.targets, question.threads}, out.findings);
  }
  out.findings.remarks.insert(out.findings.remarks.begin(), remarks.begin(), remarks.end());
  out.in_use = question.model;
  return out;
}

// A recording is known by its name: in the verdict, and for values of single recordings in the model.
void require_distinct_names(const std::vector<Recording>& recordings) {
  std::vector<std::string> names;
  for (const Recording& recording : recordings) names.push_back(recording.name);
  std::ranges::sort(names);
  if (const auto twice = std::ranges::adjacent_find(names); twice != names.end())
    throw ArgumentError("two recordings have the name \"" + *twice + "\"; give each its own by named()");
}

Verdict diagnose_recordings(std::vector<Recording> recordings, const io::ModelFile& model,
                            std::vector<Recording> changed, int threads, int targets, nb::object progress) {
  constexpr int kMostThreads = 256, kMostTargets = 1000;
  if (threads < 1 || threads > kMostThreads)
    throw ArgumentError("threads is " + std::to_string(threads) + "; allowed: 1 to 256");
  if (targets < 0 || targets > kMostTargets)
    throw ArgumentError("targets is " + std::to_string(targets) + "; allowed: 0 to 1000");
  require_distinct_names(recordings);
  require_distinct_names(changed);
  return compute_interruptible([question = Question{std::move(recordings), std::move(changed), model, threads,
                                                    targets}](Task& task) { return run(question, task); },
                               std::move(progress));
}

std::string json_of(const Verdict& v) { return analysis::verdict_json(v.findings, v.made_of); }
io::ModelFile model_of(const Verdict& v) { return analysis::model_of(v.findings, v.in_use); }

void save(const Verdict& v, const fs::path& folder) {
  const nb::gil_scoped_release release;
  with_io_errors([&] {
    analysis::check_writable(folder);
    analysis::write_together(folder, analysis::result_files(v.findings, model_of(v), v.made_of));
  });
}

}  // namespace

void bind_diagnosis(nb::module_& m) {
  const auto part = [](auto Findings::*member) { return [member](const Verdict& v) { return v.findings.*member; }; };
  nb::class_<Verdict>(m, "Verdict", "Result of diagnose(): which physics the model leaves out, and how sure that is.")
      .def_prop_ro(
          "verdict", [](const Verdict& v) { return diagnosis::name_of(v.findings.verdict, v.findings.two_groups); },
          "'nothing-missing', 'effects-found', 'unknown-effect' or 'inconclusive'; for two groups 'unchanged', "
          "'changed', 'changed-unknown' or 'inconclusive'.")
      .def_prop_ro("sentence", part(&Findings::sentence), "Summary of the verdict, a sentence.")
      .def_prop_ro("probability", part(&Findings::probability), "Posterior probability of the verdict.")
      .def_prop_ro("reasons", part(&Findings::reasons), "Why likely effects are not named, or nothing is concluded.")
      .def_prop_ro("effects", part(&Findings::effects), "Effects that were found.")
      .def_prop_ro("explanations", part(&Findings::explanations), "Candidate models, the most probable first.")
      .def_prop_ro("tried", part(&Findings::tried), "Effects compared one by one, best first.")
      .def_prop_ro("detectable", part(&Findings::detectable), "Smallest sizes that these recordings would show.")
      .def_prop_ro("variation", part(&Findings::variation), "Standard deviations between insertions.")
      .def_prop_ro("held_out", part(&Findings::held_out), "Recordings predicted from the others.")
      .def_prop_ro("needle_before", part(&Findings::base), "Needle refitted without effects.")
      .def_prop_ro("needle", part(&Findings::needle), "Needle refitted with the effects that were found.")
      .def_prop_ro("next_experiment", part(&Findings::next_experiment), "Motion that would decide; None: not needed.")
      .def_prop_ro("remarks", part(&Findings::remarks),
                   "Remarks: damaged input, and effects that cannot be distinguished.")
      .def_prop_ro("nothing_probability", part(&Findings::nothing_probability),
                   "Posterior probability that nothing is missing.")
      .def_prop_ro("model", &model_of, "The model in use, with the effects that the verdict names.")
      .def("to_json", &json_of, "Returns the text of verdict.json (docs/verdict.schema.json).")
      .def(
          "to_dict", [](const Verdict& v) { return nb::module_::import_("json").attr("loads")(json_of(v)); },
          nb::sig("def to_dict(self) -> dict[str, typing.Any]"), "Returns the content of verdict.json.")
      .def(
          "report_html", [](const Verdict& v) { return analysis::report_html(v.findings, v.made_of); },
          "Returns the report, one HTML page that needs no network.")
      .def("save", &save, "folder"_a, "Writes verdict.json, report.html and model.toml into a folder.")
      .def("__repr__", [](const Verdict& v) {
        return "<Verdict '" + std::string(diagnosis::name_of(v.findings.verdict, v.findings.two_groups)) +
               "': " + v.findings.sentence + ">";
      });
  m.def("diagnose", &diagnose_recordings, "recordings"_a, "model"_a, nb::kw_only(),
        "changed"_a = std::vector<Recording>{}, "threads"_a = 2, "targets"_a = 0, "progress"_a = nb::none(),
        nb::sig("def diagnose(recordings: collections.abc.Sequence[Recording], model: Model | Needle, *, "
                "changed: collections.abc.Sequence[Recording] = (), threads: int = 2, targets: int = 0, "
                "progress: collections.abc.Callable[[str], object] | None = None) -> Verdict"),
        "Identifies physics that the model leaves out.\n\n"
        "Args:\n"
        "    recordings: at least two insertions on one rig, with different names.\n"
        "    model: the model in use.\n"
        "    changed: insertions after a change; the verdict is then on what differs from `recordings`.\n"
        "    threads: number of threads; the verdict does not depend on it.\n"
        "    targets: number of simulated targets that are steered to with both models; 0: none.\n"
        "    progress: called on this thread with a line of text between stages. An exception in it ends the "
        "diagnosis.\n\n"
        "Raises:\n"
        "    ValueError: the recordings cannot be diagnosed together.\n"
        "    Error: a recording is damaged beyond use.\n"
        "    KeyboardInterrupt: Ctrl-C was pressed.");
}

}  // namespace bevel::python
