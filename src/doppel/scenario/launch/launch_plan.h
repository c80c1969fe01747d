#pragma once
// The result of a launch file: one scenario, and the user's own programs beside it.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/export.h"
#include "doppel/scenario/launch/launch_description.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

enum class LaunchFate {
  taken,      // a part of the scenario, or done by doppel anyway
  started,    // a program that is started beside the twin
  absent,     // known, and not a part of doppel
  not_found,  // a program that is not on this machine
  unknown,    // not known
  structure,  // groups others, or is skipped
};

struct LaunchOutcome {
  LaunchFate fate = LaunchFate::structure;
  std::string text;  // "the robot", "not here: ..."
};

// A program of the user.
struct LaunchedProgram {
  int record = 0;          // the LaunchRecord::id
  std::string label = {};  // in front of its output
  std::vector<std::string> words = {};
  std::filesystem::path folder = {};
  NamedTexts environment = {};
  bool required = false;  // the launch ends with it
  int after = 0;  // the record of the program whose end it waits for; 0: it starts when the twin is ready
  SourceLocation source = {};
};

struct LaunchPlan {
  Scenario scenario;
  bool needs_description = false;  // it has parts of a robot, whose description another launch file loads
  bool physics = true;             // false: the robots are shown only, as `doppel view` does
  std::vector<LaunchedProgram> programs;
  std::map<int, LaunchOutcome> outcomes;  // by LaunchRecord::id
  Diagnostics diagnostics;
};

// `folder`: for files that the plan needs (descriptions that the launch file has made, a world with spawned
// models);
// it has to outlive the run. The robots are not loaded.
DOPPEL_API LaunchPlan plan_launch(const LaunchDescription& description, PackageResolver& resolver,
                                  const std::filesystem::path& folder);

// The records as a tree with their lines and what became of each, one line per record.
DOPPEL_API std::string launch_tree(const LaunchDescription& description, const LaunchPlan& plan,
                                   const std::filesystem::path& folder);

}  // namespace doppel
