#include "doppel/description/srdf/srdf.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

namespace doppel {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::string seed() {
  std::ifstream file(std::string(DOPPEL_SOURCE_DIR) + "/src/doppel/description/srdf/fuzz/corpus/srdf/arm");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

class SrdfTest : public testing::Test {
 protected:
  SrdfDescription read(const std::string& text) {
    diagnostics = {};
    return read_srdf(parse_xml(text, "arm.srdf"), diagnostics);
  }
  SrdfDescription read_inside(const std::string& elements) {
    return read("<robot name=\"r\">\n" + elements + "\n</robot>");
  }
  [[nodiscard]] std::string only_message() const {
    return diagnostics.all().size() == 1 ? diagnostics.all().front().str()
                                         : std::to_string(diagnostics.all().size()) + " diagnostics";
  }
  Diagnostics diagnostics;
};

TEST_F(SrdfTest, EveryElementIsRead) {
  const SrdfDescription srdf = read(seed());
  EXPECT_THAT(diagnostics.all(), IsEmpty());
  EXPECT_EQ(srdf.robot, "arm");
  ASSERT_THAT(srdf.groups, SizeIs(3));
  EXPECT_EQ(srdf.groups[0].chains.at(0).tip_link, "tool");
  EXPECT_EQ(srdf.groups[1].joints.at(0).name, "finger");
  EXPECT_EQ(srdf.groups[1].links.at(0).name, "palm");
  EXPECT_EQ(srdf.groups[2].groups.at(1).name, "hand");
  EXPECT_EQ(srdf.groups[2].source.line, 5);
  ASSERT_THAT(srdf.states, SizeIs(1));
  EXPECT_THAT(srdf.states[0].values.at(1).values, ElementsAre(0, 0, 1, 0, 0, 0, 1));
  EXPECT_EQ(srdf.end_effectors.at(0).parent_group, "arm");
  EXPECT_EQ(srdf.virtual_joints.at(0).parent_frame, "world");
  EXPECT_EQ(srdf.passive_joints.at(0).name, "caster");
  EXPECT_EQ(srdf.properties.at(0).property, "angular_distance_weight");
  EXPECT_EQ(srdf.spheres.at(0).spheres.at(0).center.z(), 0.1);
  EXPECT_EQ(srdf.unchecked_links.at(0).name, "cable");
  EXPECT_EQ(srdf.enabled.at(0).link2, "base");
  EXPECT_EQ(srdf.disabled.at(0).reason, "Adjacent");
  EXPECT_EQ(srdf.find_group("hand"), &srdf.groups[1]);
  EXPECT_EQ(srdf.find_group("leg"), nullptr);
}

TEST_F(SrdfTest, WrittenTextReadsAsSame) {
  const std::string first = write_srdf(read(seed()));
  EXPECT_EQ(write_srdf(read(first)), first);
  EXPECT_THAT(diagnostics.all(), IsEmpty());
  EXPECT_THAT(first, HasSubstr("<sphere center=\"0 0 0.1\" radius=\"0.05\"/>"));
}

TEST_F(SrdfTest, FaultyElementIsLeftOutWithPlace) {
  const auto kept = [this](const std::string& element) {
    const SrdfDescription srdf = read_inside(element + "\n<group name=\"g\"/>");
    EXPECT_THAT(srdf.groups, SizeIs(1)) << element;
    EXPECT_THAT(only_message(), AllOf(HasSubstr("arm.srdf:2:"), HasSubstr("[srdf.element]"))) << element;
    return srdf;
  };
  EXPECT_THAT(kept("<group_state group=\"g\"/>").states, IsEmpty());
  EXPECT_THAT(kept("<virtual_joint name=\"v\" type=\"fixd\" parent_frame=\"world\" child_link=\"b\"/>")
                  .virtual_joints,
              IsEmpty());
  EXPECT_THAT(only_message(), HasSubstr("did you mean 'fixed'?"));
  EXPECT_THAT(kept("<end_effector name=\"e\" group=\"g\"/>").end_effectors, IsEmpty());
  EXPECT_THAT(kept("<disable_collisions link1=\"a\"/>").disabled, IsEmpty());
  EXPECT_THAT(kept("<passive_joint/>").passive_joints, IsEmpty());
  EXPECT_THAT(kept("<joint_property joint_name=\"j\" value=\"1\"/>").properties, IsEmpty());
  const std::string state = "<group_state name=\"s\" group=\"g\"><joint name=\"j\" value=\"";
  EXPECT_THAT(kept(state + "0,5\"/></group_state>").states.at(0).values, IsEmpty());
  EXPECT_THAT(kept(state + "nan\"/></group_state>").states.at(0).values, IsEmpty());
  const std::string cover = "<link_sphere_approximation link=\"l\"><sphere center=\"0 0 0\" radius=\"";
  EXPECT_THAT(kept(cover + "-1\"/></link_sphere_approximation>").spheres, IsEmpty());
}

TEST_F(SrdfTest, UnknownNameHasNearest) {
  read_inside("<disable_colisions link1=\"a\" link2=\"b\"/>");
  EXPECT_THAT(only_message(), AllOf(HasSubstr("did you mean 'disable_collisions'?"),
                                    HasSubstr("[srdf.unknown]"), HasSubstr("arm.srdf:2:1")));
  read_inside("<group name=\"g\"><chain base_lnk=\"a\" base_link=\"a\" tip_link=\"b\"/></group>");
  EXPECT_THAT(only_message(), HasSubstr("did you mean 'base_link'?"));
  read_inside("<group name=\"g\"><group name=\"a\" kind=\"b\"/></group>");
  EXPECT_THAT(only_message(), HasSubstr("<group> has no attribute 'kind'"));
}

TEST_F(SrdfTest, OtherRootIsRefused) {
  EXPECT_THROW(read("<robots name=\"r\"/>"), InputError);
}

}  // namespace
}  // namespace doppel
