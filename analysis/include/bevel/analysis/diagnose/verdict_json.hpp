// SPDX-License-Identifier: MIT
// verdict.json. Its keys are a contract (docs/verdict.schema.json); figures that are not finite become null.
#pragma once

#include <string>

#include <bevel/analysis/diagnose/provenance.hpp>
#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::analysis {

// Where the source of the proposed effect stands, if there is one.
inline constexpr const char* kProposedEffectFile = "proposed_effect.cpp";

std::string verdict_json(const diagnosis::Findings& findings, const Provenance& made_of = {});

// What was found, beside what the model in use had already, as a model that the rig, the estimator and bevel-predict
// accept. Of an unknown effect it carries the discrepancy: a name is never invented.
io::ModelFile model_of(const diagnosis::Findings& findings, const io::ModelFile& in_use = {});

}  // namespace bevel::analysis
