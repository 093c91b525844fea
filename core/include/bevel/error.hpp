// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Exceptions of all modules. Functions on the control path (filter and control steps, drive cycles) throw no
/// exceptions; they return a status.
#include <stdexcept>

/// Steering of bevel-tip needles and diagnosis of unmodelled physics.
namespace bevel {

/// Base class of the exceptions that this project throws. what() states the place, the value found, the values allowed
/// and the remedy.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file or a message has content that its format does not allow.
class ParseError : public Error {
 public:
  using Error::Error;
};

/// A file, socket or process of the operating system cannot be used.
class IoError : public Error {
 public:
  using Error::Error;
};

/// A configuration file or an option has a value that is not allowed.
class ConfigurationError : public Error {
 public:
  using Error::Error;
};

/// A precondition on the arguments of a function does not hold.
class ArgumentError : public Error {
 public:
  using Error::Error;
};

/// A computation leaves the domain of its model, for example that of the slip law (Eq. 25), or data do not determine
/// it.
class DomainError : public Error {
 public:
  using Error::Error;
};

/// A camera, CAN bus or drive does not work as required.
class DeviceError : public Error {
 public:
  using Error::Error;
};

}  // namespace bevel
