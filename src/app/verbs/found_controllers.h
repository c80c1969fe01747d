#pragma once
// The controllers that belong to a description (scenario/resolve/controllers_search.h), or those of a chosen
// file.

#include <filesystem>
#include <string>
#include <vector>

#include "app/description_target.h"
#include "doppel/scenario/resolve/joint_groups.h"

namespace doppel::app {

struct FoundControllers {
  std::vector<std::filesystem::path> files;
  std::vector<JointGroup> controllers;
};

// A file that cannot be read is an error if it was chosen, else a warning on stderr.
FoundControllers find_controllers(const RobotDescription& robot, const DescriptionTarget& target,
                                  const std::string& chosen = "");

}  // namespace doppel::app
