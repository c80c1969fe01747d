#include <gtest/gtest.h>

#include "doppel/session/live/served_files.h"

namespace doppel {
namespace {

TEST(DescriptionFiles, FilesAreTakenFromDescription) {
  RobotDescription robot;
  robot.source = make_location("/robots/arm/urdf/arm.urdf", 1, 1);
  Link link;
  Visual visual;
  MeshGeometry mesh;
  mesh.uri = "package://arm/a.dae";
  mesh.path = "/robots/arm/x/../a.dae";
  visual.geometry = mesh;
  visual.material.emplace().texture = "package://arm/t.png";
  link.visuals = {visual};
  Collision missing;
  mesh.path = "";  // it was not found
  missing.geometry = mesh;
  link.collisions = {missing, {}};
  robot.links = {link};
  const RobotFiles files = files_of(robot);
  EXPECT_EQ(files.description, "/robots/arm/urdf/arm.urdf");
  ASSERT_EQ(files.meshes.size(), 1u) << "expected only the mesh that was found";
  EXPECT_EQ(files.meshes[0].file, "/robots/arm/a.dae");
  EXPECT_EQ(files.textures, std::vector<std::string>{"package://arm/t.png"});
}

}  // namespace
}  // namespace doppel
