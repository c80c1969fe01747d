#include "extra_robots.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace doppel {

WrittenRobot::WrittenRobot(const std::string& urdf, const std::string& controllers) {
  std::string name = (std::filesystem::temp_directory_path() / "doppel-extras.XXXXXX").string();
  folder_ = mkdtemp(name.data());
  std::ofstream(folder_ + "/robot.urdf") << urdf;
  Scenario scenario;
  scenario.robots = {{.target = folder_ + "/robot.urdf"}};
  if (!controllers.empty()) {
    std::ofstream(folder_ + "/controllers.yaml") << controllers;
    scenario.robots.front().controllers = {folder_ + "/controllers.yaml"};
  }
  subject_ = std::make_unique<Subject>(read_subject(scenario, {}));
  if (!subject_->refusal.empty()) throw std::runtime_error(subject_->refusal.front().message);
}

WrittenRobot::~WrittenRobot() {
  subject_.reset();
  std::filesystem::remove_all(folder_);
}

CheckContext WrittenRobot::context() const {
  CheckContext out{*subject_, suite};
  out.effort = Effort::quick;
  out.write_answers = false;
  return out;
}

std::string bar_link(const std::string& name, double mass, double x, double inertia) {
  return fmt::format(R"(<link name="{}"><inertial><origin xyz="{} 0 0"/><mass value="{}"/>
      <inertia ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"/></inertial></link>)",
                     name, x, mass, inertia, inertia, inertia);
}

std::string hinge_text(const HingeText& hinge) {
  return fmt::format(R"(<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/>
      <origin xyz="{} 0 0"/><axis xyz="{}"/><dynamics damping="{}" friction="{}"/>
      <limit lower="-{}" upper="{}" effort="{}" velocity="{}"/></joint>)",
                     hinge.name, hinge.parent, hinge.child, hinge.x, hinge.axis, hinge.damping,
                     hinge.friction, hinge.limit, hinge.limit, hinge.effort, hinge.velocity);
}

std::string two_link_arm() {
  return R"(<robot name="two_links"><link name="base_link"/>)" + bar_link("upper", 1, 0.15) +
         bar_link("fore", 0.5, 0.1) +
         R"(<link name="tool0"/><joint name="flange" type="fixed"><parent link="fore"/><child link="tool0"/>
         <origin xyz="0.2 0 0"/></joint>)" +
         hinge_text({.name = "shoulder", .parent = "base_link", .child = "upper", .effort = 10}) +
         hinge_text({.name = "elbow", .parent = "upper", .child = "fore", .x = 0.3, .effort = 4}) +
         "</robot>";
}

}  // namespace doppel
