#pragma once
// The parameters of a macro, as its params attribute lists them: "a b:=1 c:='x y' d:=^ e:=^|2 *block
// **blocks".

#include <string>
#include <vector>

#include "doppel/description/xacro_detail.h"

namespace doppel::xacro {

std::vector<Macro::Parameter> parse_parameters(const std::string& text, const SourceLocation& where);

}  // namespace doppel::xacro
