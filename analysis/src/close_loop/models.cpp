// SPDX-License-Identifier: MIT
#include <bevel/analysis/close_loop/models.hpp>

#include <algorithm>
#include <filesystem>

#include <bevel/error.hpp>

namespace bevel::analysis {
namespace fs = std::filesystem;

CaseFiles find_case(const std::string& folder) {
  if (!fs::is_directory(folder))
    throw IoError(folder + ": no such folder; a case is a folder with model.toml and rec*.lcm");
  CaseFiles files;
  files.name = fs::weakly_canonical(folder).filename().string();
  files.model_path = (fs::path(folder) / "model.toml").string();
  if (!fs::exists(files.model_path)) throw IoError(folder + ": holds no model.toml");
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".lcm" && entry.path().filename().string().starts_with("rec"))
      files.logs.push_back(entry.path().string());
  if (files.logs.empty()) throw IoError(folder + ": holds no recording (rec*.lcm)");
  std::sort(files.logs.begin(), files.logs.end());
  return files;
}

diagnosis::RecordedCase without_outliers(const diagnosis::RecordedCase& recorded, const diagnosis::Findings& findings) {
  std::vector<std::vector<std::size_t>> outliers(recorded.recordings.size());
  for (std::size_t r = 0; r < outliers.size(); ++r) {
    const auto trace = std::find_if(findings.traces.begin(), findings.traces.end(),
                                    [&](const auto& t) { return t.log == recorded.recordings[r].name; });
    if (trace == findings.traces.end()) continue;
    for (std::size_t i = 0; i < trace->outlier.size(); ++i)
      if (trace->outlier[i] != 0) outliers[r].push_back(i);
  }
  diagnosis::RecordedCase out = recorded;
  for (std::size_t r = 0; r < out.recordings.size(); ++r) {
    inference::Dataset one;
    one.recordings.resize(1);
    one.recordings[0].series = std::move(out.recordings[r].series);
    out.recordings[r].series = inference::without(one, {outliers[r]}).recordings[0].series;
  }
  return out;
}

}  // namespace bevel::analysis
