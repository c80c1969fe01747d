// Labels of visuals by Gazebo's Label plugin, written in URDF and in SDF.
#include "doppel/description/gazebo/label_plugin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/description/urdf/load.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Labels = std::vector<std::optional<std::uint16_t>>;

std::string label(const std::string& value, const std::string& file = "gz-sim-label-system") {
  return "<plugin filename='" + file + "' name='n'><label>" + value + "</label></plugin>";
}
std::string visual(const std::string& name, const std::string& inner = "") {
  return "<visual name='" + name + "'><geometry><box size='1 1 1'/></geometry>" + inner + "</visual>";
}

struct OfUrdf {
  Diagnostics diagnostics;
  Labels base, head;

  explicit OfUrdf(const std::string& gazebo) {
    PackageResolver resolver;
    Diagnostics of_urdf;
    const RobotDescription robot = parse_urdf(
        "<robot name='r'><link name='base'>" + visual("a") + visual("b") + "</link><link name='head'>" +
            visual("a") + "</link><joint name='j' type='fixed'><parent link='base'/>" +
            "<child link='head'/></joint>\n" + gazebo + "</robot>",
        "r.urdf", resolver, of_urdf);
    const VisualLabels labels(robot, diagnostics);
    base = labels.of(robot.links[0]);
    head = labels.of(robot.links[1]);
  }
};

std::string on(const std::string& link, const std::string& inner) {
  return "<gazebo reference='" + link + "'>" + inner + "</gazebo>";
}

TEST(LabelPlugin, LabelOfModelIsThatOfAllItsVisuals) {
  const OfUrdf read("<gazebo>" + label("7", "libignition-gazebo-label-system.so") + "</gazebo>");
  EXPECT_THAT(read.base, ElementsAre(7, 7));
  EXPECT_THAT(read.head, ElementsAre(7));
}

TEST(LabelPlugin, MostSpecificPlaceWinsInAnyOrder) {
  const std::string model = "<gazebo>" + label("1") + "</gazebo>", link = on("base", label("2")),
                    all = on("base", "<visual>" + label("3") + "</visual>"),
                    one = on("base", "<visual name='b'>" + label("4") + "</visual>");
  EXPECT_THAT(OfUrdf(model + link).base, ElementsAre(2, 2));
  EXPECT_THAT(OfUrdf(link + model).base, ElementsAre(2, 2));
  EXPECT_THAT(OfUrdf(all + link + model).base, ElementsAre(3, 3));
  EXPECT_THAT(OfUrdf(one + model + all + link).base, ElementsAre(3, 4));
  EXPECT_THAT(OfUrdf(one).base, ElementsAre(std::nullopt, 4));
  EXPECT_THAT(OfUrdf(one + model).head, ElementsAre(1));
}

TEST(LabelPlugin, LabelZeroIsBackgroundWithinLabelledModel) {
  const OfUrdf read("<gazebo>" + label("1") + "</gazebo>" + on("head", label("0")));
  EXPECT_THAT(read.base, ElementsAre(1, 1));
  EXPECT_THAT(read.head, ElementsAre(std::nullopt));
}

TEST(LabelPlugin, LabelThatIsNoNumberIsReportedAtItsPlugin) {
  const OfUrdf read("<gazebo>" + label("1") + "</gazebo>" + on("base", "\n" + label("256")));
  EXPECT_THAT(read.base, ElementsAre(1, 1)) << "as if it were not written";
  ASSERT_EQ(read.diagnostics.all().size(), 1U);
  EXPECT_THAT(read.diagnostics.all()[0].str(), HasSubstr("r.urdf:3:1"));
  EXPECT_THAT(read.diagnostics.all()[0].str(), HasSubstr("'256' is not a number from 0 to 255"));
}

TEST(LabelPlugin, VisualLinkAndModelOfSdfHaveTheirLabels) {
  const std::string box = "<geometry><box><size>1 1 1</size></box></geometry>";
  Diagnostics diagnostics;
  PackageResolver resolver;
  const SdfWorld world =
      parse_sdf("<sdf version='1.9'><world name='w'><model name='m'>" + label("1") + "<link name='base'>" +
                    label("2", "ignition-gazebo-label-system") + "<visual name='a'>" + box +
                    "</visual><visual name='b'>" + box + label("3") +
                    "</visual></link><link name='head'><visual name='a'>" + box + label("0") +
                    "</visual></link><link name='hand'><visual name='b'>" + box + "</visual></link>" +
                    "<joint name='j' type='fixed'><parent>base</parent><child>head</child></joint>" +
                    "<joint name='k' "
                    "type='fixed'><parent>base</parent><child>hand</child></joint></model></world></sdf>",
                "w.sdf", std::filesystem::path(), resolver, diagnostics);
  const RobotDescription& robot = *world.models.at(0).description;
  const VisualLabels labels(robot, diagnostics);
  EXPECT_THAT(labels.of(*robot.find_link("base")), ElementsAre(2, 3));
  EXPECT_THAT(labels.of(*robot.find_link("head")), ElementsAre(std::nullopt));
  EXPECT_THAT(labels.of(*robot.find_link("hand")), ElementsAre(1));
  for (const Diagnostic& d : diagnostics.all())
    EXPECT_EQ(d.str().find("plugin"), std::string::npos) << d.str();
}

}  // namespace
}  // namespace doppel
