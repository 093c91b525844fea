// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The result of a diagnosis, as bevel.Verdict holds it.
#include <bevel/analysis/diagnose/provenance.hpp>
#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::python {

struct Verdict {
  diagnosis::Findings findings;
  io::ModelFile in_use;  ///< model that was diagnosed
  analysis::Provenance made_of;
};

}  // namespace bevel::python
