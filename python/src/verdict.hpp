#pragma once
/// \file
/// The result of a diagnosis, as bevel.Verdict holds it.
#include "diagnosis/mismatch/findings.hpp"
#include "io/model_file.hpp"
#include "tools/diagnose/provenance.hpp"

namespace bevel::python {

struct Verdict {
  diagnosis::Findings findings;
  io::ModelFile in_use;  ///< model that was diagnosed
  diagnose::Provenance made_of;
};

}  // namespace bevel::python
