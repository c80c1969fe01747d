// For each rule on controllers, the package, launch files, the world and contact: one small invalid input and
// its valid counterpart.
#include "doppel/review/audit/test/audit_rig.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class ControllerRulesTest : public AuditRig {
 protected:
  static std::string manager(
      const std::string& more = "", const std::string& rate = "100",
      const std::string& type = "joint_trajectory_controller/JointTrajectoryController") {
    return "controller_manager:\n  ros__parameters:\n    update_rate: " + rate +
           "\n    arm:\n      type: " + type + "\n" + more;
  }
  static std::string section(const std::string& joints = "[shoulder, elbow]", const std::string& more = "",
                             const std::string& commands = "[position]", const std::string& name = "arm") {
    return name + ":\n  ros__parameters:\n    joints: " + joints + "\n    command_interfaces: " + commands +
           "\n    state_interfaces: [position, velocity]\n" + more;
  }
  std::vector<Finding> of(const std::string& rule, const std::string& yaml) {
    write("urdf/r.urdf", robot(good_hardware()));
    write("config/c.yaml", yaml);
    options.controllers = folder_ / "config/c.yaml";
    return AuditRig::of(rule);
  }
};
class PackageRulesTest : public AuditRig {
 protected:
  void package(const std::string& more = "", const std::string& name = "r_description") {
    write("package.xml", "<package format=\"3\"><name>" + name +
                             "</name><version>1.0.0</version><description>d</description><maintainer "
                             "email=\"a@b.c\">m</maintainer>"
                             "<license>Apache-2.0</license>" +
                             more + "<export><build_type>ament_cmake</build_type></export></package>");
  }
  void cmake(const std::string& more, const std::string& project = "r_description") {
    write("CMakeLists.txt",
          "cmake_minimum_required(VERSION 3.8)\nproject(" + project + ")\n" + more + "\nament_package()\n");
  }
};
class WorldRulesTest : public AuditRig {};
class ContactRulesTest : public AuditRig {};

TEST_F(ControllerRulesTest, GoodFileGivesNoFinding) {
  write("urdf/r.urdf", robot(good_hardware()));
  write("config/c.yaml", manager() + section());
  options.controllers = folder_ / "config/c.yaml";
  for (const Finding& f : report().findings) {
    EXPECT_FALSE(f.rule.starts_with("controllers.")) << f.rule << ": " << f.message;
  }
}

TEST_F(ControllerRulesTest, UnknownAndRepeatedJointsAreReported) {
  const auto unknown = of("controllers.unknown_joint", manager() + section("[shoulder, elbwo]"));
  ASSERT_THAT(unknown, SizeIs(1));
  EXPECT_THAT(unknown[0].message, HasSubstr("did you mean 'elbow'?"));
  EXPECT_EQ(unknown[0].where.line, 8);
  EXPECT_EQ(unknown[0].severity, Severity::error);
  EXPECT_THAT(of("controllers.joint_twice", manager() + section("[elbow, elbow]")), SizeIs(1));
  EXPECT_THAT(of("controllers.fixed_joint", manager() + section("[elbow, stand]")), SizeIs(1));
  const auto mimic = of("controllers.mimic_joint", manager() + section("[elbow, follower]"));
  ASSERT_THAT(mimic, SizeIs(1));
  EXPECT_THAT(mimic[0].message, HasSubstr("mimics 'elbow'"));
}

TEST_F(ControllerRulesTest, FaultsOfFoundFilesAreWarnings) {
  write("package.xml",
        "<package><name>r</name><version>1.0.0</version><description>d</description>"
        "<maintainer email=\"a\">m</maintainer><license>l</license></package>");
  write("urdf/r.urdf", robot(""));
  write("config/c.yaml", manager() + section("[elbwo]"));
  const auto found = AuditRig::of("controllers.unknown_joint");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].severity, Severity::warning);
  write("config/d.yaml", manager() + section("[other]"));
  EXPECT_THAT(AuditRig::of("controllers.unknown_joint"), IsEmpty())
      << "with two files it is ambiguous which one applies: expected no finding";
}

