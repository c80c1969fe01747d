#pragma once
// The controllers' YAML, as the rules use it.

#include <vector>

#include "doppel/control/manager/controller.h"
#include "doppel/review/audit/detail/rules.h"
#include "doppel/scenario/resolve/controllers_file.h"

namespace doppel::audit_rules {

// The caller's file; else those that `doppel up` takes (scenario/resolve/controllers_search.h), or where it takes none
// the only one of the package, for its joints may be misspelt. What cannot be read becomes a finding.
std::vector<ControllersFile> read_controllers(const AuditInput& in, Findings& out);

// Initialises the controller and reports rejected parameters, whole numbers where ROS 2 requires decimals,
// and unused parameters.
void check_parameters(const AuditInput& in, const ControllersFile& file, DeclaredController& controller,
                      const ControllerRegistry::Type& type, Findings& out);

}  // namespace doppel::audit_rules
