// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Parts of the module bevel._core: each function registers the classes and functions of one source file.
#include <nanobind/nanobind.h>

namespace bevel::python {

void bind_errors(nanobind::module_& m);
void bind_model(nanobind::module_& m);
void bind_prediction(nanobind::module_& m);
void bind_recording(nanobind::module_& m);
void bind_estimator(nanobind::module_& m);
void bind_replay(nanobind::module_& m);
void bind_identification(nanobind::module_& m);
void bind_findings(nanobind::module_& m);
void bind_diagnosis(nanobind::module_& m);
void bind_rig(nanobind::module_& m);

/// Registers the wait for abandoned work at the exit of the interpreter (interruptible.hpp).
void bind_interruptible(nanobind::module_& m);

}  // namespace bevel::python