TEST_F(ControllerRulesTest, MissingHardwareInterfaceIsReported) {
  const auto command = of("controllers.command_interface", manager() + section("[elbow]", "", "[velocity]"));
  ASSERT_THAT(command, SizeIs(1));
  EXPECT_THAT(command[0].message, HasSubstr("it exports 'position'"));
  EXPECT_THAT(
      of("controllers.state_interface",
         manager() + "arm:\n  ros__parameters:\n    joints: [elbow]\n    command_interfaces: [position]\n"
                     "    state_interfaces: [position, velocity, acceleration]\n"),
      SizeIs(1));
  const auto both =
      of("controllers.command_interface", manager() + section("[shoulder, elbow]", "", "[effort]"));
  ASSERT_THAT(both, SizeIs(1));
  EXPECT_THAT(both[0].message, HasSubstr("they export 'position'"));
  const auto left = of("controllers.uncontrolled_joint", manager() + section("[elbow]"));
  ASSERT_THAT(left, SizeIs(1));
  EXPECT_EQ(left[0].subject, "joint 'shoulder'");
}

TEST_F(ControllerRulesTest, UnusedGainsAreReported) {
  const std::string gains = "    gains:\n      elbow: {p: 200.0, i: 1.0, d: 20.0}\n";
  const auto found = of("controllers.idle_gains", manager() + section("[shoulder, elbow]", gains));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].message, HasSubstr("no PID runs"));
  EXPECT_EQ(found[0].where.line, 12);
  EXPECT_THAT(of("controllers.idle_gains", manager() + section("[elbow]", gains, "[effort]")), IsEmpty());
  EXPECT_THAT(
      of("controllers.idle_gains", manager() + section("[elbow]", "    gains:\n      elbow: {p: 0.0}\n")),
      IsEmpty());
}

TEST_F(ControllerRulesTest, MissingDeclarationOrSectionIsReported) {
  const auto type =
      of("controllers.unknown_type",
         manager("", "100", "joint_trajectory_controller/JointTrajectoryControler") + section());
  ASSERT_THAT(type, SizeIs(1));
  EXPECT_THAT(type[0].message, HasSubstr("did you mean"));
  EXPECT_THAT(of("controllers.unknown_type", manager("", "100", "my_package/MyController") + section()),
              IsEmpty());
  EXPECT_THAT(
      of("controllers.unknown_type", manager("", "100", "admittance_controller/AdmittanceController")),
      IsEmpty());
  EXPECT_THAT(of("controllers.no_section", manager()), SizeIs(1));
  const auto typo =
      of("controllers.section_of_nobody", manager() + section("[elbow]", "", "[position]", "amr"));
  ASSERT_THAT(typo, SizeIs(1));
  EXPECT_THAT(typo[0].message, HasSubstr("did you mean 'arm'?"));
  EXPECT_THAT(of("controllers.no_type", manager("    other:\n      params_file: x.yaml\n") + section()),
              SizeIs(1));
}

TEST_F(ControllerRulesTest, OdometryWithoutVariancesIsReported) {
  const std::string declared = manager("", "100", "diff_drive_controller/DiffDriveController");
  const auto base = [](const std::string& more) {
    return "arm:\n  ros__parameters: {left_wheel_names: [shoulder], right_wheel_names: [elbow], "
           "wheel_separation: 0.4, wheel_radius: 0.1" +
           more + "}\n";
  };
  const auto silent = of("controllers.zero_covariance", declared + base(""));
  ASSERT_THAT(silent, SizeIs(2));
  EXPECT_THAT(silent[0].message, HasSubstr("'pose_covariance_diagonal' is all zero, the default"));
  const std::string variances = "_covariance_diagonal: [0.001, 0.001, 0.001, 0.001, 0.001, 0.01]";
  EXPECT_THAT(
      of("controllers.zero_covariance", declared + base(", pose" + variances + ", twist" + variances)),
      IsEmpty());
  EXPECT_THAT(
      of("controllers.unknown_joint",
         declared + "arm:\n  ros__parameters: {left_wheel_names: [sholder], right_wheel_names: [elbow]}\n"),
      SizeIs(1));
}

TEST_F(ControllerRulesTest, UpdateRateMismatchIsReported) {
  EXPECT_THAT(of("controllers.rate_uneven", manager("", "225") + section()), SizeIs(1));
  EXPECT_THAT(of("controllers.rate_uneven", manager("", "250") + section()), IsEmpty());
  EXPECT_THAT(of("controllers.rate_above_physics", manager("", "2000") + section()), SizeIs(1));
  EXPECT_THAT(of("controllers.rate_above_manager", manager() + section("[elbow]", "    update_rate: 200\n")),
              SizeIs(1));
  EXPECT_THAT(of("controllers.rate_uneven", manager() + section("[elbow]", "    update_rate: 30\n")),
              SizeIs(1));
  EXPECT_THAT(of("controllers.rate_uneven", manager() + section("[elbow]", "    update_rate: 25\n")),
              IsEmpty());
  EXPECT_THAT(of("controllers.rate_above_manager", manager() + section("[elbow]", "    update_rate: 50\n")),
              IsEmpty());
}

