#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/scaffold/arm_package.h"
#include "doppel/description/scaffold/write_package.h"

namespace doppel::scaffold {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

template <class Work>
std::string error_of(const Work& work) {
  try {
    work();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

class WritePackage : public ::testing::Test {
 protected:
  WritePackage() {
    std::string name = (fs::temp_directory_path() / "doppel-scaffold.XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~WritePackage() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  [[nodiscard]] std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

TEST(PackageName, RobotGetsSuffixOfDescriptionPackages) {
  EXPECT_EQ(package_name("my_arm").package, "my_arm_description");
  EXPECT_EQ(package_name("my_arm_description").package, "my_arm_description");
  EXPECT_EQ(package_name("my_arm_description").robot, "my_arm");
}

TEST(PackageName, InvalidNameIsRefusedWithValidOneLikeIt) {
  for (const auto& [name, near] : {std::pair("My-Arm", "my_arm"), std::pair("2nd arm", "nd_arm"),
                                   std::pair("my__arm", "my_arm"), std::pair("arm_", "arm")}) {
    EXPECT_THAT(error_of([&given = name] { (void)package_name(given); }),
                HasSubstr(std::string("doppel new ") + near))
        << name;
  }
}

TEST(PackageName, NameWithoutUsableCharactersIsRefused) {
  for (const char* name : {"", "_", "7", "a", "_description", "../x", "\xc3\xa4"})
    EXPECT_THAT(error_of([&given = name] { (void)package_name(given); }),
                HasSubstr("not a valid package name"))
        << name;
}

TEST(DesignArm, JointsReachAsFarAsAskedFor) {
  for (int dof = kMinDof; dof <= kMaxDof; ++dof) {
    const ArmDesign design = design_arm({dof, false, 0.8, 1.0});
    double length = 0;
    for (std::size_t i = dof > 1 ? 1 : 0; i < design.joints.size(); ++i) length += design.joints[i].length;
    EXPECT_NEAR(length, 0.8, 1e-9) << dof;
    EXPECT_EQ(design.joints.size(), static_cast<std::size_t>(dof));
  }
}

TEST(DesignArm, EffortIsTwiceWhatHoldsArmStretchedOutWithItsPayload) {
  const ArmDesign design = design_arm({2, false, 0.4, 2.0});
  const ArmJoint& swing = design.joints.back();
  const double tool = swing.length + design.finger_length;
  const double holds = 9.81 * (link_mass(swing) * 0.5 * swing.length + 2.0 * tool);
  EXPECT_GE(swing.effort, 2 * holds);
  EXPECT_LE(swing.effort, 2 * holds * 1.11);  // rounded up to two digits
}

TEST(DesignArm, MorePayloadNeedsMoreEffort) {
  const ArmDesign light = design_arm({6, true, 0.6, 0.1}), heavy = design_arm({6, true, 0.6, 5});
  for (std::size_t i = 0; i < light.joints.size(); ++i)
    EXPECT_GT(heavy.joints[i].effort, light.joints[i].effort) << light.joints[i].name;
}

TEST(DesignArm, RequestBeyondBoundsIsRefusedWithBounds) {
  EXPECT_THAT(error_of([] { (void)design_arm({0, false, 0, 0}); }), HasSubstr("--dof is 0"));
  EXPECT_THAT(error_of([] { (void)design_arm({17, false, 0, 0}); }), HasSubstr("from 1 to 16"));
  EXPECT_THAT(error_of([] { (void)design_arm({6, false, 50, 0}); }), HasSubstr("--reach is 50"));
  EXPECT_THAT(error_of([] { (void)design_arm({6, false, 0, -1}); }), HasSubstr("--payload is -1"));
  EXPECT_THAT(error_of([] { (void)design_arm({6, false, std::nan(""), 1}); }), HasSubstr("--reach is nan"));
}

TEST(ArmPackage, NoPlaceholderIsLeft) {
  for (const bool gripper : {false, true}) {
    for (const PackageFile& file :
         arm_package(package_name("my_arm"), design_arm({3, gripper, 0, 1}), {"A", "a b", "MIT"}))
      EXPECT_THAT(file.text, Not(HasSubstr("@"))) << file.path;
  }
}

TEST(ArmPackage, MaintainerIsEscapedInManifest) {
  const auto files = arm_package(package_name("my_arm"), design_arm({}), {"R&D <x>", "a\"b", "MIT"});
  EXPECT_THAT(files.front().text, HasSubstr("<maintainer email=\"a&quot;b\">R&amp;D &lt;x&gt;</maintainer>"));
}

TEST_F(WritePackage, FilesStandInFolder) {
  const std::vector<PackageFile> files{{"a.txt", "one"}, {"sub/b.txt", "two"}};
  write_package(folder_ / "made", files);
  std::string text;
  std::ifstream(folder_ / "made/sub/b.txt") >> text;
  EXPECT_EQ(text, "two");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(WritePackage, ExistingFolderIsLeftAlone) {
  fs::create_directory(folder_ / "made");
  const std::vector<PackageFile> files{{"a.txt", "one"}};
  EXPECT_THAT(error_of([&] { write_package(folder_ / "made", files); }), HasSubstr("exists already"));
  EXPECT_TRUE(fs::is_empty(folder_ / "made"));
}

TEST_F(WritePackage, DanglingLinkIsLeftAlone) {
  fs::create_symlink("nowhere", folder_ / "made");
  const std::vector<PackageFile> files{{"a.txt", "one"}};
  EXPECT_THAT(error_of([&] { write_package(folder_ / "made", files); }), HasSubstr("exists already"));
}

TEST_F(WritePackage, FileThatCannotBeWrittenLeavesNothingBehind) {
  const std::vector<PackageFile> files{{"a.txt", "one"}, {std::string(300, 'x'), "two"}};
  EXPECT_THAT(error_of([&] { write_package(folder_ / "made", files); }), HasSubstr("cannot write the file"));
  EXPECT_EQ(entries(), 0u);
}

TEST_F(WritePackage, MissingFolderIsNamed) {
  const std::vector<PackageFile> files{{"a.txt", "one"}};
  EXPECT_THAT(error_of([&] { write_package(folder_ / "gone/made", files); }), HasSubstr("mkdir -p"));
}

}  // namespace
}  // namespace doppel::scaffold
