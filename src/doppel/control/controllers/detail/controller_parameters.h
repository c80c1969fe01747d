#pragma once
// The parameters of a controller as a list of its members (parameter_fields.h), with the errors for those
// that have to be written and the reports of those that are deprecated. Errors and reports have the place in
// the YAML.

#include <string>
#include <utility>
#include <vector>

#include "doppel/control/manager/controller.h"
#include "doppel/ros/bus/parameter_fields.h"

namespace doppel {

// The report for a parameter that is not written, or written with an empty text or list. "{}" is its name.
struct Requirement {
  const char* rule = nullptr;  // nullptr: it need not be written
  std::string problem, fix;    // the problem follows "controller 'NAME'"
};
// "controller 'base': 'wheel_radius' is not set".
Requirement required_for_base(const char* fix, const char* problem = "is not set");
// "controller 'imu' has no 'frame_id', so ..."; the fix is an example of the value.
Requirement required_value(const std::string& example, const std::string& consequence = "");

struct ControllerParameter : ParameterField {
  ControllerParameter(std::string its_name, ParameterMember its_member, std::string its_description = "",
                      ParameterOptions its_rules = {}, Requirement its_requirement = {})
      : ParameterField{std::move(its_name), its_member, std::move(its_description), std::move(its_rules)},
        requirement(std::move(its_requirement)) {}
  Requirement requirement;
};
using ControllerParameters = std::vector<ControllerParameter>;

// More rules than in parameter_fields.h. The numbers have to be finite.
ParameterOptions positive();
ParameterOptions not_negative();
ParameterOptions one_of(std::vector<std::string> choices);

// Throws InputError for an invalid or a missing value.
void declare_parameters(ControllerContext& context, const ControllerParameters& list);
// Declares the deprecated name of the parameter that is declared as `present`. A value that is written for it
// is reported, and the member takes it unless it is empty or 0. True: it has taken it.
bool declare_old_name(ControllerContext& context, const char* rule, const ControllerParameter& old,
                      const std::string& present);
// The members take the present values of those that can be changed.
void read_parameters(const Parameters& parameters, const ControllerParameters& list);

// Throws InputError: "controller 'NAME': 'PARAMETER' WHY".
[[noreturn]] void refuse_parameter(const ControllerContext& context, const char* rule,
                                   const std::string& parameter, const std::string& why,
                                   const std::string& fix);
// Logs "'PARAMETER' WHY" as a warning if a user's file has the parameter.
void report_parameter(const ControllerContext& context, const char* rule, const std::string& parameter,
                      const std::string& why, const std::string& fix);
inline constexpr const char* kDeprecated = "control.deprecated_parameter";

}  // namespace doppel
