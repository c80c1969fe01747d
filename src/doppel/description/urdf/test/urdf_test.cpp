#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "doppel/description/meshes/mesh.h"
#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

RobotDescription parse(const std::string& body, Diagnostics& diagnostics) {
  PackageResolver resolver;
  return parse_urdf("<robot name=\"r\">\n" + body + "</robot>", "r.urdf", resolver, diagnostics);
}

std::string error_of(const std::string& body) {
  Diagnostics diagnostics;
  try {
    parse(body, diagnostics);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

const std::string kPair = "<link name=\"a\"/><link name=\"b\"/>";
std::string joint(const std::string& inner,
                  const std::string& ends = "<parent link=\"a\"/><child link=\"b\"/>") {
  return "<joint name=\"j\" type=\"revolute\">" + ends + inner + "</joint>";
}

TEST(Urdf, FileContentIsKept) {
  Diagnostics diagnostics;
  const RobotDescription robot = parse(
      "<material name=\"blue\"><color rgba=\"0 0 1 1\"/></material>"
      "<link name=\"a\"><visual><geometry><box size=\"1 2 3\"/></geometry><material "
      "name=\"blue\"/></visual></link><link name=\"b\"/>" +
          joint("<origin xyz=\"1 2 3\" rpy=\"0.1 0.2 0.3\"/><axis xyz=\"0 0 2\"/><limit lower=\"-1\" "
                "upper=\"2\" effort=\"3\" velocity=\"4\"/>"
                "<dynamics damping=\"0.5\" friction=\"0.25\"/><safety_controller k_velocity=\"10\"/>") +
          "<ros2_control name=\"s\" type=\"system\"><hardware><plugin> p/Q </plugin><param "
          "name=\"port\">1</param></hardware>"
          "<joint name=\"j\"><command_interface name=\"position\"><param "
          "name=\"min\">-1</param></command_interface>"
          "<state_interface name=\"position\"><param "
          "name=\"initial_value\">0.5</param></state_interface></joint></ros2_control>"
          "<gazebo reference=\"a\"><mu1>0.3</mu1></gazebo><odd/>",
      diagnostics);
  EXPECT_EQ(robot.links[0].visuals[0].material->rgba, Eigen::Vector4d(0, 0, 1, 1));
  const Joint& j = robot.joints[0];
  EXPECT_EQ(j.axis, Eigen::Vector3d(0, 0, 2));
  EXPECT_EQ(j.limits->velocity, 4.0);
  EXPECT_EQ(j.dynamics->friction, 0.25);
  EXPECT_EQ(j.safety->k_velocity, 10.0);
  EXPECT_EQ(robot.hardware[0].plugin, "p/Q");
  EXPECT_EQ(robot.hardware[0].joints[0].state_interfaces[0].initial_value, 0.5);
  EXPECT_EQ(robot.hardware[0].joints[0].command_interfaces[0].min, -1.0);
  EXPECT_EQ(robot.gazebo[0].surface.mu, 0.3);
  EXPECT_EQ(robot.unknown.size(), 1u);
  EXPECT_EQ(j.source.place(), "r.urdf:2:175");
}

TEST(Urdf, SdfFileIsRefusedWithWhatToWrite) {
  Diagnostics diagnostics;
  PackageResolver resolver;
  try {
    parse_urdf("<sdf version=\"1.9\"><model name=\"m\"/></sdf>", "m.sdf", resolver, diagnostics);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--world FILE"), std::string::npos) << error.what();
  }
}

TEST(Urdf, NonTreeIsRefusedWithPlace) {
  EXPECT_NE(error_of(kPair).find("2 root links, 'a', 'b'"), std::string::npos);
  EXPECT_NE(error_of(kPair + joint("") +
                     "<joint name=\"k\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint>")
                .find("loop"),
            std::string::npos);
  EXPECT_NE(error_of(kPair + joint("", "<parent link=\"a\"/><child link=\"bb\"/>")).find("did you mean 'b'"),
            std::string::npos);
  EXPECT_NE(error_of(kPair + "<link name=\"a\"/>" + joint("")).find("two links named 'a'"),
            std::string::npos);
}

TEST(Urdf, BadNumbersAreRefusedTogether) {
  const std::string text =
      error_of(kPair + joint("<limit lower=\"1,5\" upper=\"nan\" effort=\"3\" velocity=\"4\"/>"));
  EXPECT_NE(text.find("lower=\"1,5\""), std::string::npos) << text;
  EXPECT_NE(text.find("upper=\"nan\""), std::string::npos) << text;
  EXPECT_NE(
      error_of(kPair + "<joint name=\"j\" type=\"revolut\"><parent link=\"a\"/><child link=\"b\"/></joint>")
          .find("did you mean 'revolute'"),
      std::string::npos);
}

TEST(Urdf, BrokenXmlNamesOpenElement) {
  EXPECT_NE(error_of("<link name=\"a\">\n").find("<link>, opened at line 2, column 1"), std::string::npos);
}

class MeshFilesTest : public ::testing::Test {
 protected:
  MeshFilesTest() : folder_(fs::temp_directory_path() / ("doppel_files_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_ / "my_pkg/meshes");
    fs::create_directories(folder_ / "my_pkg/urdf");
    std::ofstream(folder_ / "my_pkg/package.xml") << "<package><name>my_pkg</name></package>";
    std::ofstream(folder_ / "my_pkg/meshes/a.stl")
        << "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1000 0 0\nvertex 0 1000 "
           "0\nendloop\nendfacet\nendsolid s\n";
  }
  ~MeshFilesTest() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(MeshFilesTest, MeshesAreFoundByEveryUriScheme) {
  PackageResolver resolver;
  const fs::path base = folder_ / "my_pkg/urdf";
  resolver.add_context(base);
  const std::string wanted = (folder_ / "my_pkg/meshes/a.stl").string();
  for (const std::string& uri :
       {std::string("package://my_pkg/meshes/a.stl"), std::string("model://my_pkg/meshes/a.stl"),
        "file://" + wanted, "file:///" + wanted, std::string("../meshes/a.stl"), wanted}) {
    EXPECT_EQ(resolver.resolve(uri, base).path.lexically_normal().string(), wanted) << uri;
  }
  const auto missing = resolver.resolve("package://my_pkg/meshes/b.stl", base);
  EXPECT_TRUE(missing.path.empty());
  EXPECT_FALSE(missing.tried.empty());
  EXPECT_NE(missing.nearest.find("a.stl"), std::string::npos);
  EXPECT_EQ(resolver.find_package("my_pgk").nearest, "my_pkg");
}

TEST_F(MeshFilesTest, MeshesAreScaledWeldedAndOriented) {
  const std::string file = (folder_ / "my_pkg/meshes/a.stl").string();
  const TriangleMesh mesh = load_mesh(file, {0.001, 0.001, 0.001});
  EXPECT_EQ(mesh.vertices.size(), 3u);
  EXPECT_FLOAT_EQ(mesh.bounds().max().x(), 1.0f);
  const TriangleMesh mirrored = load_mesh(file, {-0.001, 0.001, 0.001});
  const auto normal_z = [](const TriangleMesh& m) {
    const auto& t = m.triangles[0];
    return (m.vertices[t[1]] - m.vertices[t[0]]).cross(m.vertices[t[2]] - m.vertices[t[0]]).z();
  };
  EXPECT_GT(normal_z(mesh), 0);
  EXPECT_GT(normal_z(mirrored), 0);
  EXPECT_THROW(load_mesh((folder_ / "my_pkg/package.xml").string(), {1, 1, 1}), InputError);
}

}  // namespace
}  // namespace doppel
