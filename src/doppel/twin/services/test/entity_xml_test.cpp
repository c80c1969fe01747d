#include "doppel/twin/services/detail/entity_xml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "doppel/twin/spawn/entity_mesh.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

fs::path any_mesh(const std::string& uri) {
  return "/found/" + uri;
}

EntityText read(const std::string& xml) {
  Diagnostics notes;
  return read_entity_xml(xml, any_mesh, notes);
}

// The only link of the only model of an SDF.
const SdfModel& model_of(const EntityText& entity) {
  return std::get<std::vector<SdfModel>>(entity.made_of).at(0);
}
const Link& link_of(const EntityText& entity) {
  return model_of(entity).description->links.at(0);
}

std::string error_of(const std::string& xml) {
  try {
    read(xml);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string model(const std::string& inside) {
  return "<sdf version='1.7'><model name='m'>" + inside + "</model></sdf>";
}
std::string link_model(const std::string& geometry, const std::string& more = "") {
  return model("<link name='l'>" + more + "<collision name='c'><geometry>" + geometry +
               "</geometry></collision></link>");
}
const std::string kBall = "<sphere><radius>0.05</radius></sphere>";

TEST(EntityXml, SdfModelIsRead) {
  const EntityText crate = read(
      "<sdf version='1.7'><model name='crate'><pose>1 2 3 0 0 0.5</pose><link name='l'>"
      "<pose>0 0 0.1 0 0 0</pose><inertial><mass>0.4</mass></inertial>"
      "<collision name='c'><pose>0 0 0.01 0 0 0</pose><geometry><box><size>0.1 0.2 "
      "0.3</size></box></geometry>"
      "<surface><friction><ode><mu>1.2</mu></ode></friction></surface></collision>"
      "<visual name='v'><geometry><box><size>0.1 0.2 0.3</size></box></geometry>"
      "<material><diffuse>0.9 0.8 0.1 1</diffuse></material></visual></link></model></sdf>");
  EXPECT_EQ(crate.name, "crate");
  const Collision& box = link_of(crate).collisions.at(0);
  EXPECT_EQ(std::get<Box>(box.geometry).size, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(box.surface.mu, 1.2);
  EXPECT_NEAR(box.origin.xyz.z(), 0.01, 1e-12);
  EXPECT_EQ(link_of(crate).inertial->mass, 0.4);
  EXPECT_EQ(link_of(crate).visuals.at(0).material->rgba, Eigen::Vector4d(0.9, 0.8, 0.1, 1));
  const Pose X_WM = make_pose({1, 2, 3}, {0, 0, 0.5});
  EXPECT_TRUE(model_of(crate).X_WR.isApprox(X_WM * make_pose({0, 0, 0.1}, {0, 0, 0}), 1e-12));
  EXPECT_TRUE((model_of(crate).X_WR * model_of(crate).X_RM).isApprox(X_WM, 1e-12));
}

TEST(EntityXml, InstanceStandsWhereItIsSent) {
  Diagnostics notes;
  const EntityText ball = read(link_model(kBall, "<pose>0 0 1 0 0 0</pose>"));
  const auto made = instances_of(ball, "other", make_pose({1, 0, 0}, {0, 0, 0}), notes);
  ASSERT_EQ(made.size(), 1u);
  EXPECT_EQ(made[0].name, "other");
  EXPECT_EQ(Eigen::Vector3d(made[0].q0.head<3>()), Eigen::Vector3d(1, 0, 1));
  EXPECT_TRUE(made[0].is_object());
}

TEST(EntityXml, ModelWithJointIsOneInstance) {
  Diagnostics notes;
  const std::string shape = "<collision name='c'><geometry>" + kBall + "</geometry></collision>";
  const EntityText door =
      read(model("<link name='a'>" + shape + "</link><link name='b'>" + shape +
                 "</link><joint name='j' type='revolute'><parent>a</parent><child>b</child>"
                 "<axis><xyz>0 0 1</xyz></axis></joint>"));
  EXPECT_EQ(instances_of(door, "door", Pose::Identity(), notes).size(), 1u);
  const EntityText loose =
      read(model("<link name='a'>" + shape + "</link><link name='b'>" + shape + "</link>"));
  const auto two = instances_of(loose, "two", Pose::Identity(), notes);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[1].name, "two::b");
}

TEST(EntityXml, StaticHasNoMassAndNoInertialWeighsOneKilogram) {
  const EntityText fixed = read(model("<static>true</static><link name='l'><collision name='c'><geometry>" +
                                      kBall + "</geometry></collision></link>"));
  EXPECT_TRUE(model_of(fixed).is_static);
  EXPECT_EQ(link_of(read(link_model(kBall))).inertial->mass, 1.0);
}

TEST(EntityXml, UrdfModelIsRead) {
  const EntityText text = read(
      "<robot name='ball'><material name='red'><color rgba='1 0 0 1'/></material><link name='l'>"
      "<inertial><mass value='0.1'/></inertial><visual><geometry><sphere radius='0.03'/></geometry>"
      "<material name='red'/></visual><collision><origin xyz='0 0 0.03'/><geometry><sphere radius='0.03'/>"
      "</geometry></collision></link></robot>");
  EXPECT_EQ(text.name, "ball");
  const auto& ball = std::get<WorldObject>(text.made_of);
  EXPECT_EQ(ball.mass, 0.1);
  EXPECT_EQ(std::get<Sphere>(ball.shape).radius, 0.03);
  EXPECT_EQ(ball.rgba, Eigen::Vector4d(1, 0, 0, 1));
  EXPECT_NEAR(ball.X_OS.translation().z(), 0.03, 1e-12);
  const EntityText fixed = read(
      "<robot name='r'><link name='l'><visual><geometry><box size='1 1 "
      "1'/></geometry></visual></link></robot>");
  EXPECT_EQ(std::get<WorldObject>(fixed.made_of).mass, 0.0) << "expected a fixed entity: it has no inertia";
}

TEST(EntityXml, UrdfInertiaIsKept) {
  const EntityText text = read(
      "<robot name='rod'><link name='l'><inertial><origin xyz='0 0 0.4'/><mass value='2'/>"
      "<inertia ixx='0.3' ixy='0' ixz='0' iyy='0.3' iyz='0' izz='0.01'/></inertial>"
      "<collision><geometry><cylinder radius='0.05' length='1'/></geometry></collision></link></robot>");
  EXPECT_EQ(text.name, "rod");
  EXPECT_EQ(model_of(text).base, BaseKind::floating);
  Diagnostics notes;
  const auto made = instances_of(text, "my_rod", make_pose({0, 0, 1}, {0, 0, 0}), notes);
  ASSERT_EQ(made.size(), 1u);
  EXPECT_TRUE(notes.all().empty());
  EXPECT_TRUE(made[0].is_object());
  const MassProperties& inertia = *made[0].model->links[1].inertia;
  EXPECT_EQ(inertia.mass, 2.0);
  EXPECT_NEAR(inertia.com.z(), 0.4, 1e-12);
  EXPECT_NEAR(made[0].q0[2], 1.0, 1e-12);
}

const std::string kTable =
    "<robot name='table'><link name='top'><inertial><mass value='5'/><inertia ixx='0.3' ixy='0' ixz='0' "
    "iyy='0.3' iyz='0' izz='0.3'/></inertial><collision><geometry><box size='1 1 0.05'/></geometry>"
    "</collision></link><link name='leg'><collision><geometry><box size='0.1 0.1 0.7'/></geometry>"
    "</collision></link><joint name='j' type='fixed'><parent link='top'/><child link='leg'/>"
    "<origin xyz='0 0 -0.35'/></joint>MORE</robot>";

std::string table(const std::string& more = "") {
  std::string out = kTable;
  return out.replace(out.find("MORE"), 4, more);
}

TEST(EntityXml, UrdfOfFixedJointsIsLooseObject) {
  EXPECT_EQ(robot_in_xml(table()), "");
  const EntityText text = read(table());
  EXPECT_EQ(model_of(text).base, BaseKind::floating);
  Diagnostics notes;
  const auto made = instances_of(text, "table", Pose::Identity(), notes);
  ASSERT_EQ(made.size(), 1u);
  EXPECT_TRUE(made[0].is_object());
  EXPECT_TRUE(made[0].floating());
  std::size_t shapes = 0;
  for (const auto& of_link : made[0].shapes) shapes += of_link.size();
  EXPECT_EQ(shapes, 2u);
}

TEST(EntityXml, WhatActsIsRobot) {
  EXPECT_EQ(robot_in_xml(table("<link name='d'/><joint name='k' type='revolute'><parent link='top'/>"
                               "<child link='d'/></joint>")),
            "table");
  EXPECT_EQ(robot_in_xml(table("<gazebo reference='top'><sensor name='s' type='camera'/></gazebo>")),
            "table");
  EXPECT_EQ(robot_in_xml(table("<gazebo reference='top'><mu1>0.3</mu1></gazebo>")), "");
}

TEST(EntityXml, BaseIsThatOfItsElement) {
  EXPECT_EQ(base_in_xml(table()), std::nullopt);
  EXPECT_EQ(base_in_xml(table("<gazebo><doppel:base>fixed</doppel:base></gazebo>")), BaseKind::fixed);
  EXPECT_EQ(model_of(read(table("<gazebo><doppel:base>fixed</doppel:base></gazebo>"))).base, BaseKind::fixed);
  EXPECT_THAT(error_of(table("<gazebo><doppel:base>loose</doppel:base></gazebo>")),
              HasSubstr("it can be fixed or floating"));
}

TEST(EntityXml, MeshIsRequested) {
  const EntityText part =
      read(link_model("<mesh><uri>package://p/a.stl</uri><scale>0.001 0.001 0.001</scale></mesh>"));
  const auto& mesh = std::get<MeshGeometry>(link_of(part).collisions.at(0).geometry);
  EXPECT_EQ(mesh.path, "/found/package://p/a.stl");
  EXPECT_EQ(mesh.uri, "package://p/a.stl");
  EXPECT_EQ(mesh.scale.x(), 0.001);
}

TEST(EntityXml, InvalidModelIsRefusedWithPlace) {
  EXPECT_THAT(error_of("<sdf><model"), HasSubstr("xml:1"));
  EXPECT_THAT(error_of(""), Not(HasSubstr("accepted")));
  EXPECT_THAT(error_of("<world/>"), HasSubstr("neither <sdf> nor <robot>"));
  EXPECT_THAT(error_of("<sdf version='1.7'/>"), HasSubstr("neither a <world> nor a <model>"));
  EXPECT_THAT(error_of("<sdf version='1.7'><world name='w'/></sdf>"), HasSubstr("this is a world"));
  EXPECT_THAT(error_of(model("")), HasSubstr("0 models"));
  EXPECT_THAT(
      error_of("<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='fixed'/></robot>"),
      HasSubstr("one link"));
  EXPECT_THAT(error_of(model("<link name='a'/>")), HasSubstr("no shape"));
  EXPECT_THAT(error_of(link_model("<sphre><radius>1</radius></sphre>")), HasSubstr("no shape"));
  EXPECT_THAT(error_of(link_model("<box><size>0.1 0.1</size></box>")), HasSubstr("must be 3 numbers"));
  EXPECT_THAT(error_of(link_model("<box><size>0.1 0.1 nan</size></box>")), HasSubstr("nan'"));
  EXPECT_THAT(error_of(link_model("<box><size>0.1 0.1 0</size></box>")), HasSubstr("the side is 0 m"));
  EXPECT_THAT(error_of(link_model("<sphere><radius>-1</radius></sphere>")), HasSubstr("radius"));
  EXPECT_THAT(error_of(link_model("<sphere><radius>1e9</radius></sphere>")), HasSubstr("radius"));
  EXPECT_THAT(error_of(link_model("<cone><radius>1</radius><length>1e9</length></cone>")),
              HasSubstr("length"));
  EXPECT_THAT(error_of(link_model(kBall, "<inertial><mass>-0.1</mass></inertial>")),
              HasSubstr("the mass is -0.1 kg"));
  EXPECT_THAT(error_of(link_model(kBall, "<inertial><mass>inf</mass></inertial>")),
              HasSubstr("the mass is inf"));
  EXPECT_THAT(error_of(link_model(kBall, "<pose>0 0 1e300 0 0 0</pose>")), HasSubstr("distance"));
  EXPECT_THAT(error_of("<robot name='r'><link name='l'><collision><geometry><sphere radius='x'/></geometry>"
                       "</collision></link></robot>"),
              HasSubstr("radius=\"x\""));
  const auto turned = [](const char* origin) {
    return fmt::format(
        "<robot name='r'><link name='l'><collision><origin {}/><geometry><sphere radius='1'/>"
        "</geometry></collision></link></robot>",
        origin);
  };
  EXPECT_THAT(error_of(turned("quat_xyzw='0 0 1'")), HasSubstr("not four finite numbers"));
  EXPECT_THAT(error_of(turned("quat_xyzw='0 0 0 0'")), HasSubstr("not four finite numbers"));
  EXPECT_THAT(error_of(turned("quat_xyzw='0 0 1 0' rpy='0 0 1'")), HasSubstr("both rpy and quat_xyzw"));
  EXPECT_THAT(error_of(turned("quat_xyzw='0 0 2 0'")), HasSubstr("accepted"));
  EXPECT_THAT(error_of(std::string(std::size_t{2} << 20, ' ')), HasSubstr("at most"));
}

TEST(EntityXml, IgnoredElementsAreNoted) {
  Diagnostics notes;
  read_entity_xml(model("<plugin name='p' filename='f'/><link name='l'><sensor name='s'/><collision name='c'>"
                        "<geometry>" +
                        kBall + "</geometry></collision></link>"),
                  any_mesh, notes);
  std::string all;
  for (const Diagnostic& note : notes.all()) all += note.message + "\n";
  EXPECT_THAT(all, HasSubstr("the sensor type"));
  EXPECT_THAT(all, HasSubstr("a missing <inertial>"));
}

std::string notes_of(const std::string& xml) {
  Diagnostics notes;
  read_entity_xml(xml, any_mesh, notes);
  std::string out;
  for (const Diagnostic& note : notes.all()) out += note.where.place() + ": " + note.message + "\n";
  return out;
}

TEST(EntityXml, UndrawnVisualIsNoted) {
  const auto urdf = [](const std::string& radius, const std::string& more) {
    return "<robot name='r'><link name='l'><collision><origin xyz='0 0 1'/><geometry><sphere "
           "radius='0.1'/></geometry>"
           "</collision><visual><origin xyz='0 0 1.0'/><geometry><sphere radius='" +
           radius + "'/></geometry></visual>" + more + "</link></robot>";
  };
  EXPECT_EQ(notes_of(urdf("1e-1", "")), "");
  EXPECT_THAT(notes_of(urdf("0.2", "")), HasSubstr("is ignored"));
  EXPECT_THAT(notes_of(urdf("0.1", "<inertial><origin xyz='0 0 1'/><mass value='1'/></inertial>")),
              HasSubstr("<origin> has no effect"));
}

// Two neighbouring packages, a file outside of them that must not be served, and links.
class EntityMeshTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::canonical(::testing::TempDir()) / "entity_mesh" / info->name();
    fs::remove_all(root_);
    for (const char* package : {"ws/arm", "ws/hand"}) {
      fs::create_directories(root_ / package / "meshes");
      write(std::string(package) + "/package.xml",
            "<package><name>" + fs::path(package).filename().string() + "</name></package>");
      write(std::string(package) + "/meshes/a.stl", "solid");
    }
    fs::create_directories(root_ / "ws/arm/urdf");
    write("ws/arm/urdf/arm.urdf", "<robot/>");
    write("secret.stl", "secret");
    write("ws/arm/notes.txt", "text");
    target_ = {root_ / "ws/arm/urdf/arm.urdf", root_ / "ws/arm"};
    resolver_.add_context(target_.description);
  }
  void TearDown() override { fs::remove_all(root_); }

  void write(const std::string& file, const std::string& text) { std::ofstream(root_ / file) << text; }
  std::string find(const std::string& uri) {
    try {
      return fs::relative(find_entity_mesh(uri, resolver_, target_), root_).string();
    } catch (const InputError& error) {
      return error.diagnostics().front().message;
    }
  }

  fs::path root_;
  Target target_;
  PackageResolver resolver_;
};

