#pragma once
// The parts of the extension module `_doppel`.

#include <pybind11/pybind11.h>

namespace doppel::python {

// doppel.InputError for doppel::InputError, in this module and in those that are loaded later.
void bind_errors(pybind11::module_& module);
void bind_model(pybind11::module_& module);
void bind_twin(pybind11::module_& module);
void bind_rollout(pybind11::module_& module);

}  // namespace doppel::python