TEST_F(ControllerRulesTest, DoubleClaimIsReported) {
  const std::string second = "    other:\n      type: forward_command_controller/ForwardCommandController\n";
  const auto other = [](const std::string& joints) {
    return "other:\n  ros__parameters:\n    joints: " + joints + "\n    interface_name: position\n";
  };
  EXPECT_THAT(of("controllers.shared_claim", manager(second) + section() + other("[elbow]")), SizeIs(1));
  EXPECT_THAT(of("controllers.shared_claim", manager(second) + section("[shoulder]") + other("[elbow]")),
              IsEmpty());
}

TEST_F(ControllerRulesTest, WrongParameterNameOrTypeIsReported) {
  const auto name = of("controllers.unknown_parameter",
                       manager() + section("[elbow]", "    allow_partial_joint_goal: true\n"));
  ASSERT_THAT(name, SizeIs(1));
  EXPECT_THAT(name[0].message, HasSubstr("did you mean 'allow_partial_joints_goal'?"));
  const auto whole =
      of("controllers.whole_number", manager() + section("[elbow]", "    constraints: {goal_time: 2}\n"));
  ASSERT_THAT(whole, SizeIs(1));
  EXPECT_THAT(whole[0].fix, HasSubstr("2.0"));
  EXPECT_THAT(
      of("controllers.whole_number", manager() + section("[elbow]", "    constraints: {goal_time: 2.0}\n")),
      IsEmpty());
  EXPECT_THAT(of("controllers.parameter", manager() + section("[elbow]", "", "[positon]")), SizeIs(1));
  EXPECT_THAT(of("controllers.unreadable", "arm: [\n"), SizeIs(1));
}

TEST_F(ControllerRulesTest, MissingFileOfPluginIsReported) {
  write("config/c.yaml", manager() + section());
  const auto with = [&](const std::string& file) {
    write("urdf/r.urdf", robot(hardware(driven("shoulder") + driven("elbow")) +
                               gazebo_plugin("<parameters>" + (folder_ / file).string() + "</parameters>")));
    return AuditRig::of("controllers.file_missing");
  };
  const auto found = with("config/d.yaml");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].message, HasSubstr("did you mean 'c.yaml'?"));
  EXPECT_EQ(found[0].severity, Severity::error);
  EXPECT_THAT(with("config/c.yaml"), IsEmpty());
}

// The checked file is the one that `doppel up` uses: of several the one that fits, or one of a neighbouring
// package.
TEST_F(ControllerRulesTest, UnnamedFileIsThatOfTwin) {
  write("arm/package.xml", "<package format=\"3\"><name>arm</name></package>");
  write("arm/urdf/r.urdf", robot(good_hardware()));
  name_ = "arm/urdf/r.urdf";
  options.package_folder = folder_ / "arm";
  write("arm/config/other.yaml", manager() + section("[of_another_robot]"));
  write("arm/config/mine.yaml", manager() + section("[shoulder, elbwo]"));
  const auto own = AuditRig::of("controllers.unknown_joint");
  ASSERT_THAT(own, SizeIs(1));
  EXPECT_THAT(*own[0].where.file, HasSubstr("mine.yaml"));
  EXPECT_EQ(own[0].severity, Severity::warning)
      << "expected a warning: the file was found by search, not named";
  std::filesystem::remove_all(folder_ / "arm/config");
  write("arm_moveit/package.xml", "<package format=\"3\"><name>arm_moveit</name></package>");
  write("arm_moveit/config/ros2_controllers.yaml", manager() + section("[shoulder, elbwo]"));
  EXPECT_THAT(AuditRig::of("controllers.unknown_joint"), SizeIs(1));
}

TEST_F(ControllerRulesTest, OnlyFileWithoutRobotJointsIsChecked) {
  write("package.xml", "<package format=\"3\"><name>r</name></package>");
  write("urdf/r.urdf", robot(good_hardware()));
  write("config/c.yaml", manager() + section("[shouldre, elbwo]"));
  EXPECT_THAT(AuditRig::of("controllers.unknown_joint"), SizeIs(2));
}

