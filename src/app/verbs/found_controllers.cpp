#include "app/verbs/found_controllers.h"

#include <utility>

#include "doppel/scenario/resolve/controllers_search.h"
#include "doppel/scenario/resolve/ros1_controllers.h"

namespace doppel::app {

FoundControllers find_controllers(const RobotDescription& robot, const DescriptionTarget& target,
                                  const std::string& chosen) {
  std::vector<ControllersFile> files;
  if (!chosen.empty()) {
    Diagnostics diagnostics;
    files.push_back(controllers_in(load_controllers(chosen, robot, diagnostics)));
    print_diagnostics(diagnostics);
  } else {
    ControllersSearch search = find_controllers_files(robot, target.target, target.resolver);
    Diagnostics diagnostics;
    report(search, diagnostics);
    print_diagnostics(diagnostics);
    files = std::move(search.files);
  }
  FoundControllers found;
  for (const ControllersFile& file : files) {
    found.files.push_back(file.path);
    for (JointGroup& controller : joint_groups(file)) found.controllers.push_back(std::move(controller));
  }
  return found;
}

}  // namespace doppel::app
