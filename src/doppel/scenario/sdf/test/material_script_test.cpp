// OGRE's material scripts: the parser, and the look of visuals that refer to them.
#include "doppel/scenario/sdf/detail/material_script.h"

#include <gmock/gmock.h>

#include <fstream>

#include "sdf_fixture.h"

namespace doppel::sdf {
namespace {

TEST(MaterialScript, DiffuseAndFirstTextureAreRead) {
  const auto materials = parse_material_script(R"(// import
material Shop/Wall // a wall
{
  receive_shadows off
  technique { pass {
      ambient 0.1 0.2 0.3 1
      diffuse 0.5 0.6 0.7 0.8
      /* texture none.png */
      texture_unit normal
      {
        texture wall.png 2d
        filtering trilinear
      }
      texture_unit { texture second.png }
  } }
}
material "Shop/Two Words" : Shop/Wall { technique { pass { diffuse 1 0 0 } } }
material Shop/Vertices { technique { pass { diffuse vertexcolour } } }
)");
  ASSERT_EQ(materials.size(), 3u);
  const ScriptedMaterial& wall = materials.at("Shop/Wall");
  EXPECT_EQ(wall.texture, "wall.png");
  ASSERT_TRUE(wall.diffuse);
  EXPECT_TRUE(wall.diffuse->isApprox(Eigen::Vector4d(0.5, 0.6, 0.7, 0.8)));
  const ScriptedMaterial& two = materials.at("Shop/Two Words");
  EXPECT_EQ(two.base, "Shop/Wall");
  ASSERT_TRUE(two.diffuse);
  EXPECT_TRUE(two.diffuse->isApprox(Eigen::Vector4d(1, 0, 0, 1)));
  EXPECT_FALSE(materials.at("Shop/Vertices").diffuse);
}

TEST(MaterialScript, TextThatIsNoScriptGivesNothing) {
  for (const char* text :
       {"", "}}}", "material", "material {", "{{{ material A {", "/* material A {", "\"\"\"{}"})
    EXPECT_TRUE(parse_material_script(text).empty()) << text;
}

class MaterialScriptsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    namespace fs = std::filesystem;
    const fs::path model = folder_ / "models" / "shop";
    for (const char* inner : {"materials/scripts/sub", "materials/textures"})
      fs::create_directories(model / inner);
    std::ofstream(model / "model.config") << "<model><name>shop</name><sdf>model.sdf</sdf></model>";
    std::ofstream(model / "materials/scripts/shop.material")
        << "material Shop/Wall { technique { pass { texture_unit { texture wall.png\n } } } }\n"
           "material Shop/Door : Shop/Wall { technique { pass { diffuse 1 0 0 1\n } } }\n"
           "material Shop/Out { technique { pass { texture_unit { texture ../secret.png\n } } } }\n"
           "material Shop/Round { technique { pass { texture_unit { texture sub/../../secret.png\n } } } }\n";
    std::ofstream(model / "materials/textures/wall.png") << "png";
    std::ofstream(model / "materials/secret.png") << "png";
  }
  [[nodiscard]] Material look_of(const std::string& name) {
    const std::string uris =
        "<uri>model://shop/materials/scripts</uri><uri>model://shop/materials/textures</uri>";
    PackageResolver resolver;
    const SdfWorld world = parse_sdf(
        "<sdf version='1.9'><model name='m'><link name='l'><visual name='v'><geometry><box/></geometry>"
        "<material><script>" +
            uris + "<name>" + name + "</name></script></material></visual></link></model></sdf>",
        "test.sdf", folder_, resolver, said_);
    return world.models.front().description->links.front().visuals.front().material.value();
  }
  std::filesystem::path folder_ = std::filesystem::path(::testing::TempDir()) / "material_scripts" /
                                  ::testing::UnitTest::GetInstance()->current_test_info()->name();
  Diagnostics said_;
};

TEST_F(MaterialScriptsTest, VisualHasTextureOfScript) {
  const Material wall = look_of("Shop/Wall");
  EXPECT_EQ(wall.texture_path, (folder_ / "models/shop/materials/textures/wall.png").string());
  EXPECT_TRUE(wall.rgba.value().isApprox(Eigen::Vector4d::Ones()));
}

TEST_F(MaterialScriptsTest, BaseGivesWhatMaterialLeavesOut) {
  const Material door = look_of("Shop/Door");
  EXPECT_THAT(door.texture_path, ::testing::EndsWith("wall.png"));
  EXPECT_TRUE(door.rgba.value().isApprox(Eigen::Vector4d(1, 0, 0, 1)));
}

TEST_F(MaterialScriptsTest, TextureOutsideOfItsFolderIsNotUsed) {
  EXPECT_EQ(look_of("Shop/Out").texture_path, "");
  EXPECT_EQ(look_of("Shop/Round").texture_path, "");
}

TEST_F(MaterialScriptsTest, UnknownMaterialIsGreyAndReported) {
  EXPECT_TRUE(look_of("Shop/Roof").rgba.value().isApprox(Eigen::Vector4d(0.7, 0.7, 0.7, 1)));
  EXPECT_TRUE(std::ranges::any_of(said_.all(), [](const Diagnostic& one) {
    return one.message.find("the material 'Shop/Roof' is not one of Gazebo's") != std::string::npos;
  }));
}

}  // namespace
}  // namespace doppel::sdf
