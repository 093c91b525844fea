// SPDX-License-Identifier: MIT
#include "module.hpp"

namespace bevel::python {
namespace {

constexpr const char* kDoc =
    "Compiled part of the package bevel.\n\n"
    "Units are mm, s and rad. Positions are in frame {A}: right-handed, origin at the entry point, z into the tissue.";

}  // namespace
}  // namespace bevel::python

NB_MODULE(_core, m) {
  using namespace bevel::python;  // NOLINT(google-build-using-namespace): the macro opens the scope
  m.doc() = kDoc;
  m.attr("VERSION") = BEVEL_VERSION;
  bind_errors(m);
  bind_interruptible(m);
  bind_model(m);
  bind_recording(m);
  bind_prediction(m);
  bind_estimator(m);
  bind_replay(m);
  bind_identification(m);
  bind_findings(m);
  bind_diagnosis(m);
  bind_rig(m);
}
