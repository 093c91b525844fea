// SPDX-License-Identifier: MIT
#include <nanobind/nanobind.h>

#include <stdexcept>
#include <string>

#include <bevel/error.hpp>
#include "module.hpp"

namespace bevel::python {
namespace nb = nanobind;
namespace {

struct Types {
  PyObject* error = nullptr;
  PyObject* configuration = nullptr;
  PyObject* io = nullptr;
  PyObject* argument = nullptr;
  PyObject* domain = nullptr;
};

// Kept for the life of the process: translators run until the interpreter ends.
Types& types() {
  static Types all;
  return all;
}

PyObject* make(nb::module_& m, const char* name, const char* doc, nb::handle bases) {
  const std::string full = std::string("bevel._core.") + name;
  PyObject* type = PyErr_NewExceptionWithDoc(full.c_str(), doc, bases.ptr(), nullptr);
  if (type == nullptr) throw nb::python_error();
  m.attr(name) = nb::handle(type);
  return type;
}

void translate(const std::exception_ptr& thrown, void*) {
  const Types& type = types();
  try {
    std::rethrow_exception(thrown);
  } catch (const ConfigurationError& e) {
    PyErr_SetString(type.configuration, e.what());
  } catch (const IoError& e) {
    PyErr_SetString(type.io, e.what());
  } catch (const ParseError& e) {
    PyErr_SetString(type.io, e.what());
  } catch (const ArgumentError& e) {
    PyErr_SetString(type.argument, e.what());
  } catch (const DomainError& e) {
    PyErr_SetString(type.domain, e.what());
  } catch (const std::runtime_error& e) {
    PyErr_SetString(type.error, e.what());
  }
}

}  // namespace

void bind_errors(nb::module_& m) {
  Types& type = types();
  type.error = make(m, "Error", "Base class of the errors that bevel reports.", PyExc_RuntimeError);
  type.configuration = make(m, "ConfigurationError",
                            "A TOML file has missing, unknown or invalid keys. The message lists every fault, one a "
                            "line, each with file and line.",
                            type.error);
  type.io = make(m, "IoError", "A file cannot be read or written, or its content cannot be used.", type.error);
  type.argument = make(m, "ArgumentError", "An argument has a value that is not allowed.",
                       nb::make_tuple(nb::handle(type.error), nb::handle(PyExc_ValueError)));
  type.domain = make(m, "DomainError", "The needle leaves the domain of the slip model (Eq. 25).",
                     nb::make_tuple(nb::handle(type.error), nb::handle(PyExc_ValueError)));
  nb::register_exception_translator(translate);
}

}  // namespace bevel::python
