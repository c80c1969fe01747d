#pragma once
// The files of a description package for an arm.

#include <string>
#include <vector>

#include "doppel/description/scaffold/arm_design.h"
#include "doppel/description/scaffold/package_name.h"
#include "doppel/export.h"

namespace doppel::scaffold {

struct PackageFile {
  std::string path, text;  // the path within the package: "urdf/my_arm.urdf.xacro"
};

struct PackageAuthor {
  std::string name, email;
  std::string licence;
};

// "an arm of six joints with a gripper of two fingers, reach 0.6 m".
DOPPEL_API std::string summary(const ArmDesign& design);

// "joint_2=0.8 joint_3=0.4": arguments of `doppel move` for a visible motion.
DOPPEL_API std::string example_move(const ArmDesign& design);

DOPPEL_API std::vector<PackageFile> arm_package(const PackageName& name, const ArmDesign& design,
                                                const PackageAuthor& author);

}  // namespace doppel::scaffold
