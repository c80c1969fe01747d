#include "doppel/review/conversion/urdf.h"

#include "conversion_fixture.h"
#include "doppel/base/core/output_file.h"

namespace doppel {
namespace {

RobotDescription read_back(const std::filesystem::path& file) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  return load_description(file, {}, resolver, diagnostics).robot;
}

void expect_same(const Origin& a, const Origin& b) {
  EXPECT_EQ(a.xyz, b.xyz);
  EXPECT_EQ(a.rpy, b.rpy);
}

// The same shapes get the same files, wherever they are referenced from.
void expect_same(const Geometry& a, const Geometry& b) {
  ASSERT_EQ(a.index(), b.index());
  const auto* mesh = std::get_if<MeshGeometry>(&a);
  if (mesh == nullptr) return;
  const auto& other = std::get<MeshGeometry>(b);
  EXPECT_EQ(mesh->scale, other.scale);
  EXPECT_TRUE(std::filesystem::equivalent(mesh->path, other.path)) << other.uri;
  EXPECT_FALSE(other.uri.starts_with("/") || other.uri.starts_with("file:")) << other.uri;
}

void expect_same(const RobotDescription& a, const RobotDescription& b) {
  EXPECT_EQ(a.name, b.name);
  ASSERT_EQ(a.links.size(), b.links.size());
  for (std::size_t i = 0; i < a.links.size(); ++i) {
    const Link &x = a.links[i], &y = b.links[i];
    EXPECT_EQ(x.name, y.name);
    ASSERT_EQ(x.inertial.has_value(), y.inertial.has_value());
    if (x.inertial) {
      EXPECT_EQ(x.inertial->mass, y.inertial->mass);
      EXPECT_EQ(x.inertial->tensor(), y.inertial->tensor());
      expect_same(x.inertial->origin, y.inertial->origin);
    }
    ASSERT_EQ(x.visuals.size(), y.visuals.size());
    for (std::size_t v = 0; v < x.visuals.size(); ++v) {
      expect_same(x.visuals[v].origin, y.visuals[v].origin);
      expect_same(x.visuals[v].geometry, y.visuals[v].geometry);
      ASSERT_EQ(x.visuals[v].material.has_value(), y.visuals[v].material.has_value());
      if (x.visuals[v].material) {
        EXPECT_EQ(x.visuals[v].material->rgba, y.visuals[v].material->rgba);
      }
    }
    ASSERT_EQ(x.collisions.size(), y.collisions.size());
    for (std::size_t c = 0; c < x.collisions.size(); ++c)
      expect_same(x.collisions[c].geometry, y.collisions[c].geometry);
  }
  ASSERT_EQ(a.joints.size(), b.joints.size());
  for (std::size_t i = 0; i < a.joints.size(); ++i) {
    const Joint &x = a.joints[i], &y = b.joints[i];
    EXPECT_EQ(std::tie(x.name, x.type, x.parent, x.child, x.axis),
              std::tie(y.name, y.type, y.parent, y.child, y.axis));
    expect_same(x.origin, y.origin);
    ASSERT_EQ(x.limits.has_value(), y.limits.has_value());
    if (x.limits) {
      EXPECT_EQ(std::tie(x.limits->lower, x.limits->upper, x.limits->effort, x.limits->velocity),
                std::tie(y.limits->lower, y.limits->upper, y.limits->effort, y.limits->velocity));
    }
    ASSERT_EQ(x.mimic.has_value(), y.mimic.has_value());
    if (x.mimic) {
      EXPECT_EQ(std::tie(x.mimic->joint, x.mimic->multiplier, x.mimic->offset),
                std::tie(y.mimic->joint, y.mimic->multiplier, y.mimic->offset));
    }
  }
  EXPECT_EQ(a.hardware.size(), b.hardware.size());
  EXPECT_EQ(a.gazebo.size(), b.gazebo.size());
}

TEST(UrdfTest, RoundTripIsEqual) {
  const auto folder = fresh_folder("urdf");
  for (const char* name : {"omarm_one", "omarm_zero", "lab_arm"}) {
    SCOPED_TRACE(name);
    const Converted converted = bundled(name);
    MeshFiles files({folder, false, std::nullopt});
    write_whole(folder / "robot.urdf", to_urdf(converted.robot, files));
    EXPECT_EQ(files.to_write(), 0u) << "expected no copies unless requested";
    expect_same(converted.robot, read_back(folder / "robot.urdf"));
  }
  const Converted whole = from_text(kWholeRobot);
  MeshFiles files({folder, false, std::nullopt});
  write_whole(folder / "whole.urdf", to_urdf(whole.robot, files));
  expect_same(whole.robot, read_back(folder / "whole.urdf"));
}

TEST(UrdfTest, MeshesAreCopied) {
  const auto folder = fresh_folder("urdf_copies");
  const Converted converted = bundled("omarm_one");
  MeshFiles files({folder / "first", false, "parts"});
  const std::string text = to_urdf(converted.robot, files);
  files.write();
  write_whole(folder / "first" / "robot.urdf", text);
  std::filesystem::rename(folder / "first", folder / "second");
  EXPECT_EQ(text.find(DOPPEL_SOURCE_DIR "/robots/omarm_one/meshes"), std::string::npos);
  const RobotDescription robot = read_back(folder / "second" / "robot.urdf");
  const auto& mesh = std::get<MeshGeometry>(robot.find_link("base_link")->visuals[0].geometry);
  EXPECT_EQ(mesh.uri, "parts/base_link.stl");
  EXPECT_TRUE(std::filesystem::equivalent(mesh.path, folder / "second" / "parts" / "base_link.stl"));
}

TEST(UrdfTest, PackageUrisAreKeptOrCreated) {
  const Converted converted = bundled("omarm_one");
  MeshFiles files({fresh_folder("urdf_package"), true, std::nullopt});
  const std::string text = to_urdf(converted.robot, files);
  EXPECT_NE(text.find("\"package://omarm_description/meshes/base_link.stl\""), std::string::npos);
}

TEST(MeshFilesTest, DifferentFilesOfSameNameAreBothCopied) {
  const auto folder = fresh_folder("mesh_names");
  for (const char* side : {"left", "right"}) {
    std::filesystem::create_directories(folder / side);
    std::ofstream(folder / side / "arm.stl") << side;
  }
  MeshFiles files({folder / "out", false, "meshes"});
  MeshGeometry left{"l", Eigen::Vector3d::Ones(), (folder / "left" / "arm.stl").string()};
  MeshGeometry right{"r", Eigen::Vector3d::Ones(), (folder / "right" / "arm.stl").string()};
  MeshGeometry lost{"package://gone/x.stl", Eigen::Vector3d::Ones(), ""};
  EXPECT_EQ(files.reference(left), "meshes/arm.stl");
  EXPECT_EQ(files.reference(right), "meshes/arm_2.stl");
  EXPECT_EQ(files.reference(left), "meshes/arm.stl");
  EXPECT_EQ(files.reference(lost), "package://gone/x.stl");
  files.write();
  std::string text;
  std::ifstream(folder / "out" / "meshes" / "arm_2.stl") >> text;
  EXPECT_EQ(text, "right");
}

}  // namespace
}  // namespace doppel
