// The extension module `_doppel` of the package doppel (docs/python.md): models and twins. Writers of other
// formats are in _doppel_tools, which is loaded with the first of them.
#include "doppel/version.h"
#include "python/bindings.h"

PYBIND11_MODULE(_doppel, module) {
  module.attr("version") = doppel::version();
  doppel::python::bind_errors(module);
  doppel::python::bind_model(module);
  doppel::python::bind_twin(module);
  doppel::python::bind_rollout(module);
}