TEST_F(EntityMeshTest, MeshOfPackageIsFound) {
  EXPECT_EQ(find("package://arm/meshes/a.stl"), "ws/arm/meshes/a.stl");
  EXPECT_EQ(find("package://hand/meshes/a.stl"), "ws/hand/meshes/a.stl");
  EXPECT_EQ(find("file://" + (root_ / "ws/arm/meshes/a.stl").string()), "ws/arm/meshes/a.stl");
  EXPECT_EQ(find("file://../meshes/a.stl"), "ws/arm/meshes/a.stl");
  EXPECT_THAT(find("package://arm/meshes/b.stl"), HasSubstr("is not found"));
}

TEST_F(EntityMeshTest, FileOutsidePackagesIsRefused) {
  for (const std::string& uri :
       {std::string("package://arm/../../secret.stl"), "file://" + (root_ / "secret.stl").string(),
        "file://" + (root_ / "ws/arm/../../secret.stl").string(), std::string("file:///etc/nothing.stl"),
        std::string("file://../../../secret.stl")})
    EXPECT_THAT(find(uri), HasSubstr("is outside")) << uri;
  for (const std::string& uri : {std::string("/etc/passwd"), std::string("../secret.stl"),
                                 std::string("http://x/a.stl"), std::string("://a.stl"), std::string()})
    EXPECT_THAT(find(uri), HasSubstr("neither package:// nor file://")) << uri;
  EXPECT_THAT(find("package://arm/notes.txt"), HasSubstr("is not a .stl"));
  EXPECT_THAT(find("package://nobody/a.stl"), HasSubstr("not found"));
  EXPECT_THAT(find(std::string("package://arm/meshes/a\0.stl", 27)), HasSubstr("NUL"));
  EXPECT_THAT(find("package://.stl"), Not(HasSubstr("ws/")));
}