TEST_F(PackageRulesTest, MissingManifestIsReported) {
  write("urdf/r.urdf", robot(""));
  cmake("install(DIRECTORY urdf DESTINATION share/${PROJECT_NAME})");
  EXPECT_THAT(of("package.no_manifest"), SizeIs(1));
  write("package.xml", "<package><name>r</name>");
  EXPECT_THAT(of("package.invalid"), SizeIs(1));
  write("package.xml", "<package><name>r_description</name></package>");
  EXPECT_THAT(of("package.incomplete"), SizeIs(1));
  package();
  EXPECT_THAT(of("package.no_manifest"), IsEmpty());
  EXPECT_THAT(of("package.invalid"), IsEmpty());
  EXPECT_THAT(of("package.incomplete"), IsEmpty());
}

TEST_F(PackageRulesTest, UninstalledFilesAreReported) {
  package();
  write("meshes/a.stl", "solid a\nendsolid a\n");
  write("urdf/r.urdf",
        robot("<link name=\"m\"><visual><geometry><mesh filename=\"package://r_description/meshes/a.stl\"/>"
              "</geometry></visual></link><joint name=\"jm\" type=\"fixed\"><parent link=\"base\"/><child "
              "link=\"m\"/></joint>"));
  cmake("install(DIRECTORY urdf launch\n  # meshes\n  DESTINATION share/${PROJECT_NAME})");
  const auto found = of("package.not_installed");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].subject, "folder 'meshes'");
  EXPECT_EQ(found[0].where.line, 3);
  EXPECT_THAT(found[0].fix, HasSubstr("install(DIRECTORY meshes"));
  for (const char* good : {"install(DIRECTORY urdf meshes DESTINATION share/${PROJECT_NAME}/)",
                           "foreach(dir urdf meshes)\n install(DIRECTORY ${dir}/ DESTINATION "
                           "share/${PROJECT_NAME}/${dir})\nendforeach()",
                           "install(DIRECTORY . DESTINATION share/r_description)",
                           "ament_auto_package(INSTALL_TO_SHARE urdf meshes)",
                           "install(DIRECTORY ${FOLDERS} DESTINATION share/${PROJECT_NAME})"}) {
    cmake(good);
    EXPECT_THAT(of("package.not_installed"), IsEmpty()) << good;
    EXPECT_THAT(of("package.installed_elsewhere"), IsEmpty()) << good;
  }
  cmake("install(DIRECTORY urdf meshes/ DESTINATION share/${PROJECT_NAME})");
  const auto elsewhere = of("package.installed_elsewhere");
  ASSERT_THAT(elsewhere, SizeIs(1));
  EXPECT_THAT(elsewhere[0].message, HasSubstr("share/r_description/a.stl"));
}

TEST_F(PackageRulesTest, SetupPyInstallRulesAreRead) {
  package();
  write("meshes/a.stl", "solid a\nendsolid a\n");
  write("urdf/r.urdf",
        robot("<link name=\"m\"><visual><geometry><mesh filename=\"package://r_description/meshes/a.stl\"/>"
              "</geometry></visual></link><joint name=\"jm\" type=\"fixed\"><parent link=\"base\"/><child "
              "link=\"m\"/></joint>"));
  const auto setup = [&](const std::string& entry) {
    write("setup.py",
          "package_name = 'r_description'\nsetup(name=package_name, data_files=[\n"
          "  ('share/ament_index/resource_index/packages', ['resource/' + package_name]),\n"
          "  ('share/' + package_name, ['package.xml']),\n"
          "  (os.path.join('share', package_name, 'urdf'), glob('urdf/*')),\n" +
              entry + "])\n");
    return of("package.not_installed");
  };
  EXPECT_THAT(setup(""), SizeIs(1));
  EXPECT_THAT(setup("  (os.path.join('share', package_name, 'meshes'), glob('meshes/*.dae')),\n"), SizeIs(1));
  EXPECT_THAT(setup("  (os.path.join('share', package_name, 'meshes'), glob('meshes/*.stl')),\n"), IsEmpty());
  EXPECT_THAT(
      setup("  (os.path.join('share', package_name, 'meshes'), glob(os.path.join('meshes', '*'))),\n"),
      IsEmpty());
  EXPECT_THAT(setup("  ('share/' + package_name + '/meshes', ['meshes/a.stl']),\n"), IsEmpty());
  EXPECT_THAT(setup("  *everything_below('meshes'),\n"), IsEmpty())
      << "expected no finding for an expression that cannot be evaluated";
  EXPECT_THAT(of("package.build_type"), SizeIs(1)) << "expected one finding for setup.py with ament_cmake";
}

