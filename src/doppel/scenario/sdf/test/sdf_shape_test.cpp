// Shapes, surfaces, materials, inertias and lights of SDF.
#include <gmock/gmock.h>

#include "doppel/scenario/sdf/test/sdf_fixture.h"

namespace doppel {
namespace {

TEST(SdfShape, EveryGeometryIsRead) {
  const auto shape = [](const std::string& xml) {
    return read_world(model("a", "<link name='l'><collision name='c'><geometry>" + xml +
                                     "</geometry></collision></link>"))
        .model("a")
        .description->links[0]
        .collisions;
  };
  EXPECT_EQ(std::get<Box>(shape("<box><size>1 2 3</size></box>")[0].geometry).size.z(), 3);
  EXPECT_EQ(
      std::get<Capsule>(shape("<capsule><radius>1</radius><length>2</length></capsule>")[0].geometry).length,
      2);
  EXPECT_EQ(std::get<Ellipsoid>(shape("<ellipsoid><radii>1 2 3</radii></ellipsoid>")[0].geometry).radii.y(),
            2);
  EXPECT_EQ(std::get<Cone>(shape("<cone><radius>1</radius><length>2</length></cone>")[0].geometry).length, 2);
  EXPECT_EQ(std::get<Plane>(shape("<plane><normal>0 1 0</normal></plane>")[0].geometry).normal.y(), 1);
  const std::string arrow =
      "<polyline><point>0 0</point><point>2 0</point><point>1 0.5</point><point>2 2</point><point>0 2</point>"
      "<height>0.3</height></polyline>";
  EXPECT_EQ(shape(arrow).size(), 2u);  // not convex at (1, 0.5)
  EXPECT_TRUE(shape("<empty/>").empty());
}

TEST(SdfShape, SurfaceIsReadAsWritten) {
  const ReadSdf read = read_world(model(
      "a",
      "<link name='l'><collision name='c'><geometry><box><size>1 1 "
      "1</size></box></geometry><surface><friction>"
      "<ode><mu>0.3</mu><mu2>0.2</mu2><fdir1>1 0 "
      "0</fdir1><slip1>0.1</slip1></ode><torsional><coefficient>0.05"
      "</coefficient><patch_radius>0.02</patch_radius></torsional></"
      "friction><bounce><restitution_coefficient>0.4"
      "</restitution_coefficient></bounce><contact><ode><kp>1e5</kp><kd>10</kd><max_vel>0.1</"
      "max_vel><min_depth>"
      "0.001</min_depth></ode></contact></surface></collision><collision name='d'><geometry><box><size>1 1 1"
      "</size></box></geometry></collision></link>"));
  const auto& collisions = read.model("a").description->links[0].collisions;
  const ContactSurface& surface = collisions[0].surface;
  EXPECT_EQ(surface.mu, 0.3);
  EXPECT_EQ(surface.mu2, 0.2);
  EXPECT_EQ(surface.fdir1, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(surface.slip1, 0.1);
  EXPECT_EQ(surface.torsional_mu, 0.05);
  EXPECT_EQ(surface.patch_radius, 0.02);
  EXPECT_EQ(surface.restitution, 0.4);
  EXPECT_EQ(surface.kp, 1e5);
  EXPECT_EQ(surface.max_velocity, 0.1);
  EXPECT_EQ(surface.min_depth, 0.001);
  EXPECT_EQ(collisions[1].surface.mu, 1.0);  // SDF's default
}

TEST(SdfShape, MaterialsGiveColours) {
  const auto colour = [](const std::string& material) {
    return *read_world(model("a",
                             "<link name='l'><visual name='v'><geometry><sphere><radius>1</radius></sphere>"
                             "</geometry><material>" +
                                 material + "</material></visual></link>"))
                .model("a")
                .description->links[0]
                .visuals[0]
                .material->rgba;
  };
  EXPECT_EQ(colour("<diffuse>0.1 0.2 0.3</diffuse>"), Eigen::Vector4d(0.1, 0.2, 0.3, 1));
  EXPECT_EQ(colour("<script><name>Gazebo/Orange</name></script>"), Eigen::Vector4d(1, 0.509, 0.047, 1));
  EXPECT_EQ(colour("<script>Gazebo/Blue</script>"), Eigen::Vector4d(0, 0, 1, 1));
}

TEST(SdfShape, PhysicalMaterialIsRead) {
  const auto material = [](const std::string& pbr) {
    return *read_world(model("a",
                             "<link name='l'><visual name='v'><geometry><sphere><radius>1</radius></sphere>"
                             "</geometry><material><emissive>0.1 0.2 0.3 1</emissive><pbr>" +
                                 pbr + "</pbr></material></visual></link>"))
                .model("a")
                .description->links[0]
                .visuals[0]
                .material;
  };
  const Material metal = material(
      "<metal><albedo_map>a.png</albedo_map><roughness>0.3</roughness><metalness>1.5</metalness>"
      "<normal_map>n.png</normal_map><roughness_map>r.png</roughness_map><metalness_map>m.png</metalness_map>"
      "<emissive_map>e.png</emissive_map></metal>");
  EXPECT_EQ(metal.texture, "a.png");
  EXPECT_EQ(metal.emissive, Eigen::Vector4d(0.1, 0.2, 0.3, 1));
  EXPECT_EQ(metal.roughness, 0.3);
  EXPECT_EQ(metal.metalness, 1.0) << "expected a value up to 1";
  EXPECT_EQ(metal.normal_map.uri, "n.png");
  EXPECT_EQ(metal.roughness_map.uri, "r.png");
  EXPECT_EQ(metal.metalness_map.uri, "m.png");
  EXPECT_EQ(metal.emissive_map.uri, "e.png");
  EXPECT_EQ(material("<specular><glossiness>0.75</glossiness></specular>").roughness, 0.25);
}

TEST(SdfLight, SceneIsReadWithSky) {
  const ReadSdf read = read_world(
      "<scene><ambient>0.1 0.2 0.3 1</ambient><background>0 0 1 1</background><shadows>false</shadows>"
      "<sky><time>19</time><clouds><speed>1</speed></clouds></sky></scene>");
  ASSERT_TRUE(read.world.settings.environment);
  const Environment& scene = *read.world.settings.environment;
  EXPECT_EQ(scene.ambient, Eigen::Vector4d(0.1, 0.2, 0.3, 1));
  EXPECT_EQ(scene.background, Eigen::Vector4d(0, 0, 1, 1));
  EXPECT_FALSE(scene.shadows);
  ASSERT_TRUE(scene.sky);
  EXPECT_EQ(scene.sky->time, 19);
  EXPECT_EQ(scene.sky->sunset, 20);
  EXPECT_EQ(read.count("sdf.no_effect"), 1) << "expected a note about the clouds";
  EXPECT_FALSE(read_world("").world.settings.environment);
}

TEST(SdfLight, UnknownTypeIsPointLightWithNote) {
  const ReadSdf read = read_world("<light type='directonal' name='sun'/>");
  EXPECT_EQ(read.world.settings.lights.at(0).kind, LightKind::point);
  EXPECT_THAT(read.message("sdf.light_type"), ::testing::HasSubstr("did you mean 'directional'?"));
}

TEST(SdfInertial, AutoInertiaFollowsFromCollisionDensities) {
  const ReadSdf read =
      read_world(model("a",
                       "<link name='l'><inertial auto='true'><density>2000</density></inertial><collision "
                       "name='c'><pose>1 0 0 0 0 0"
                       "</pose><geometry><box><size>0.1 0.2 0.3</size></box></geometry></collision></link>"));
  const Inertial& body = *read.model("a").description->links[0].inertial;
  EXPECT_NEAR(body.mass, 12.0, 1e-12);
  EXPECT_NEAR(body.origin.xyz.x(), 1.0, 1e-12);
  EXPECT_NEAR(body.ixx, 12.0 / 12 * (0.04 + 0.09), 1e-12);
}

TEST(SdfLight, LightHasDirectionAndColour) {
  const ReadSdf read = read_world(
      "<light type='directional' name='sun'><diffuse>1 0.5 0 1</diffuse><direction>0 3 "
      "0</direction></light>");
  ASSERT_EQ(read.world.settings.lights.size(), 1u);
  EXPECT_EQ(read.world.settings.lights[0].kind, LightKind::directional);
  EXPECT_EQ(read.world.settings.lights[0].direction_W, Eigen::Vector3d::UnitY());
}

}  // namespace
}  // namespace doppel