TEST_F(EntityMeshTest, SymlinkOutOfPackagesIsRefused) {
  fs::create_symlink(root_ / "secret.stl", root_ / "ws/arm/meshes/out.stl");
  fs::create_symlink(root_ / "ws/hand/meshes/a.stl", root_ / "ws/arm/meshes/in.stl");
  fs::create_symlink(root_ / "ws/arm/notes.txt", root_ / "ws/arm/meshes/text.stl");
  fs::create_directory_symlink(root_, root_ / "ws/arm/meshes/up");
  EXPECT_THAT(find("package://arm/meshes/out.stl"), HasSubstr("symbolic link that points outside"));
  EXPECT_THAT(find("package://arm/meshes/up/secret.stl"), HasSubstr("symbolic link that points outside"));
  EXPECT_THAT(find("package://arm/meshes/text.stl"),
              HasSubstr("is a symbolic link to a file that is not a .stl"));
  EXPECT_EQ(find("package://arm/meshes/in.stl"), "ws/hand/meshes/a.stl");
}

TEST_F(EntityMeshTest, HugeMeshIsRefused) {
  fs::resize_file(root_ / "ws/arm/meshes/a.stl", std::uintmax_t{17} << 20);
  EXPECT_THAT(find("package://arm/meshes/a.stl"), HasSubstr("larger than 16 MB"));
}

}  // namespace
}  // namespace doppel
