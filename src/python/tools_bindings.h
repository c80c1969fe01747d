#pragma once
// The parts of the extension module `_doppel_tools`.

#include <pybind11/pybind11.h>

namespace doppel::python {

void bind_client(pybind11::module_& module);

}  // namespace doppel::python
