// SPDX-License-Identifier: MIT
#pragma once
// A trial on disk. What the tool may see is one folder; the truth is in another.
//
//   OUT/trials/t0000/case/{model.toml, rec01.lcm ... rec08.lcm}   what the tool is given
//   OUT/trials/t0000/commitment.json                              SHA-256 of salt and truth, and of every file of case/
//   OUT/sealed/t0000.json                                         salt and truth
// Everything is written under another name and renamed at the end, so what bears its name is whole.
#include <filesystem>
#include <string>

#include "proof/trial.hpp"

namespace bevel::proof {

namespace fs = std::filesystem;

std::string trial_name(int number);  // "t0007"
struct TrialFolders {
  TrialFolders(const fs::path& out, int number);
  fs::path trial, given, commitment, truth, tool_output, run, score;
};

void write_atomically(const fs::path& path, const std::string& text);  // throws IoError naming the file
std::string read_text(const fs::path& path);                           // throws IoError naming the file

std::string truth_json(const Truth& truth);
std::string model_file_text(const Truth& truth);
// Writes logs, model file, truth and commitment, the truth's seal last but one, the commitment last.
void write_trial(const fs::path& out, const Trial& trial);
// Draws and writes the trial unless it is there already. True if it was written now.
bool prepare_trial(const fs::path& out, std::uint64_t seed, int number, const Population& population);

// Checks the seal: throws IoError if the truth is not the one committed to. Returns the truth's text.
std::string open_truth(const TrialFolders& folders);

}  // namespace bevel::proof
