#pragma once
// The texts of the package's files, one function each.

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "doppel/description/scaffold/arm_package.h"

namespace doppel::scaffold {

// `text` with each @name@ replaced; every name in it has to be given.
std::string filled(std::string_view text,
                   std::initializer_list<std::pair<std::string_view, std::string>> values);

std::string solids_xacro();
std::string robot_xacro(const PackageName& name, const ArmDesign& design);
std::string control_xacro(const PackageName& name, const ArmDesign& design);

}  // namespace doppel::scaffold
