// SPDX-License-Identifier: MIT
#pragma once
// From recordings and a model in use to a verdict: what physics was left out. Everything follows from one posterior
// (diagnosis/src/inference); deterministic, whatever the number of threads.
#include <functional>

#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>

namespace bevel::diagnosis {

struct DiagnosisOptions {
  int threads = 2;
  std::size_t largest_set = 3;
  KnownPhysics known{};  // of the model in use, beside its needle
  // Called between stages with a sentence of progress; may throw to stop.
  std::function<void(const std::string&)> progress;
};

// `model` is what is in use. Throws ArgumentError with one sentence for input that cannot be diagnosed.
Findings diagnose(const RecordedCase& recorded, const model::NeedleParameters& model, const DiagnosisOptions& options);

}  // namespace bevel::diagnosis
