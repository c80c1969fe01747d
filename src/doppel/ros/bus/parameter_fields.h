#pragma once
// Parameters of a node as a list of the members of a struct, from which their declaration, their reading and
// their changes follow:
//
//   const std::vector<ParameterField> fields{{"deadzone", &s.deadzone, "of an axis' range", value_range(0,
// 0.9)},
//                                            {"device_id", &s.device, "of the joystick", read_only()}};
//   for (const ParameterField& field : fields) declare_field(parameters, overrides, field);

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {

// The member that has a parameter's value; it exists as long as the field is used.
using ParameterMember = std::variant<bool*, std::int64_t*, double*, std::string*, std::vector<double>*,
                                     std::vector<std::string>*>;

struct ParameterField {
  std::string name;
  ParameterMember member;  // its value before the declaration is the default
  std::string description = {};
  ParameterOptions rules = {};  // their description is not used
};

// Rules, which can be combined: read_only(value_range(0, 31)).
DOPPEL_API ParameterOptions read_only(ParameterOptions rules = {});
DOPPEL_API ParameterOptions value_range(double lower, double upper);
DOPPEL_API ParameterOptions minimum(double least);

// Declares the parameter with the value that is written for it, which the member then has. Throws InputError
// as declare_parameter() does.
DOPPEL_API void declare_field(Parameters& parameters, ParameterOverrides* overrides,
                              const ParameterField& field);
// The member takes the present value of the declared parameter.
DOPPEL_API void read_field(const Parameters& parameters, const ParameterField& field);
// From now on the member takes each change of the declared parameter.
DOPPEL_API void follow_field(Parameters& parameters, const ParameterField& field);

}  // namespace doppel
