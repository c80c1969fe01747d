// The audit of real robots: every description of ../shared/corpus is counted, classified as check_urdf does,
// and audited. Skipped if the corpus is not there.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "doppel/review/audit/audit.h"
#include "doppel/review/audit/description_statistics.h"
#include "doppel/review/audit/urdfdom_verdict.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path& corpus() {
  static const fs::path folder =
      fs::weakly_canonical(fs::path(DOPPEL_SOURCE_DIR) / ".." / "shared" / "corpus");
  return folder;
}

class AuditCorpus : public testing::Test {
 protected:
  void SetUp() override {
    std::ifstream in(corpus() / "manifest.json");
    if (!in) GTEST_SKIP() << "no corpus at " << corpus();
    for (const Json& record : Json::parse(in)) {
      if (record["expect"] == "ok" && record["kind"] != "srdf_xacro") cases_.push_back(record);
    }
    ASSERT_GE(cases_.size(), 299U);
  }
  static fs::path description(const Json& record) {
    return corpus() /
           (record["expected"].is_null() ? record["input"] : record["expected"]).get<std::string>();
  }
  static PackageResolver resolver(const Json& record) {
    PackageResolver out;
    for (const auto& [name, folder] : record["packages"].items())
      out.add_package(name, corpus() / folder.get<std::string>());
    return out;
  }
  std::vector<Json> cases_;
};

Json as_json(const DescriptionStatistics& s) {
  return {{"links", s.links},
          {"joints", s.joints},
          {"joints_by_type", s.joints_by_type},
          {"root_links", s.root_links},
          {"duplicate_link_names", s.duplicate_link_names},
          {"duplicate_joint_names", s.duplicate_joint_names},
          {"joint_links_undefined", s.joint_links_undefined},
          {"links_with_two_parents", s.links_with_two_parents},
          {"links_with_inertial", s.links_with_inertial},
          {"links_without_inertial", s.links_without_inertial},
          {"inertial_without_mass", s.inertial_without_mass},
          {"zero_mass", s.zero_mass},
          {"negative_mass", s.negative_mass},
          {"zero_inertia", s.zero_inertia},
          {"identity_inertia", s.identity_inertia},
          {"inertia_not_positive_definite", s.inertia_not_positive_definite},
          {"inertia_triangle_violation", s.inertia_triangle_violation},
          {"inertia_not_numeric", s.inertia_not_numeric},
          {"movable_joints_without_limit", s.movable_joints_without_limit},
          {"limits_both_zero", s.limits_both_zero},
          {"limits_lower_above_upper", s.limits_lower_above_upper},
          {"limit_without_effort_or_velocity", s.limit_without_effort_or_velocity},
          {"velocity_100_or_more", s.velocity_100_or_more},
          {"effort_100_or_more", s.effort_100_or_more},
          {"velocity_zero", s.velocity_zero},
          {"effort_zero", s.effort_zero},
          {"axis_zero", s.axis_zero},
          {"axis_not_unit", s.axis_not_unit},
          {"mimic_joints", s.mimic_joints},
          {"visuals", s.visuals},
          {"collisions", s.collisions},
          {"mesh_references", s.mesh_references},
          {"meshes_unique", s.meshes_unique},
          {"mesh_schemes", s.mesh_schemes},
          {"materials_undefined", s.materials_undefined},
          {"transmissions", s.transmissions},
          {"ros2_control_tags", s.ros2_control_tags},
          {"gazebo_tags", s.gazebo_tags},
          {"other_top_level_tags", s.other_top_level_tags}};
}

// An empty dictionary may be written as null.
bool same(const Json& a, const Json& b) {
  return a == b || (a.empty() && b.empty() && !a.is_number() && !b.is_number());
}

TEST_F(AuditCorpus, StatisticsMatchManifest) {
  for (const Json& record : cases_) {
    SCOPED_TRACE(record["id"].get<std::string>());
    const DescriptionStatistics counted = count_statistics(load_xml(description(record).string()));
    const Json mine = as_json(counted);
    for (const auto& [name, value] : mine.items()) {
      EXPECT_TRUE(same(value, record["stats"][name]))
          << "expected " << name << " to be " << record["stats"][name] << "; it is " << value;
    }
    const double mass = record["stats"]["total_mass"];
    EXPECT_NEAR(counted.total_mass, mass, 1e-6 * (1 + std::abs(mass)));
  }
}

TEST_F(AuditCorpus, VerdictMatchesCheckUrdf) {
  for (const Json& record : cases_) {
    SCOPED_TRACE(record["id"].get<std::string>());
    const UrdfdomVerdict mine = urdfdom_verdict(load_xml(description(record).string()));
    EXPECT_EQ(mine.ok, record["check_urdf"]["ok"].get<bool>());
    for (const std::string message : record["check_urdf"]["messages"]) {
      if (message.starts_with("at line") || message.starts_with("...") || message.starts_with("ERROR:"))
        continue;
      EXPECT_NE(std::find(mine.messages.begin(), mine.messages.end(), message), mine.messages.end())
          << message;
    }
  }
}

TEST_F(AuditCorpus, EveryRobotIsAuditedWithKnownRules) {
  for (const Json& record : cases_) {
    SCOPED_TRACE(record["id"].get<std::string>());
    PackageResolver packages = resolver(record);
    const AuditReport report = audit(description(record), {}, packages, {});
    EXPECT_EQ(report.links, record["stats"]["links"].get<std::size_t>());
    EXPECT_EQ(report.joints, record["stats"]["joints"].get<std::size_t>());
    for (const Finding& f : report.findings) {
      EXPECT_NE(find_rule(f.rule), nullptr) << f.rule;
      EXPECT_FALSE(f.rule.starts_with("xml.")) << f.message;
      EXPECT_NE(f.message, "") << f.rule;
    }
    // What ROS's own parser rejects is an error here too.
    if (!record["check_urdf"]["ok"]) {
      EXPECT_GT(report.count(Severity::error), 0U);
    }
  }
}

// Public robots that are in use: what check_urdf accepts must not be reported as an error.
TEST_F(AuditCorpus, RobotAcceptedByCheckUrdfHasNoError) {
  for (const Json& record : cases_) {
    if (!record["check_urdf"]["ok"].get<bool>()) continue;
    SCOPED_TRACE(record["id"].get<std::string>());
    PackageResolver packages = resolver(record);
    for (const Finding& f : audit(description(record), {}, packages, {}).findings) {
      // Some cases name a controller file that is not part of the corpus, and a demo lacks its prefix in
      // <ros2_control>, which the resource manager rejects.
      if (f.rule == "controllers.file_missing" || f.rule == "ros2_control.unknown_joint") continue;
      EXPECT_NE(f.severity, Severity::error) << f.rule << ' ' << f.subject << ": " << f.message;
    }
  }
}

}  // namespace
}  // namespace doppel