TEST_F(PackageRulesTest, DifferingPackageNamesAreReported) {
  package();
  write("urdf/r.urdf", robot(""));
  cmake("", "r_descripton");
  EXPECT_THAT(of("package.project_name"), SizeIs(1));
  cmake("");
  EXPECT_THAT(of("package.project_name"), IsEmpty());
  const auto mesh = [&](const std::string& name) {
    return "<link name=\"m\"><visual><geometry><mesh filename=\"package://" + name +
           "/meshes/a.stl\"/></geometry></visual></link><joint name=\"jm\" type=\"fixed\"><parent "
           "link=\"base\"/><child "
           "link=\"m\"/></joint>";
  };
  const auto found = of("package.name_mismatch", mesh("r_desription"));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].fix, HasSubstr("r_description"));
  EXPECT_THAT(of("package.name_mismatch", mesh("r_description")), IsEmpty());
  EXPECT_THAT(of("package.name_mismatch", mesh("s_description")), IsEmpty())
      << "expected no finding for the package of another robot";
  EXPECT_THAT(of("package.dependency", mesh("s_description")), SizeIs(1));
  EXPECT_THAT(of("package.dependency", mesh("other_robot")), SizeIs(1));
  package("<exec_depend>other_robot</exec_depend>");
  EXPECT_THAT(of("package.dependency", mesh("other_robot")), IsEmpty());
}

TEST_F(PackageRulesTest, CatkinPackageWithoutInstallIsNote) {
  package("<buildtool_depend>catkin</buildtool_depend>");
  cmake("");
  write("urdf/r.urdf", robot(""));
  const auto found = of("package.not_installed");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].severity, Severity::note);
}

TEST_F(WorldRulesTest, MissingWorldLinkAndRootInertiaAreReported) {
  const std::string arm =
      "<robot name=\"r\"><link name=\"base\"><inertial><mass value=\"1\"/><inertia ixx=\"1e-3\" ixy=\"0\" "
      "ixz=\"0\" "
      "iyy=\"1e-3\" iyz=\"0\" izz=\"1e-3\"/></inertial></link><link name=\"a\"/><joint name=\"NAME\" "
      "type=\"continuous\"><parent link=\"base\"/><child link=\"a\"/></joint></robot>";
  write(name_, arm);
  EXPECT_THAT(of("world.no_world_link"), SizeIs(1));
  EXPECT_THAT(of("world.root_inertia"), SizeIs(1));
  std::string rover = arm;
  rover.replace(rover.find("NAME"), 4, "left_wheel");
  write(name_, rover);
  EXPECT_THAT(of("world.no_world_link"), IsEmpty())
      << "expected no finding: a mobile robot is not fixed to the world";
  write(name_,
        "<robot name=\"r\"><link name=\"base\"/><link name=\"a\"/><link name=\"shank\"/><joint name=\"hip\" "
        "type=\"continuous\"><parent link=\"base\"/><child link=\"a\"/></joint><joint name=\"knee\" "
        "type=\"continuous\"><parent link=\"a\"/><child link=\"shank\"/></joint></robot>");
  EXPECT_THAT(of("world.no_world_link"), IsEmpty()) << "expected no finding: a robot on legs";
  write(name_, robot(""));
  EXPECT_THAT(of("world.no_world_link"), IsEmpty());
  EXPECT_THAT(of("world.root_inertia"), IsEmpty());
}

TEST_F(WorldRulesTest, LinkBelowGroundIsReported) {
  const auto at = [&](const std::string& z) {
    std::string text = robot("");
    const std::string child = "<child link=\"base\"/>";
    text.replace(text.find(child), child.size(), child + "<origin xyz=\"0 0 " + z + "\"/>");
    write(name_, text);
  };
  at("-0.02");
  const auto below = of("world.below_ground");
  ASSERT_THAT(below, SizeIs(1));
  EXPECT_THAT(below[0].message, HasSubstr("20.0 mm"));
  at("0.7");
  EXPECT_THAT(of("world.above_ground"), SizeIs(1));
  at("0");
  EXPECT_THAT(of("world.below_ground"), IsEmpty());
  EXPECT_THAT(of("world.above_ground"), IsEmpty());
}

