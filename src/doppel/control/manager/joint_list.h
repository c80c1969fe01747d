#pragma once
// The joints that a controller's YAML lists, compared with the model: an unknown or fixed one is an error at
// its place in the file, with the nearest name; a mimic joint has no drive and is left out with a warning.

#include <string>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/control/manager/controller.h"
#include "doppel/export.h"

namespace doppel {

enum class JointUse {
  commanded,  // fixed, floating and planar joints are refused, mimicking ones dropped with a warning
  observed    // anything with a state; only unknown joints are refused
};

// `names` is the value of the declared parameter `parameter` (a list or one string); returns the remaining
// names in order. Throws InputError with one diagnostic for each name that is unknown, listed twice or
// unsuitable. Warnings go to the context's log.
DOPPEL_API std::vector<std::string> check_joints(const ControllerContext& context,
                                                 const std::string& parameter,
                                                 const std::vector<std::string>& names,
                                                 JointUse use = JointUse::commanded);

// The place in the YAML of element `index` of a list parameter, or of the whole value if elements have no
// places of their own; unknown if the parameter has its default.
DOPPEL_API SourceLocation place_of(const ControllerContext& context, std::string_view parameter,
                                   std::size_t index = 0);

// Writes a finding to the log, with its place and fix.
DOPPEL_API void log_diagnostic(const Log& log, const std::string& origin, const Diagnostic& finding);

}  // namespace doppel
