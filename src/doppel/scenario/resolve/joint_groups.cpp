#include "doppel/scenario/resolve/joint_groups.h"

namespace doppel {

std::vector<JointGroup> joint_groups(const ControllersFile& file) {
  std::vector<JointGroup> out;
  for (const DeclaredController& c : file.controllers) {
    if (c.type.empty()) continue;
    out.push_back({c.name, c.type, c.broadcasts() ? std::vector<std::string>() : c.driven_joints()});
  }
  return out;
}

}  // namespace doppel
