#pragma once
// Numbers as text in documents of other programs.

#include <Eigen/Core>
#include <string>

namespace doppel {

// The shortest decimal that reads back as the same number; "0" for -0.
std::string decimal(double value);
std::string decimals(const Eigen::Vector3d& v);  // with blanks between

}  // namespace doppel
