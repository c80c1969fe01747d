#pragma once
// Configurations of the machine's model.

#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/validation/checks/subject.h"

namespace doppel {

// The scalar joints that are no mimics, with their positions in rad or m.
[[nodiscard]] DOPPEL_API std::vector<std::pair<std::string, double>> posed_joints(const Model& model,
                                                                                  const Eigen::VectorXd& q);

// [nq] of Subject::model: where a twin of the machine starts.
[[nodiscard]] DOPPEL_API Eigen::VectorXd start_configuration(const Subject& subject);

}  // namespace doppel
