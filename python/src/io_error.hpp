// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Errors of files as one type, which Python receives as bevel.IoError.
#include <stdexcept>

#include <bevel/error.hpp>

namespace bevel::python {

/// Calls \p access and rethrows its std::runtime_error as IoError; a ConfigurationError passes unchanged.
template <class Access>
auto with_io_errors(Access&& access) {
  try {
    return access();
  } catch (const ConfigurationError&) {
    throw;
  } catch (const IoError&) {
    throw;
  } catch (const std::runtime_error& e) {
    throw IoError(e.what());
  }
}

}  // namespace bevel::python
