#pragma once
// The version of a URDF, <robot version="1.2">, and what came with it. Source: urdfdom's README, "URDF
// Versioning" (urdfdom 6.0, April 2026): 1.1 has quat_xyzw of <origin> and <capsule>, 1.2 has the
// acceleration, deceleration and jerk of <limit>. ROS 2's parser ignores what is newer than the version that
// a file names.

#include <compare>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/pose.h"
#include "doppel/base/xml/xml.h"
#include "doppel/export.h"

namespace doppel {

struct UrdfVersion {
  int major_number = 1, minor_number = 0;
  auto operator<=>(const UrdfVersion&) const = default;
};
inline constexpr UrdfVersion kUrdf11{1, 1}, kUrdf12{1, 2};  // 1.2 is the newest one
DOPPEL_API std::string to_string(UrdfVersion version);      // "1.2"

// 1.0 without the attribute. A warning for text that is not of the form x.y, and for a version that does not
// exist; the element is then read as of the newest version.
DOPPEL_API UrdfVersion read_urdf_version(const XmlNode& robot, Diagnostics& diagnostics);

// The fixed-axis angles of `quat_xyzw`, which need not have length 1; nullopt if it is not four finite
// numbers, or their length is 0.
DOPPEL_API std::optional<Eigen::Vector3d> rpy_of_quaternion(std::string_view quat_xyzw);

// Collects the uses of what is newer than the version of the file, for one warning.
class DOPPEL_API NewerElements {
 public:
  void uses(std::string feature, UrdfVersion since, const SourceLocation& where);
  void report(UrdfVersion version, Diagnostics& diagnostics) const;

 private:
  struct Use {
    std::string feature;  // "quat_xyzw of <origin>"
    UrdfVersion since;
    SourceLocation where;  // of the first
    int count = 0;
  };
  std::vector<Use> uses_;
};

}  // namespace doppel
