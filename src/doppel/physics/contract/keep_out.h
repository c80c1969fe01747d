#pragma once
// The boxes of a world file that no robot may enter: for those who plan and permit motions. They are no
// part of the physics.

#include <filesystem>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/pose.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/export.h"

namespace doppel {

struct KeepOutBox {
  std::string name;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  // m, full side lengths
  Pose X_WB = Pose::Identity();
  SourceLocation source;
};

// `keep_out` of a world file. Throws InputError as load_world().
[[nodiscard]] DOPPEL_API std::vector<KeepOutBox> load_keep_out(const std::filesystem::path& file,
                                                               PackageResolver& resolver);

}  // namespace doppel
