#pragma once
/// \file
/// The exception that Python receives as bevel.IoError.
#include <stdexcept>

#include "io/config.hpp"

namespace bevel::python {

/// A file cannot be read or written, or its content cannot be used.
class IoError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Calls \p access and rethrows its std::runtime_error as IoError; a ConfigError passes unchanged.
template <class Access>
auto with_io_errors(Access&& access) {
  try {
    return access();
  } catch (const io::ConfigError&) {
    throw;
  } catch (const IoError&) {
    throw;
  } catch (const std::runtime_error& e) {
    throw IoError(e.what());
  }
}

}  // namespace bevel::python