TEST_F(ContactRulesTest, TooManyPairsReportsDeepest) {
  std::string body;
  for (int i = 0; i < 20; ++i) {
    const std::string name = "k" + std::to_string(i);
    body +=
        "<link name=\"" + name +
        "\"><collision><geometry><box size=\"0.1 0.1 0.1\"/></geometry></collision></link><joint name=\"j" +
        name + "\" type=\"revolute\"><origin xyz=\"1 0 0\"/><parent link=\"base\"/><child link=\"" + name +
        "\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>\n";
  }
  const auto found = of("collision.overlap", body);  // 190 pairs
  EXPECT_THAT(found, SizeIs(51));
  EXPECT_EQ(found.back().severity, Severity::note);
  EXPECT_THAT(found.back().message, HasSubstr("140 more pairs"));
}

TEST_F(ContactRulesTest, OverlapAtStartIsReported) {
  const auto block = [](const std::string& z) {
    return "<link name=\"block\"><collision><origin xyz=\"0 0 " + z +
           "\"/><geometry><box size=\"0.05 0.05 0.05\"/></geometry></collision></link><joint name=\"bolted\" "
           "type=\"fixed\"><parent link=\"base\"/><child link=\"block\"/></joint>";
  };
  const auto found = of("collision.overlap", block("0.25"));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].severity, Severity::warning);
  EXPECT_THAT(found[0].subject, HasSubstr("'lower' and 'block'"));
  EXPECT_THAT(of("collision.overlap", block("0.05")), IsEmpty())
      << "expected no finding: the link is fixed to the base and is one body with it";
  EXPECT_THAT(of("collision.neighbours", block("0.16")), SizeIs(1))
      << "expected a finding: the block is inside the upper arm";
  EXPECT_THAT(of("collision.neighbours", block("0.05")), IsEmpty());
}

TEST_F(ContactRulesTest, CoupledLinksAreAllowed) {
  std::string gears = "<robot name=\"r\"><link name=\"world\"/>";
  for (const std::string side : {"left", "right"}) {
    gears += "<link name=\"" + side +
             "\"><collision><geometry><cylinder radius=\"0.01\" length=\"0.005\"/></geometry>"
             "</collision></link><joint name=\"j_" +
             side + "\" type=\"revolute\"><parent link=\"world\"/><child link=\"" + side +
             "\"/><origin xyz=\"" + (side == "left" ? "0" : "0.018") +
             " 0 0.1\"/><axis xyz=\"0 0 1\"/><limit lower=\"0\" "
             "upper=\"1\" effort=\"1\" velocity=\"1\"/>" +
             (side == "left" ? "" : "<mimic joint=\"j_left\"/>") + "</joint>";
  }
  gears += "</robot>";
  write(name_, gears);
  EXPECT_THAT(of("collision.overlap"), IsEmpty()) << "expected no finding: gears mesh";
  const std::string mimic = "<mimic joint=\"j_left\"/>";
  gears.erase(gears.find(mimic), mimic.size());
  write(name_, gears);
  EXPECT_THAT(of("collision.overlap"), SizeIs(1));
}

TEST_F(ContactRulesTest, LinkWithoutCollisionIsReported) {
  const auto found =
      of("collision.missing",
         "<link name=\"m\"><visual><geometry><box size=\"1 1 1\"/></geometry></visual></link><joint "
         "name=\"jm\" type=\"fixed\"><parent link=\"base\"/><child link=\"m\"/></joint>");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].subject, "link 'm'");
  EXPECT_THAT(of("collision.missing", ""), IsEmpty());
}

TEST_F(PackageRulesTest, LicenceThatPermitsNothingIsNote) {
  write("urdf/r.urdf", robot(good_hardware()));
  const auto with_license = [&](const std::string& license, const std::string& version = "1.0.0") {
    write("package.xml", "<package format=\"3\"><name>r_description</name><version>" + version +
                             "</version><description>d"
                             "</description><maintainer email=\"a@b.c\">m</maintainer><license>" +
                             license + "</license></package>");
    return AuditRig::of("package.license");
  };
  const auto placeholder = with_license("TODO: License declaration");
  ASSERT_THAT(placeholder, SizeIs(1));
  EXPECT_EQ(placeholder[0].severity, Severity::note);
  EXPECT_THAT(placeholder[0].message, HasSubstr("a placeholder"));
  EXPECT_THAT(with_license("TODO: License declaration", "0.0.0"), IsEmpty()) << "a new package";
  EXPECT_THAT(with_license("CC-BY-NC-4.0"), SizeIs(1));
  for (const char* permits : {"Apache-2.0", "BSD", "MIT", "CC-BY-4.0"})
    EXPECT_THAT(with_license(permits), IsEmpty());
}

}  // namespace
}  // namespace doppel
