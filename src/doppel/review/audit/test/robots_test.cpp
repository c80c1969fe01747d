// The bundled robots, and what their walkthrough promises: seventeen errors for the raw export, none for the
// corrected description.
#include <map>
#include <set>

#include "doppel/review/audit/test/audit_fixture.h"

namespace doppel::audit_test {
namespace {

AuditReport audit_robot(const std::string& description, const std::string& package) {
  const fs::path root = fs::path(DOPPEL_SOURCE_DIR);
  PackageResolver resolver;
  resolver.add_bundled(root / "robots");
  AuditOptions options;
  options.package_folder = root / "robots" / package;
  options.datasheet_folder = root / "datasheets";
  return audit(root / "robots" / description, {}, resolver, options);
}

TEST(BundledRobots, RawExportHasSeventeenWalkthroughProblems) {
  const AuditReport report = audit_robot("omarm_one/export/urdf/omarm.xacro", "omarm_one/export");
  std::map<std::string, std::set<std::string>> errors;
  for (const Finding& f : report.findings) {
    if (f.severity == Severity::error) {
      EXPECT_TRUE(errors[f.rule].insert(f.subject).second) << f.rule << f.subject;
    }
  }
  std::set<std::string> joints;
  for (const char number : {'1', '2', '3', '4', '5', '6', '8', '9'})
    joints.insert(std::string("joint 'Revolute ") + number + "'");
  EXPECT_EQ(errors["joint.exporter_velocity"], joints);
  EXPECT_EQ(errors["joint.exporter_effort"], joints);
  EXPECT_EQ(errors["inertia.rounded_zero"].size(), 1U);
  EXPECT_EQ(errors.size(), 3U);
  EXPECT_EQ(report.count(Severity::error), 17U);
  EXPECT_EQ(report.links, 12U);
  EXPECT_EQ(report.joints, 11U);
  EXPECT_NEAR(report.mass, 1.2844, 5e-5);
}

TEST(BundledRobots, ZeroMomentsAreFixedByTransverseUpperBound) {
  const AuditReport report = audit_robot("omarm_one/export/urdf/omarm.xacro", "omarm_one/export");
  const auto found = std::find_if(report.findings.begin(), report.findings.end(),
                                  [](const Finding& f) { return f.rule == "inertia.rounded_zero"; });
  ASSERT_NE(found, report.findings.end());
  EXPECT_NE(found->fix.find("upper bound"), std::string::npos);
  std::map<std::string, double> given;
  for (const Operation& o : found->repair) {
    const auto& set = std::get<SetInertia>(o.action);
    ASSERT_EQ(set.components.size(), 1U);
    given[set.link] = set.components.at("iyy");
  }
  EXPECT_EQ(given, (std::map<std::string, double>{{"gripper_gear_left_1", 1e-6},
                                                  {"gripper_gear_right_1", 1e-6},
                                                  {"gripper_finger_left_1", 3e-6},
                                                  {"gripper_finger_right_1", 3e-6}}));
}

TEST(BundledRobots, CorrectedRobotsHaveNoError) {
  for (const auto& [file, package] : {std::pair{"omarm_one/urdf/omarm.xacro", "omarm_one"},
                                      std::pair{"omarm_zero/urdf/omarm_zero.xacro", "omarm_zero"},
                                      std::pair{"lab_arm/urdf/arm.urdf.xacro", "lab_arm"},
                                      std::pair{"desk_arm/urdf/desk_arm.urdf.xacro", "desk_arm"}}) {
    for (const Finding& f : audit_robot(file, package).findings) {
      EXPECT_NE(f.severity, Severity::error)
          << file << ": " << f.rule << ' ' << f.subject << ": " << f.message;
    }
  }
}

}  // namespace
}  // namespace doppel::audit_test
