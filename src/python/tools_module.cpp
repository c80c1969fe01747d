// The extension module `_doppel_tools`: descriptions in other formats and clients of running twins, by
// libdoppel_tools.so.
#include <pybind11/stl.h>

#include "doppel/review/conversion/mjcf_export.h"
#include "doppel/review/conversion/sdf.h"
#include "doppel/review/conversion/urdf.h"
#include "python/conversions.h"
#include "python/described_model.h"
#include "python/tools_bindings.h"

namespace doppel::python {
namespace {

enum class Format { urdf, mjcf, sdf };

// The document, and what it cannot express. `folder`: where it is to stand; meshes are named relative to
// it, and those that the other tool cannot read are written there if `write_meshes`.
py::tuple convert(const DescribedModel& self, Format format, const std::string& folder, bool write_meshes) {
  std::string text;
  Diagnostics diagnostics;
  {
    const py::gil_scoped_release released;
    MeshPlacement placement;
    placement.out_folder = std::filesystem::absolute(folder);
    MeshFiles meshes(placement);
    if (format == Format::urdf) {
      text = to_urdf(*self.robot, meshes);
    } else {
      text = format == Format::mjcf ? to_mjcf(*self.robot, *self.model, meshes, diagnostics)
                                    : to_sdf(*self.robot, *self.model, meshes, diagnostics);
    }
    if (write_meshes) meshes.write();
  }
  return py::make_tuple(text, to_list(diagnostics.all()));
}

}  // namespace
}  // namespace doppel::python

PYBIND11_MODULE(_doppel_tools, module) {
  doppel::python::bind_client(module);
  using doppel::python::convert;
  using doppel::python::DescribedModel;
  using doppel::python::Format;
  module.def("to_urdf", [](const DescribedModel& self, const std::string& folder, bool write_meshes) {
    return convert(self, Format::urdf, folder, write_meshes);
  });
  module.def("to_mjcf", [](const DescribedModel& self, const std::string& folder, bool write_meshes) {
    return convert(self, Format::mjcf, folder, write_meshes);
  });
  module.def("to_sdf", [](const DescribedModel& self, const std::string& folder, bool write_meshes) {
    return convert(self, Format::sdf, folder, write_meshes);
  });
}
