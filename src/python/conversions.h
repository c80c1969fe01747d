#pragma once
// Python's values from and to those of the library. All functions: with the interpreter's lock.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/pose.h"
#include "doppel/description/urdf/load.h"

namespace doppel::python {

namespace py = pybind11;
// Any sequence of numbers; other types than float64 are converted.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

py::dict to_dict(const Diagnostic& diagnostic);
py::list to_list(const std::vector<Diagnostic>& diagnostics);

// {"use_sim": True} as name := value; booleans are written as xacro reads them.
XacroArguments to_arguments(const py::dict& arguments);

// Throws InputError "python.shape" with both shapes unless `numbers` has `size` numbers in one dimension.
// `what`: "q".
Eigen::VectorXd to_vector(const Numbers& numbers, Eigen::Index size, const std::string& what);
Numbers to_array(const Eigen::VectorXd& vector);
Numbers to_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

// 4x4, row-major as NumPy prints it. Throws InputError "python.shape" unless it is a rotation and a
// translation.
Pose to_pose(const Numbers& matrix, const std::string& what);
void write_pose(const Pose& pose, double* out16);

}  // namespace doppel::python
