// Included files, and populations.
#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>

#include "doppel/scenario/sdf/test/sdf_fixture.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

class SdfFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("doppel_sdf_" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  ReadSdf load(const std::string& name) const {
    ReadSdf out;
    PackageResolver resolver;
    out.world = load_sdf(folder_ / name, resolver, out.notes);
    return out;
  }
  std::filesystem::path folder_;
};

std::string population(const std::string& how) {
  return "<sdf version='1.9'><world name='w'><population name='cans'><pose>1 2 3 0 0 0</pose>"
         "<model name='can'><pose>9 9 9 0 0 0.5</pose><static>true</static><link name='l'/></model>" +
         how + "</population></world></sdf>";
}

TEST(SdfInclude, JointToPartOfMissingModelIsToItsStandIn) {
  const ReadSdf read = read_world(model(
      "a",
      "<link name='l'/><include><uri>model://arm</uri><name>arm</name></include><joint name='j' type='fixed'>"
      "<parent>l</parent><child>arm::wrist</child></joint>"));
  EXPECT_NE(read.model("a").description->find_link("arm::link"), nullptr);
  const ReadSdf unnamed =
      read_world(model("a",
                       "<link name='l'/><include><uri>model://arm_v2</uri></include><joint name='j' "
                       "type='fixed'><parent>l</parent>"
                       "<child>arm::wrist</child></joint>"));
  EXPECT_EQ(unnamed.count("sdf.missing_part"), 1);
}

