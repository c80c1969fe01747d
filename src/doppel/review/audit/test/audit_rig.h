#pragma once
// A package on disk, written by a test, and the audit's findings on it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "doppel/review/audit/audit.h"

namespace doppel {

class AuditRig : public testing::Test {
 protected:
  AuditRig() {
    std::string name = (std::filesystem::temp_directory_path() / "doppel_audit_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~AuditRig() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  void write(const std::string& name, const std::string& text) {
    const std::filesystem::path file = folder_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
  }

  AuditReport report(const std::string& name = "urdf/r.urdf", const XacroArguments& arguments = {}) {
    PackageResolver resolver;
    if (options.package_folder.empty() && std::filesystem::exists(folder_ / "package.xml")) {
      options.package_folder = folder_;
    }
    return audit(folder_ / name, arguments, resolver, options);
  }

  // The findings of one rule for a robot with this content.
  std::vector<Finding> of(const std::string& rule, const std::string& body) {
    write("urdf/r.urdf", robot(body));
    return of(rule);
  }
  std::vector<Finding> of(const std::string& rule, const XacroArguments& arguments = {}) {
    std::vector<Finding> out;
    for (Finding& finding : report(name_, arguments).findings) {
      if (finding.rule == rule) out.push_back(std::move(finding));
    }
    return out;
  }

  // Two driven joints, a fixed one and a mimic, fixed to the world.
  static std::string robot(const std::string& body) {
    return "<robot name=\"r\">\n" + tree() + body + "\n</robot>\n";
  }
  static std::string tree() {
    const auto link = [](const std::string& name, const std::string& z) {
      return "<link name=\"" + name +
             "\"><inertial><origin xyz=\"0 0 0.05\"/><mass value=\"0.5\"/><inertia ixx=\"0.001\" ixy=\"0\" "
             "ixz=\"0\" "
             "iyy=\"0.001\" iyz=\"0\" izz=\"0.001\"/></inertial><visual><origin xyz=\"0 0 " +
             z +
             "\"/><geometry><box size=\"0.05 0.05 0.1\"/></geometry></visual><collision><origin xyz=\"0 0 " +
             z + "\"/><geometry><box size=\"0.05 0.05 0.1\"/></geometry></collision></link>\n";
    };
    const auto joint = [](const std::string& name, const std::string& parent, const std::string& child,
                          const std::string& more) {
      return "<joint name=\"" + name + "\" type=\"revolute\"><parent link=\"" + parent +
             "\"/><child link=\"" + child +
             "\"/><origin xyz=\"0 0 0.11\"/><axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"2\" "
             "effort=\"3\" "
             "velocity=\"4\"/>" +
             more + "</joint>\n";
    };
    return "<link name=\"world\"/>\n<joint name=\"stand\" type=\"fixed\"><parent link=\"world\"/><child "
           "link=\"base\"/></joint>\n" +
           link("base", "0.05") + link("upper", "0.05") + link("lower", "0.05") + link("finger", "0.05") +
           joint("shoulder", "base", "upper", "") + joint("elbow", "upper", "lower", "") +
           joint("follower", "lower", "finger", "<mimic joint=\"elbow\"/>");
  }

  static std::string hardware(const std::string& inside,
                              const std::string& plugin = "gz_ros2_control/GazeboSimSystem",
                              const std::string& name = "arm") {
    return "<ros2_control name=\"" + name + "\" type=\"system\"><hardware><plugin>" + plugin +
           "</plugin></hardware>\n" + inside + "</ros2_control>\n";
  }
  static std::string driven(const std::string& joint, const std::string& command = "position") {
    return "<joint name=\"" + joint + "\"><command_interface name=\"" + command +
           "\"/><state_interface name=\"position\"/><state_interface name=\"velocity\"/></joint>\n";
  }
  static std::string gazebo_plugin(const std::string& inside = "") {
    return "<gazebo><plugin filename=\"gz_ros2_control-system\" "
           "name=\"gz_ros2_control::GazeboSimROS2ControlPlugin\">" +
           inside + "</plugin></gazebo>\n";
  }
  static std::string good_hardware() {
    return hardware(driven("shoulder") + driven("elbow")) + gazebo_plugin();
  }

  std::filesystem::path folder_;
  std::string name_ = "urdf/r.urdf";
  AuditOptions options;
};

}  // namespace doppel
