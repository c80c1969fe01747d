// The audit of real robots: every description of ../shared/corpus is audited, and compared with counts that
// were made independently and with the result of check_urdf. Skipped if the corpus is not there.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "doppel/review/audit/audit.h"

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

// The counts of the manifest, and the rule that reports each of what is counted.
constexpr std::pair<const char*, const char*> kCountedByRule[] = {
    {"joint_links_undefined", "urdf.unknown_link"},
    {"links_with_two_parents", "urdf.two_parents"},
    {"zero_mass", "inertia.mass_zero"},
    {"negative_mass", "inertia.mass_negative"},
    {"identity_inertia", "inertia.identity"},
    {"inertia_not_positive_definite", "inertia.rounded_zero"},
    {"inertia_triangle_violation", "inertia.triangle"},
    {"inertial_without_mass", "urdf.inertial"},
    {"movable_joints_without_limit", "joint.no_limits"},
    {"limit_without_effort_or_velocity", "joint.limit_incomplete"},
    {"limits_both_zero", "joint.range_zero"},
    {"velocity_zero", "joint.velocity_zero"},
    {"effort_zero", "joint.effort_zero"},
};

TEST_F(AuditCorpus, FindingsAndMassMatchManifest) {
  for (const Json& record : cases_) {
    SCOPED_TRACE(record["id"].get<std::string>());
    PackageResolver packages = resolver(record);
    const AuditReport report = audit(description(record), {}, packages, {});
    const auto count = [&](const char* rule) {
      return std::ranges::count_if(report.findings, [&](const Finding& f) { return f.rule == rule; });
    };
    const Json& stats = record["stats"];
    for (const auto& [name, rule] : kCountedByRule) {
      ASSERT_NE(find_rule(rule), nullptr) << rule;
      EXPECT_EQ(count(rule), stats[name].get<int>()) << rule;
    }
    EXPECT_EQ(count("urdf.duplicate_name"),
              stats["duplicate_link_names"].get<int>() + stats["duplicate_joint_names"].get<int>());
    EXPECT_EQ(count("urdf.unknown_material") > 0, stats["materials_undefined"].get<int>() > 0);
    const double mass = stats["total_mass"];
    EXPECT_NEAR(report.mass, mass, 1e-6 * (1 + mass));
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
