#include "python/conversions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace doppel::python {
namespace {

constexpr double kRotationTolerance = 1e-6;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::string shape_of(const Numbers& numbers) {
  std::vector<py::ssize_t> shape(numbers.shape(), numbers.shape() + numbers.ndim());
  return fmt::format("[{}]", fmt::join(shape, ", "));
}

}  // namespace

py::dict to_dict(const Diagnostic& diagnostic) {
  py::dict out;
  out["severity"] = std::string(to_string(diagnostic.severity));
  out["rule"] = diagnostic.rule;
  out["message"] = diagnostic.message;
  const SourceLocation& where = diagnostic.where;
  out["file"] = where.known() ? py::object(py::str(*where.file)) : py::none();
  out["line"] = where.line > 0 ? py::object(py::int_(where.line)) : py::none();
  out["column"] = where.column > 0 ? py::object(py::int_(where.column)) : py::none();
  out["fix"] = diagnostic.fix;
  return out;
}

py::list to_list(const std::vector<Diagnostic>& diagnostics) {
  py::list out;
  for (const Diagnostic& diagnostic : diagnostics) out.append(to_dict(diagnostic));
  return out;
}

XacroArguments to_arguments(const py::dict& arguments) {
  XacroArguments out;
  for (const auto& [name, value] : arguments) {
    const std::string text = py::isinstance<py::bool_>(value) ? (value.cast<bool>() ? "true" : "false")
                                                              : std::string(py::str(value));
    out.emplace_back(py::str(name), text);
  }
  return out;
}

Eigen::VectorXd to_vector(const Numbers& numbers, Eigen::Index size, const std::string& what) {
  if (numbers.ndim() != 1 || numbers.shape(0) != size) {
    throw InputError("python.shape", {},
                     fmt::format("{} has the shape {}, and [{}] is needed", what, shape_of(numbers), size),
                     "pass one number for each, in the order of the model");
  }
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), size);
}

Numbers to_array(const Eigen::VectorXd& vector) {
  return Numbers(vector.size(), vector.data());
}

Numbers to_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Numbers out(std::vector<py::ssize_t>{matrix.rows(), matrix.cols()});
  Eigen::Map<RowMatrix>(out.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
  return out;
}

Pose to_pose(const Numbers& matrix, const std::string& what) {
  if (matrix.ndim() != 2 || matrix.shape(0) != 4 || matrix.shape(1) != 4) {
    throw InputError("python.shape", {},
                     fmt::format("{} has the shape {}, and [4, 4] is needed", what, shape_of(matrix)),
                     "pass a homogeneous transform, or a position [3]");
  }
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> all(matrix.data());
  Pose pose = Pose::Identity();
  pose.matrix() = all;
  const Eigen::Matrix3d R = pose.linear();
  const bool rotation = (R * R.transpose()).isIdentity(kRotationTolerance) && R.determinant() > 0;
  if (!rotation || (all.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > kRotationTolerance) {
    throw InputError("python.pose", {}, fmt::format("{} is no rotation and translation", what),
                     "its upper left 3x3 part is a rotation, its last row 0 0 0 1");
  }
  return pose;
}

void write_pose(const Pose& pose, double* out16) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{out16} = pose.matrix();
}

}  // namespace doppel::python
