#pragma once
// A small valid robot, with places where tests insert faults.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "doppel/review/audit/audit.h"

namespace doppel::audit_test {

namespace fs = std::filesystem;

inline const std::string kInertial =
    R"(<inertial><origin xyz="0 0 0.1"/><mass value="1"/><inertia ixx="0.0036" ixy="0" ixz="0" iyy="0.0036" iyz="0" izz="0.0006"/></inertial>)";
inline const std::string kShape =
    R"(<origin xyz="0 0 0.1"/><geometry><box size="0.06 0.06 0.2"/></geometry>)";
inline const std::string kVisual = "<visual>" + kShape + "</visual>";
inline const std::string kCollision = "<collision>" + kShape + "</collision>";
inline const std::string kLimit = R"(<limit lower="-1" upper="1" effort="5" velocity="3"/>)";
inline const std::string kAxis = R"(<axis xyz="0 1 0"/>)";

// The parts that a test replaces; the defaults are valid.
struct Parts {
  std::string inertial = kInertial, visual = kVisual, collision = kCollision;  // of link 'arm'
  std::string axis = kAxis, limit = kLimit, joint_more = "";                   // of joint 'j'
  std::string joint_type = "revolute", joint_name = "j", link_name = "arm", robot_name = "r";
  std::string robot_more;  // attributes of <robot>
  std::string more;        // below <robot>
};

inline std::string robot(const Parts& p) {
  return "<robot name=\"" + p.robot_name + "\"" + p.robot_more + ">\n<link name=\"world\"/>\n<link name=\"" +
         p.link_name + "\">\n" + p.inertial + "\n" + p.visual + "\n" + p.collision +
         "\n</link>\n<joint name=\"" + p.joint_name + "\" type=\"" + p.joint_type +
         "\">\n<origin xyz=\"0 0 0.5\"/><parent link=\"world\"/><child link=\"" + p.link_name + "\"/>\n" +
         p.axis + "\n" + p.limit + "\n" + p.joint_more + "\n</joint>\n" + p.more + "\n</robot>\n";
}

// Each test has its own folder.
class AuditTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string("doppel_audit_") + info->test_suite_name() + "_" + info->name();
    std::replace(name.begin(), name.end(), '/', '_');
    folder_ = fs::path(testing::TempDir()) / name;
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  AuditReport check(const std::string& urdf, const std::string& name = "r.urdf") const {
    return check_file(write(name, urdf));
  }
  static AuditReport check_file(const fs::path& file, const AuditOptions& options = {}) {
    PackageResolver resolver;
    return audit(file, {}, resolver, options);
  }
  static const Finding* find(const AuditReport& report, const std::string& rule) {
    const auto found = std::find_if(report.findings.begin(), report.findings.end(),
                                    [&](const Finding& f) { return f.rule == rule; });
    return found == report.findings.end() ? nullptr : &*found;
  }
  static std::string report_text(const AuditReport& report) {
    std::string out;
    for (const Finding& f : report.findings) out += f.rule + " " + f.subject + ": " + f.message + "\n";
    return out;
  }

  fs::path folder_;
};

}  // namespace doppel::audit_test
