#include "doppel/base/math/decimals.h"

#include <fmt/format.h>

namespace doppel {

std::string decimal(double value) {
  return value == 0 ? "0" : fmt::format("{}", value);
}

std::string decimals(const Eigen::Vector3d& v) {
  return decimal(v.x()) + " " + decimal(v.y()) + " " + decimal(v.z());
}

}  // namespace doppel