TEST(SdfInclude, MissingModelGivesStandInAndOneMessage) {
  const ReadSdf read = read_world(
      "<include><uri>model://chair</uri></include><include><uri>model://chair</uri><name>other</name>"
      "<pose>1 0 0 0 0 0</pose></include>");
  EXPECT_EQ(read.count("sdf.missing_model"), 1);
  EXPECT_EQ(read.model("other").X_WR.translation(), Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(read.model("chair").description->links[0].visuals.size(), 1u);
  EXPECT_TRUE(read.model("chair").description->links[0].collisions.empty());
  EXPECT_EQ(read.world.missing, std::vector<std::string>{"model://chair"});
}

TEST_F(SdfFiles, IncludeBesideWorldIsReadInNewestVersion) {
  write("models/can/model.config",
        "<model><sdf version='1.4'>old.sdf</sdf><sdf version='1.10'>new.sdf</sdf><sdf "
        "version='1.9'>mid.sdf</sdf></model>");
  for (const char* name : {"old", "mid", "new"})
    write(std::string("models/can/") + name + ".sdf",
          std::string("<sdf version='1.9'><model name='") + name + "'>" + kBall + "</model></sdf>");
  write("worlds/w.sdf",
        "<sdf version='1.9'><world name='w'><include><uri>model://can</uri><pose>1 0 0 0 0 0</pose></include>"
        "<include><name>second</name><uri>model://can</uri><static>true</static></include></world></sdf>");
  write("package.xml", "<package><name>p</name></package>");
  const ReadSdf read = load("worlds/w.sdf");
  EXPECT_EQ(read.model("new").X_WR.translation(), Eigen::Vector3d(1, 0, 0));
  EXPECT_TRUE(read.model("second").is_static);
  EXPECT_EQ(read.world.files.size(), 2u);
}

TEST_F(SdfFiles, IncludedUrdfKeepsCorrectionsOfItsOverlay) {
  write("arm.urdf",
        "<robot name='arm'><link name='base'/><link name='upper'/><joint name='elbow' type='revolute'>"
        "<parent link='base'/><child link='upper'/><axis xyz='0 0 1'/>"
        "<limit lower='-1' upper='1' effort='5' velocity='2'/></joint></robot>");
  write("arm.overlay.yaml", "- set_limit: elbow\n  velocity: 0.5\n  was: {velocity: 2}\n");
  write("w.sdf", "<sdf version='1.9'><world name='w'><include><uri>arm.urdf</uri></include></world></sdf>");
  const ReadSdf read = load("w.sdf");
  const Joint* const elbow = read.model("arm").description->find_joint("elbow");
  ASSERT_NE(elbow, nullptr);
  EXPECT_EQ(elbow->limits->velocity, 0.5);
  EXPECT_THAT(read.world.files, ::testing::Contains(folder_ / "arm.overlay.yaml")) << "it is watched";
}

TEST_F(SdfFiles, HeightmapThatCannotBeReadIsReportedAndLeftOut) {
  const auto world = [](const std::string& uri) {
    return "<sdf version='1.9'><world name='w'>\n<model name='hill'><static>true</static><link name='l'>"
           "<collision name='c'><geometry>\n<heightmap><uri>" +
           uri +
           "</uri><size>10 20 3</size><pos>1 2 "
           "3</pos><sampling>2</sampling><texture><diffuse>none.png</diffuse>"
           "<size>5</size></texture><blend><min_height>1</min_height><fade_dist>2</fade_dist></blend></"
           "heightmap>"
           "</geometry></collision></link></model></world></sdf>";
  };
  write("hill.dem", "not an image");
  write("dem.sdf", world("hill.dem"));
  const ReadSdf read = load("dem.sdf");
  const Collision& collision = read.model("hill").description->links[0].collisions.at(0);
  const auto& map = std::get<Heightmap>(collision.geometry);
  EXPECT_EQ(map.field, nullptr);
  EXPECT_EQ(map.size, Eigen::Vector3d(10, 20, 3));
  EXPECT_EQ(collision.origin.xyz, Eigen::Vector3d(1, 2, 3));
  ASSERT_EQ(map.textures.size(), 1u);
  EXPECT_EQ(map.textures[0].size, 5);
  ASSERT_EQ(map.blends.size(), 1u);
  EXPECT_EQ(map.blends[0].distance, 2);
  EXPECT_THAT(read.message("heightmap.unreadable"), HasSubstr("dem.sdf:3:"));
  EXPECT_THAT(read.message("heightmap.unreadable"), HasSubstr("'hill.dem' collides with nothing"));
  CollisionMeshes meshes;
  Diagnostics none;
  EXPECT_TRUE(make_instance(read.model("hill"), "", meshes, none).shapes.at(0).empty());

  write("missing.sdf", world("missing.png"));
  const ReadSdf missing = load("missing.sdf");
  EXPECT_THAT(missing.message("sdf.missing_file"), HasSubstr("missing.png"));
  EXPECT_THAT(missing.message("sdf.missing_file"), HasSubstr("missing.sdf:3:"));
}

TEST_F(SdfFiles, MergedModelPartsBelongToIncluder) {
  write("wheel/model.sdf",
        "<sdf version='1.9'><model name='wheel'><link name='rim'><pose>0 0 1 0 0 0</pose></link><joint "
        "name='axle' "
        "type='fixed'><parent>__model__</parent><child>hub</child></joint><link name='hub'><pose>0 0 2 0 0 "
        "0</pose></link>"
        "</model></sdf>");
  write("car.sdf",
        "<sdf version='1.9'><model name='car'><link name='body'/><include merge='true'><uri>wheel</uri>"
        "<pose>1 0 0 0 0 0</pose></include><joint name='j' "
        "type='fixed'><parent>body</parent><child>rim</child></joint>"
        "</model></sdf>");
  const ReadSdf read = load("car.sdf");
  EXPECT_EQ(link_pose(read.model("car"), "rim").translation(), Eigen::Vector3d(1, 0, 1));
  EXPECT_EQ(link_pose(read.model("car"), "hub").translation(), Eigen::Vector3d(1, 0, 2));
}

TEST_F(SdfFiles, FileIncludingItselfIsRefused) {
  write("a/model.sdf",
        "<sdf version='1.9'><model name='a'><include><uri>model://a</uri></include></model></sdf>");
  write("w.sdf", "<sdf version='1.9'><world name='w'><include><uri>model://a</uri></include></world></sdf>");
  EXPECT_THROW(load("w.sdf"), InputError);
}

// Seven models, each of which includes ten of the next: ten million links.
TEST_F(SdfFiles, IncludesThatMultiplyAreRefused) {
  for (int level = 0; level < 7; ++level) {
    const std::string name = "m" + std::to_string(level);
    std::string text = "<sdf version='1.9'><model name='" + name + "'><link name='l'/>";
    for (int i = 0; level < 6 && i < 10; ++i) {
      text += "<include><uri>model://m" + std::to_string(level + 1) + "</uri><name>n" + std::to_string(i) +
              "</name></include>";
    }
    write(name + "/model.sdf", text + "</model></sdf>");
  }
  std::string world = "<sdf version='1.9'><world name='w'>";
  for (int i = 0; i < 10; ++i)
    world += "<include><uri>model://m0</uri><name>n" + std::to_string(i) + "</name></include>";
  write("w.sdf", world + "</world></sdf>");
  try {
    load("w.sdf");
    ADD_FAILURE() << "expected the world to be refused";
  } catch (const InputError& error) {
    EXPECT_EQ(error.diagnostics().front().rule, "sdf.too_much");
  }
}

TEST_F(SdfFiles, XacroIsExpandedAndKeepsItsPlaces) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "arena.sdf.xacro";
  std::ofstream(file)
      << "<sdf version='1.9' xmlns:xacro='http://www.ros.org/wiki/xacro'>\n"
         "<xacro:arg name='x' default='2'/><xacro:property name='twice' value='${2 * $(arg x)}'/>\n"
         "<world name='arena'><model name='m'><pose>${twice} 0 0 0 0 0</pose>\n"
         "<link name='l'><colision/></link></model></world></sdf>";
  EXPECT_TRUE(is_sdf(file));
  EXPECT_FALSE(is_sdf("arm.urdf.xacro"));
  PackageResolver resolver;
  Diagnostics found;
  const SdfWorld world = load_sdf(file, resolver, found);
  EXPECT_EQ(world.settings.name, "arena");
  EXPECT_DOUBLE_EQ(world.models.at(0).X_WR.translation().x(), 4);
  EXPECT_TRUE(std::ranges::any_of(found.all(), [](const Diagnostic& one) {
    return one.rule == "sdf.unknown_element" && one.where.line == 4;
  }));
}

