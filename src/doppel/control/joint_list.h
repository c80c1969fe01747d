#pragma once
// The joints that a controller's YAML lists, held against the model: an unknown one is an error at its place
// in the file, with the nearest name; a fixed one too; one that mimics another has no motor and is left out
// with a warning.

#include <string>
#include <vector>

#include "doppel/control/controller.h"
#include "doppel/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

enum class JointUse {
  commanded,  // fixed, floating and planar joints are refused, mimicking ones dropped with a warning
  observed    // anything with a state; only unknown joints are refused
};

// `names` is the value of the declared parameter `parameter` (a list or one string); returns those that
// remain, in order. Throws InputError with one diagnostic for each name that is unknown, listed twice or
// unfit. Warnings go to the context's log.
DOPPEL_API std::vector<std::string> check_joints(const ControllerContext& context,
                                                 const std::string& parameter,
                                                 const std::vector<std::string>& names,
                                                 JointUse use = JointUse::commanded);

// Where the YAML wrote element `index` of a list parameter (the whole value where elements have no place of
// their own); unknown where the parameter has its default.
DOPPEL_API SourceLocation place_of(const ControllerContext& context, std::string_view parameter,
                                   std::size_t index = 0);

// Writes a finding to the log, with its place and fix.
DOPPEL_API void log_diagnostic(const Log& log, const std::string& origin, const Diagnostic& finding);

}  // namespace doppel
