#pragma once
// Numbers as text in documents for other programs.

#include <Eigen/Core>
#include <string>

#include "doppel/export.h"

namespace doppel {

// The shortest decimal that reads back as the same number; "0" for -0.
DOPPEL_API std::string decimal(double value);
DOPPEL_API std::string decimals(const Eigen::Vector3d& v);  // separated by blanks

}  // namespace doppel
