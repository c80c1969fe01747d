// The meshes of the world announced to clients can be fetched: each marker's resource, at the start and after
// a reload.
#include "doppel/session/live/served_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "doppel/ros/messages/visualization_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

namespace fs = std::filesystem;
using visualization_msgs::msg::Marker;
using visualization_msgs::msg::MarkerArray;

class ServedFilesTest : public TwinFixture {
 protected:
  void SetUp() override {
    folder_ = make_folder("offered");
    fs::create_directories(folder_ / "meshes");
    fs::copy_file(robot_ / "meshes/base_link.stl", folder_ / "meshes/table top.stl");
    std::ofstream(folder_ / "world.yaml")
        << "objects:\n"
           "  - {name: beside, mesh: {uri: meshes/table top.stl}, xyz: [1, 0, 0]}\n"
           "  - {name: packed, mesh: {uri: 'package://omarm_one/meshes/base_ballast.stl'}, xyz: [2, 0, 0]}\n"
           "  - {name: box, box: [0.1, 0.1, 0.1], xyz: [3, 0, 0]}\n";
    Scenario scenario;
    scenario.robots = {{.target = "omarm_one"}};
    scenario.world = folder_ / "world.yaml";
    bring_up(scenario);
    library_.offer(served_files());
  }
  void TearDown() override {
    edge_.reset();
    twin_.reset();
    fs::remove_all(folder_);
  }

  [[nodiscard]] RobotFiles served_files() const {
    return doppel::served_files(twin_->engine().world().instances());
  }
  std::string spawn(const std::string& name, const std::string& uri) {
    return call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
                fmt::format("{{name: {0}, xml: \"<sdf version='1.7'><model name='{0}'><static>true</static>"
                            "<link name='l'><collision name='c'><geometry><mesh><uri>{1}</uri></mesh>"
                            "</geometry></collision></link></model></sdf>\"}}",
                            name, uri));
  }
  // Each of the present meshes, which must be `expected`, can be fetched.
  void expect_all_can_be_had(const std::vector<std::string>& expected) {
    listen("/doppel/objects");
    run(0.1);
    for (MarkerArray& markers : received<MarkerArray>("/doppel/objects")) objects_ = std::move(markers);
    std::vector<std::string> meshes;
    for (const Marker& marker : objects_.markers) {
      if (marker.type != Marker::MESH_RESOURCE || marker.action != Marker::ADD) continue;
      meshes.push_back(marker.text);
      EXPECT_EQ(library_.read(marker.mesh_resource).why, "") << marker.text;
    }
    EXPECT_EQ(meshes, expected);
  }

  const fs::path robot_ = DOPPEL_SOURCE_DIR "/robots/omarm_one";
  fs::path folder_;
  AssetLibrary library_;
  MarkerArray objects_;  // last
};

TEST_F(ServedFilesTest, WorldMeshesAreServed) {
  expect_all_can_be_had({"beside", "packed"});
  EXPECT_NE(library_.read("file://" + (folder_ / "world.yaml").string()).why, "");
  EXPECT_EQ(library_.read("file://" + (robot_ / "package.xml").string()).bytes, nullptr);
}

TEST_F(ServedFilesTest, SpawnedMeshesAreServedAfterReload) {
  EXPECT_THAT(spawn("p", "package://omarm_one/meshes/base_electronics.stl"),
              ::testing::HasSubstr("success: true"));
  EXPECT_THAT(spawn("f", "file://" + (robot_ / "meshes/base_link.stl").string()),
              ::testing::HasSubstr("success: true"));
  expect_all_can_be_had({"beside", "packed", "p", "f"});
  Diagnostics said;
  const auto fresh = Twin::prepare(twin_->running(), said);
  library_.offer(both(doppel::served_files(Twin::instances(*fresh)), served_files()));
  twin_->replace(fresh);
  expect_all_can_be_had({"beside", "packed", "p", "f"});
  library_.offer(served_files());
  expect_all_can_be_had({"beside", "packed", "p", "f"});
}

}  // namespace
}  // namespace doppel::test