TEST(SdfPopulation, GridIsCentredAtItsPose) {
  const ReadSdf read = read_sdf(population(
      "<distribution><type>grid</type><rows>2</rows><cols>3</cols><step>0.4 1 0</step></distribution>"));
  ASSERT_EQ(read.world.models.size(), 6u);
  const Pose first = read.model("cans_clone_0").X_WR;
  EXPECT_TRUE(first.translation().isApprox(Eigen::Vector3d(0.6, 1.5, 3)));
  EXPECT_NEAR(rpy_from_rotation(first.linear()).z(), 0.5, 1e-12);
  EXPECT_TRUE(read.model("cans_clone_5").X_WR.translation().isApprox(Eigen::Vector3d(1.4, 2.5, 3)));
  EXPECT_TRUE(read.model("cans_clone_5").is_static);
}

TEST(SdfPopulation, RandomCopiesAreInRegionAndRepeatable) {
  for (const char* type : {"random", "uniform"}) {
    const std::string text = population(
        "<model_count>40</model_count><cylinder><radius>2</radius><length>1"
        "</length></cylinder><distribution><type>" +
        std::string(type) + "</type></distribution>");
    const ReadSdf read = read_sdf(text), again = read_sdf(text);
    ASSERT_EQ(read.world.models.size(), 40u);
    for (std::size_t i = 0; i < 40; ++i) {
      const Eigen::Vector3d p = read.world.models[i].X_WR.translation() - Eigen::Vector3d(1, 2, 3);
      EXPECT_LE(p.head<2>().norm(), 2.0);
      EXPECT_LE(std::abs(p.z()), 0.5);
      EXPECT_EQ(p, again.world.models[i].X_WR.translation() - Eigen::Vector3d(1, 2, 3));
    }
  }
}

TEST(SdfPopulation, LineEndsOnSidesOfRegion) {
  const ReadSdf read =
      read_sdf(population("<model_count>3</model_count><box><size>4 1 1</size></box>"
                          "<distribution><type>linear-x</type></distribution>"));
  ASSERT_EQ(read.world.models.size(), 3u);
  EXPECT_TRUE(read.model("cans_clone_0").X_WR.translation().isApprox(Eigen::Vector3d(-1, 2, 3)));
  EXPECT_TRUE(read.model("cans_clone_1").X_WR.translation().isApprox(Eigen::Vector3d(1, 2, 3)));
}

TEST(SdfPopulation, UnknownDistributionAndCountAreErrors) {
  EXPECT_THROW(read_sdf(population("<distribution><type>gird</type></distribution>")), InputError);
  EXPECT_THROW(read_sdf(population("<model_count>-1</model_count>")), InputError);
}

TEST(SdfPopulation, GridWithInvalidOrTooManyPlacesIsError) {
  const auto refusal = [](const std::string& sizes) -> std::string {
    try {
      read_sdf(population("<distribution><type>grid</type>" + sizes + "</distribution>"));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("<rows>0</rows>"),
              ::testing::HasSubstr("<rows> is 0; it must be a whole number from 1 to 10000"));
  EXPECT_THAT(refusal("<cols>2.5</cols>"), ::testing::HasSubstr("<cols> is 2.5"));
  EXPECT_THAT(refusal("<rows>-3</rows><cols>20000</cols>"), ::testing::HasSubstr("<cols> is 20000"));
  EXPECT_THAT(refusal("<rows>200</rows><cols>51</cols>"), ::testing::HasSubstr("200 x 51 places"));
}

}  // namespace
}  // namespace doppel
