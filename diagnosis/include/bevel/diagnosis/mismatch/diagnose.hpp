// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Identifies physics that a needle model lacks, from recorded insertions. All results follow from one posterior
/// (diagnosis/src/inference). They are deterministic and do not depend on the number of threads.
#include <functional>

#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>

namespace bevel::diagnosis {

/// Options of diagnose().
struct DiagnosisOptions {
  int threads = 2;              ///< number of threads
  std::size_t largest_set = 3;  ///< largest number of effects in a candidate model
  KnownPhysics known{};         ///< effects that the nominal model has in addition to its needle
  /// Progress callback, called before each stage and each candidate model with one clause of text. An exception that
  /// it throws stops the diagnosis. May be empty.
  std::function<void(const std::string&)> progress;
};

/// Computes the verdict on the physics that a model lacks, with its evidence.
/// @param recorded recordings of one rig (make_case())
/// @param model parameters of the nominal model
/// @param options threads, size of the candidate models, known physics and progress callback
/// @return verdict, effects, cross-validation and all other results; Findings::steered is empty
/// @throws bevel::ArgumentError with one sentence if the input cannot be diagnosed, for example if the nominal model
///   leaves the domain of the slip law along a recording
Findings diagnose(const RecordedCase& recorded, const model::NeedleParameters& model, const DiagnosisOptions& options);

}  // namespace bevel::diagnosis
