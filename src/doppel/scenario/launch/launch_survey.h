#pragma once
// The launch files of a package, read for a judgement on them. They are read confined: their code has no
// effect, whoever wrote it.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/export.h"
#include "doppel/scenario/launch/launch_description.h"

namespace doppel {

// A robot that is put into a simulator.
struct SpawnedRobot {
  double height = 0;  // m
  SourceLocation source;
};

// The content of one file and of those of its package that it includes, with the branches that its conditions
// leave out for the default values of its arguments.
struct SurveyedLaunch {
  std::filesystem::path file;
  std::vector<NamedPackage> packages;  // of nodes, and those that are looked up
  std::vector<LaunchExpansion> expansions;
  std::vector<SpawnedRobot> spawned;
  bool simulates = false;
  Diagnostics notes;  // why its reading ended early; what it would have changed
};

struct LaunchSurvey {
  std::vector<SurveyedLaunch> files;
  std::optional<Diagnostic> unread;  // why some or all files were not read
};

// Files of a package's folder. Python may be missing, or the kernel unable to confine it: then nothing is
// read.
DOPPEL_API LaunchSurvey survey_launch_files(const std::filesystem::path& package,
                                            const std::vector<std::filesystem::path>& files,
                                            PackageResolver resolver);

}  // namespace doppel
