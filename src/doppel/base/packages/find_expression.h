#pragma once
// $(find NAME) in a plain URDF, which may contain it if it is always expanded by xacro.

#include <string>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/export.h"

namespace doppel {

// `text` with its first $(find NAME) replaced by the folder of the package; unchanged if there is none or the
// package is not found.
DOPPEL_API std::string with_found_package(std::string text, const PackageResolver& resolver);

}  // namespace doppel
