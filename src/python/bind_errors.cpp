#include "doppel/base/core/diagnostic.h"
#include "python/bindings.h"
#include "python/conversions.h"

namespace doppel::python {

// The class is one of the package, so that its text can be read there.
void bind_errors(py::module_& /*module*/) {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      const py::object type = py::module_::import("doppel._errors").attr("InputError");
      const py::object raised = type(error.what(), to_list(error.diagnostics()));
      PyErr_SetObject(type.ptr(), raised.ptr());
    }
  });
}

}  // namespace doppel::python
