// The keep-out boxes of a world file as markers.
#include <gmock/gmock.h>

#include <fstream>

#include "doppel/ros/messages/visualization_msgs.h"
#include "twin_fixture.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using visualization_msgs::msg::Marker;
using visualization_msgs::msg::MarkerArray;

class KeepOutMarkers : public test::TwinFixture {
 protected:
  MarkerArray markers_of(const std::string& boxes) {
    const std::filesystem::path file = make_folder("keep_out") / "world.yaml";
    std::ofstream(file) << "name: desk\n" << boxes;
    Scenario scenario;
    scenario.robots = {{.target = "omarm_zero"}};
    scenario.world = file;
    bring_up(scenario);
    listen("/doppel/keep_out");
    run(0.01);
    const auto all = received<MarkerArray>("/doppel/keep_out");
    EXPECT_EQ(all.size(), 1u);
    return all.empty() ? MarkerArray{} : all.back();
  }
};

TEST_F(KeepOutMarkers, BoxIsTranslucentCubeWithItsName) {
  const MarkerArray message =
      markers_of("keep_out:\n  - {name: monitor, box: [0.1, 0.6, 0.4], xyz: [0.4, 0, 0.2]}\n");
  ASSERT_EQ(message.markers.size(), 3u);
  EXPECT_EQ(message.markers[0].action, Marker::DELETEALL);
  const Marker& cube = message.markers[1];
  EXPECT_EQ(cube.type, Marker::CUBE);
  EXPECT_EQ(cube.ns, "keep_out");
  EXPECT_EQ(cube.text, "monitor");
  EXPECT_THAT((std::vector<double>{cube.scale.x, cube.scale.y, cube.scale.z}), ElementsAre(0.1, 0.6, 0.4));
  EXPECT_DOUBLE_EQ(cube.pose.position.x, 0.4);
  EXPECT_LT(cube.color.a, 0.5F);
  const Marker& name = message.markers[2];
  EXPECT_EQ(name.type, Marker::TEXT_VIEW_FACING);
  EXPECT_EQ(name.text, "monitor");
  EXPECT_GT(name.pose.position.z, 0.4) << "above the box";
}

TEST_F(KeepOutMarkers, WorldWithoutBoxesHasNoMarkers) {
  EXPECT_EQ(markers_of("ground: true\n").markers.size(), 1u);
}

}  // namespace
}  // namespace doppel
