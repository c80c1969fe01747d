// For each rule on semantic descriptions: one small invalid file and its valid counterpart.
#include "doppel/review/audit/test/audit_rig.h"

namespace doppel {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* kFar =
    "<link name=\"far\"><collision><origin xyz=\"5 0 0\"/><geometry><sphere radius=\"0.1\"/></geometry>"
    "</collision></link><joint name=\"rod\" type=\"fixed\"><parent link=\"base\"/><child "
    "link=\"far\"/></joint>";
constexpr const char* kArm = "<group name=\"arm\"><chain base_link=\"base\" tip_link=\"lower\"/></group>\n";

class SrdfRulesTest : public AuditRig {
 protected:
  void SetUp() override {
    write("package.xml", "<package/>");
    write("urdf/r.urdf", robot(kFar));
  }
  void srdf(const std::string& elements, const std::string& name = "r",
            const std::string& file = "config/r.srdf") {
    write(file, "<robot name=\"" + name + "\">\n" + elements + "</robot>\n");
  }
  // The finding of the only SRDF with these elements behind the group "arm".
  std::vector<Finding> found(const std::string& rule, const std::string& elements) {
    srdf(kArm + elements);
    return of(rule);
  }
  // The rules about SRDF that have findings.
  std::vector<std::string> rules() {
    std::vector<std::string> out;
    for (const Finding& finding : report().findings) {
      if (finding.rule.starts_with("srdf.")) out.push_back(finding.rule + ": " + finding.message);
    }
    return out;
  }
};

TEST_F(SrdfRulesTest, ValidFileGivesNoFinding) {
  srdf(std::string(kArm) +
       "<group name=\"hand\"><joint name=\"follower\"/></group><group name=\"all\"><group "
       "name=\"arm\"/><group "
       "name=\"hand\"/></group><group name=\"body\"><joint name=\"to_odom\"/></group>"
       "<group_state name=\"up\" group=\"all\"><joint name=\"shoulder\" value=\"2.00005\"/><joint "
       "name=\"follower\" value=\"0\"/></group_state>"
       "<end_effector name=\"e\" parent_link=\"lower\" group=\"hand\" parent_group=\"arm\"/>"
       "<virtual_joint name=\"to_odom\" type=\"planar\" parent_frame=\"odom\" child_link=\"world\"/>"
       "<passive_joint name=\"follower\"/>"
       "<disable_collisions link1=\"far\" link2=\"finger\" reason=\"Never\"/>"
       "<disable_collisions link1=\"upper\" link2=\"finger\" reason=\"User\"/>");
  EXPECT_THAT(rules(), IsEmpty());
}

TEST_F(SrdfRulesTest, UnknownNamesAreReportedWithNearest) {
  const auto message = [this](const std::string& elements) {
    const auto all = found("srdf.unknown_name", elements);
    return all.size() == 1 ? all[0].message : std::to_string(all.size()) + " findings";
  };
  EXPECT_THAT(message("<disable_collisions link1=\"uper\" link2=\"base\"/>"),
              AllOf(HasSubstr("'uper' is not a link"), HasSubstr("did you mean 'upper'?")));
  EXPECT_THAT(message("<group name=\"g\"><joint name=\"elbo\"/><joint name=\"elbow\"/></group>"),
              HasSubstr("did you mean 'elbow'?"));
  EXPECT_THAT(message("<group_state name=\"s\" group=\"arn\"/>"), HasSubstr("did you mean 'arm'?"));
  EXPECT_THAT(message("<group name=\"g\"><group name=\"arn\"/><group name=\"arm\"/></group>"),
              HasSubstr("is not a group"));
  EXPECT_THAT(message("<end_effector name=\"e\" parent_link=\"lwer\" group=\"arm\"/>"),
              HasSubstr("did you mean 'lower'?"));
  EXPECT_THAT(message("<passive_joint name=\"wheel\"/>"), HasSubstr("'wheel' is not a joint"));
  EXPECT_EQ(found("srdf.unknown_name", "<passive_joint name=\"wheel\"/>")[0].where.line, 3);
}

TEST_F(SrdfRulesTest, UnknownNameInManyPairsIsReportedOnce) {
  std::string pairs;
  for (const char* other : {"base", "upper", "lower", "finger"})
    pairs += std::string("<disable_collisions link1=\"cable\" link2=\"") + other + "\"/>\n";
  EXPECT_THAT(found("srdf.unknown_name", pairs), SizeIs(1));
}

TEST_F(SrdfRulesTest, LongChainOfGroupsIsSkippedWithNote) {
  std::string groups;
  for (int i = 0; i < 20000; ++i)
    groups +=
        "<group name=\"g" + std::to_string(i) + "\"><group name=\"g" + std::to_string(i + 1) + "\"/></group>";
  srdf(groups);
  EXPECT_THAT(rules(), IsEmpty());
  const auto notes = of("audit.skipped");
  ASSERT_THAT(notes, SizeIs(1));
  EXPECT_THAT(notes[0].message, HasSubstr("20000 groups"));
}

TEST_F(SrdfRulesTest, ChainAgainstTreeIsReported) {
  const auto reversed =
      found("srdf.chain", "<group name=\"g\"><chain base_link=\"lower\" tip_link=\"base\"/></group>");
  ASSERT_THAT(reversed, SizeIs(1));
  EXPECT_THAT(reversed[0].message, HasSubstr("the two are exchanged"));
  const auto apart =
      found("srdf.chain", "<group name=\"g\"><chain base_link=\"far\" tip_link=\"upper\"/></group>");
  ASSERT_THAT(apart, SizeIs(1));
  EXPECT_THAT(apart[0].message, HasSubstr("'upper' is not below 'far'"));
}

TEST_F(SrdfRulesTest, GroupsWithoutMeaningAreReported) {
  EXPECT_THAT(found("srdf.empty_group", "<group name=\"g\"><joint name=\"rod\"/></group>"), SizeIs(1));
  EXPECT_THAT(found("srdf.group_loop",
                    "<group name=\"g\"><group name=\"h\"/></group><group name=\"h\"><group "
                    "name=\"g\"/></group>"),
              SizeIs(2));
  EXPECT_THAT(found("srdf.duplicate_group", kArm), SizeIs(1));
}

TEST_F(SrdfRulesTest, StateThatGroupCannotHaveIsReported) {
  const auto message = [this](const std::string& joint, const std::string& value) {
    const auto all = found("srdf.state", "<group_state name=\"s\" group=\"arm\"><joint name=\"" + joint +
                                             "\" value=\"" + value + "\"/></group_state>");
    return all.size() == 1 ? all[0].message : std::to_string(all.size()) + " findings";
  };
  EXPECT_THAT(message("elbow", "2.1"), HasSubstr("2.1 is outside the limits of 'elbow', -1 to 2"));
  EXPECT_THAT(message("elbow", "0 1"), HasSubstr("has 1 position, and 2 are written"));
  EXPECT_THAT(message("follower", "0"), HasSubstr("is not in the group"));
  EXPECT_EQ(message("rod", "0"), "0 findings");
}

TEST_F(SrdfRulesTest, EndEffectorInItsArmIsReported) {
  EXPECT_THAT(found("srdf.end_effector",
                    "<group name=\"hand\"><joint name=\"elbow\"/></group><end_effector name=\"e\" "
                    "parent_link=\"lower\" group=\"hand\" parent_group=\"arm\"/>"),
              SizeIs(1));
}

TEST_F(SrdfRulesTest, PairThatTouchesIsNotTrustedAsOneThatNeverDoes) {
  // The elbow folds the finger, which mimics it, back to the upper link.
  const auto hidden = found("srdf.hidden_collision",
                            "<disable_collisions link1=\"finger\" link2=\"upper\" reason=\"Never\"/>");
  ASSERT_THAT(hidden, SizeIs(1));
  EXPECT_THAT(hidden[0].message,
              AllOf(HasSubstr("they touch at elbow = "), testing::Not(HasSubstr("shoulder"))));
  EXPECT_EQ(hidden[0].where.line, 3);
}

// The link "far" is a ball of 0.1 m at x = 5 m.
TEST_F(SrdfRulesTest, SpheresThatLeaveShapeOutAreReportedWithPointAndDistance) {
  const auto cover = [this](const std::string& link, const std::string& spheres) {
    return found("srdf.sphere_cover", "<link_sphere_approximation link=\"" + link + "\">" + spheres +
                                          "</link_sphere_approximation>");
  };
  EXPECT_THAT(cover("far", "<sphere center=\"5 0 0\" radius=\"0.1\"/>"), IsEmpty());
  EXPECT_THAT(cover("far", "<sphere center=\"5 0 0\" radius=\"0.09995\"/>"), IsEmpty()) << "rounding";
  EXPECT_THAT(cover("far", "<sphere center=\"5 0 0\" radius=\"0.08\"/>"), SizeIs(1));
  // The box of 0.05 x 0.05 x 0.1 m about z = 0.05 m reaches the corner at 0.0612 m.
  EXPECT_THAT(cover("upper", "<sphere center=\"0 0 0.05\" radius=\"0.0613\"/>"), IsEmpty());
  EXPECT_THAT(
      cover("upper",
            "<sphere center=\"0 0 0.02\" radius=\"0.05\"/><sphere center=\"0 0 0.08\" radius=\"0.05\"/>"),
      IsEmpty());
  const auto gap = cover("upper", "<sphere center=\"0 0 0.02\" radius=\"0.05\"/>");
  ASSERT_THAT(gap, SizeIs(1));
  EXPECT_EQ(gap[0].subject, "spheres of link 'upper'");
  EXPECT_EQ(gap[0].where.line, 3);
  EXPECT_EQ(gap[0].severity, Severity::warning);
  // sqrt(0.08^2 + 2 * 0.025^2) - 0.05 m
  EXPECT_THAT(gap[0].message, AllOf(HasSubstr(", 0.1) m"), HasSubstr("37.5 mm outside")));
  EXPECT_THAT(gap[0].fix, HasSubstr("--spheres"));
}

TEST_F(SrdfRulesTest, SphereOfRadiusZeroDoesNotHideShape) {
  const auto gap = found("srdf.sphere_cover",
                         "<link_sphere_approximation link=\"upper\"><sphere center=\"0 0 0\" "
                         "radius=\"0\"/></link_sphere_approximation>");
  ASSERT_THAT(gap, SizeIs(1));
  EXPECT_THAT(gap[0].message, HasSubstr("no sphere with a radius"));
  EXPECT_THAT(found("srdf.sphere_cover",
                    "<link_sphere_approximation link=\"world\"><sphere center=\"0 0 0\" "
                    "radius=\"0\"/></link_sphere_approximation>"),
              IsEmpty());
}

TEST_F(SrdfRulesTest, TooManySpheresAreSkippedWithNote) {
  std::string spheres;
  for (int i = 0; i < 500; ++i) spheres += "<sphere center=\"0 0 0.05\" radius=\"0.01\"/>";
  srdf(kArm + ("<link_sphere_approximation link=\"upper\">" + spheres) + "</link_sphere_approximation>");
  EXPECT_THAT(rules(), IsEmpty());
  const auto notes = of("audit.skipped");
  ASSERT_THAT(notes, SizeIs(1));
  EXPECT_THAT(notes[0].message, HasSubstr("500 spheres"));
}

TEST_F(SrdfRulesTest, FileOfOtherRobotIsNotJudged) {
  srdf("<passive_joint name=\"wheel\"/>", "other");
  EXPECT_THAT(rules(), IsEmpty());
  srdf(
      "<group name=\"left\"><chain base_link=\"left_base\" tip_link=\"left_lower\"/><joint "
      "name=\"elbow\"/></group>");
  EXPECT_THAT(rules(), IsEmpty());
}

TEST_F(SrdfRulesTest, PackageForMoveItBesideIsRead) {
  name_ = "r_description/urdf/r.urdf";
  options.package_folder = folder_ / "r_description";
  write("r_description/urdf/r.urdf", robot(kFar));
  srdf("<passive_joint name=\"wheel\"/>", "r", "r_moveit_config/config/r.srdf");
  srdf("<passive_joint name=\"wheel\"/>", "r", "moveit_cfgs/arm_moveit_config/config/r.srdf");
  srdf("<passive_joint name=\"wheel\"/>", "r", "unrelated/config/r.srdf");
  write("r_moveit_config/srdf/x.srdf.xacro",
        "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><xacro:property name=\"j\" "
        "value=\"whell\"/><passive_joint name=\"${j}\"/></robot>");
  EXPECT_THAT(of("srdf.unknown_name"), SizeIs(3));
}

TEST_F(SrdfRulesTest, FaultyFileIsNoteAndStopsNothing) {
  write("config/r.srdf", "<robot name=\"r\"><group");
  const auto notes = of("xml.not_well_formed");
  ASSERT_THAT(notes, SizeIs(1));
  EXPECT_EQ(notes[0].severity, Severity::note);
  srdf("<group/><disable_colisions link1=\"a\" link2=\"b\"/>");
  EXPECT_THAT(rules(), SizeIs(2));
}

}  // namespace
}  // namespace doppel
