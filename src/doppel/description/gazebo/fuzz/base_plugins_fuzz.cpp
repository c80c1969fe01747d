// Fuzz target: the text of a plugin that drives a base in Gazebo, in a description that has its usual joints. What it is
// mapped to is valid YAML for the controller manager.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "doppel/description/gazebo/base_plugins.h"
#include "doppel/description/urdf/load.h"
#include "doppel/ros/bus/parameter_file.h"

namespace {

std::string robot_with(const std::string& plugin) {
  std::string text = "<robot name=\"rover\"><link name=\"base_link\"/>";
  for (const char* joint :
       {"left", "right", "front_left", "front_right", "rear_left", "rear_right", "it's: [a] #"}) {
    const std::string name = joint;
    text += "<link name=\"" + name + "_wheel\"/><joint name=\"" + name +
            "\" type=\"continuous\"><parent link=\"base_link\"/><child link=\"" + name + "_wheel\"/></joint>";
  }
  return text + "<gazebo>" + plugin + "</gazebo></robot>";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static doppel::PackageResolver resolver;
  try {
    doppel::Diagnostics diagnostics;
    const std::string text = robot_with({reinterpret_cast<const char*>(data), size});
    const doppel::RobotDescription robot = doppel::parse_urdf(text, "robot.urdf", resolver, diagnostics);
    const auto mapped = doppel::map_base_plugin(robot, doppel::PluginTopics::relative, diagnostics);
    if (!mapped) return 0;
    const std::string yaml =
        "controller_manager:\n  ros__parameters:\n" + mapped->declaration + mapped->section;
    try {
      const doppel::ParameterFile file = doppel::ParameterFile::parse(yaml, "mapped");
      if (file.overrides_for("/" + mapped->name).all().empty()) std::abort();
    } catch (const doppel::InputError&) {
      std::abort();
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
