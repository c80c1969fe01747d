// The rules on launch files, in all notations, and that their code has no effect.
#include "doppel/review/audit/test/audit_rig.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class LaunchRulesTest : public AuditRig {
 protected:
  void package(const std::string& more = "", const std::string& name = "r_description") {
    write("package.xml", "<package format=\"3\"><name>" + name +
                             "</name><version>1.0.0</version><description>d</description><maintainer "
                             "email=\"a@b.c\">m</maintainer>"
                             "<license>Apache-2.0</license>" +
                             more + "<export><build_type>ament_cmake</build_type></export></package>");
  }
  // Its entities begin in line 8, or after the lines that come before them.
  void launch_file(const std::string& name, const std::string& entities, const std::string& before = "") {
    write(
        "launch/" + name,
        "import xacro\nfrom launch.actions import *\nfrom launch.conditions import *\n"
        "from launch.substitutions import *\nfrom launch_ros.actions import *; from launch_ros.substitutions "
        "import *; from launch import *; from ament_index_python import *\n"
        "def generate_launch_description():\n" +
            before + "  return LaunchDescription([\n" + entities + "  ])\n");
  }
};

TEST_F(LaunchRulesTest, FaultsOfLaunchFilesAreReported) {
  package();
  write("urdf/r.urdf", robot(""));
  const auto spawn = [&](const std::string& z) {
    launch_file("gazebo.launch.py",
                "    Node(package='ros_gz_sim', executable='create',\n"
                "      arguments=['-topic', 'robot_description', '-z', '" +
                    z + "']),\n");
    return of("package.spawn_height");
  };
  const auto found = spawn("0.32");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].where.line, 9);
  EXPECT_EQ(found[0].where.column, 49);
  EXPECT_THAT(spawn("0.0"), IsEmpty());
  name_ = "urdf/r.urdf.xacro";
  write(name_,
        "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:arg name=\"use_sim\" "
        "default=\"false\"/>\n<xacro:if value=\"$(arg use_sim)\"><gazebo/></xacro:if>" +
            tree() + "</robot>");
  const auto expand = [&](const std::string& arguments) {
    launch_file(
        "gazebo.launch.py", "    # mappings\n    Node(package='ros_gz_sim', executable='create'),\n",
        "  doc = xacro.process_file(get_package_share_directory('r_description') + '/urdf/r.urdf.xacro'" +
            arguments + ")\n");
    return of("package.launch_mapping");
  };
  const auto mapping = expand("");
  ASSERT_THAT(mapping, SizeIs(1));
  EXPECT_EQ(mapping[0].where.line, 7);
  EXPECT_EQ(mapping[0].where.column, 15);
  EXPECT_THAT(mapping[0].fix, HasSubstr("'use_sim': 'true'"));
  EXPECT_THAT(expand(", mappings={'use_sim': 'true'}"), IsEmpty());
  launch_file("gazebo.launch.py", "    Node(package='rviz2', executable='rviz2'),\n",
              "  xacro.process_file(get_package_share_directory('r_description') + '/urdf/r.urdf.xacro')\n");
  EXPECT_THAT(of("package.launch_mapping"), IsEmpty()) << "expected no finding: a view needs no simulator";
}

TEST_F(LaunchRulesTest, MissingLaunchDependencyIsReported) {
  write("urdf/r.urdf", robot(""));
  launch_file("view.launch.py",
              "    Node(package='rviz2', executable='a'),\n"
              "    Node(\n      package=\"joint_state_publisher_gui\", executable='b'),\n"
              "    # Node(package='gone')\n",
              "  get_package_share_directory('r_description')\n  FindPackageShare('ros_gz_sim')\n");
  package("<exec_depend>rviz2</exec_depend><exec_depend>ros_gz</exec_depend>");
  const auto found = of("package.launch_dependency");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].message, HasSubstr("'joint_state_publisher_gui'"));
  EXPECT_EQ(found[0].where.line, 12);
  EXPECT_EQ(found[0].where.column, 7);
  package(
      "<depend>rviz2</depend><depend>ros_gz</depend><exec_depend>joint_state_publisher_gui</exec_depend>");
  EXPECT_THAT(of("package.launch_dependency"), IsEmpty());
}

TEST_F(LaunchRulesTest, LaunchFilesOfAllNotationsAreRead) {
  write("urdf/r.urdf", robot(""));
  package();
  const auto names = [&] {
    std::vector<std::string> out;
    for (const Finding& one : of("package.launch_dependency")) {
      const std::size_t begin = one.message.find('\'') + 1;
      out.push_back(std::to_string(one.where.line) + " " +
                    one.message.substr(begin, one.message.find('\'', begin) - begin));
    }
    return out;
  };
  write("launch/a.launch.xml",
        "<launch>\n<node pkg=\"of_xml\" exec=\"e\"\n args=\"$(find-pkg-share looked_up)/x\"/>\n</launch>\n");
  write("launch/b.launch.yaml", "launch:\n- node:\n    pkg: of_yaml\n    exec: e\n");
  write("launch/c.launch", "<launch>\n<node pkg=\"of_ros1\" type=\"e\" name=\"n\"/>\n</launch>\n");
  write("launch/parameters.yaml", "node:\n  pkg: no_launch_file\n");
  write("launch/helper.py", "import os\nos.abort()\n");
  EXPECT_THAT(names(), testing::UnorderedElementsAre("2 of_xml", "3 looked_up", "2 of_yaml", "2 of_ros1"));
}

// Both branches of a condition count, and what follows an error.
TEST_F(LaunchRulesTest, BranchesAndRestOfFaultyLaunchFileAreRead) {
  write("urdf/r.urdf", robot(""));
  package();
  launch_file(
      "a.launch.py",
      "    DeclareLaunchArgument('gui', default_value='false'),\n"
      "    Node(package='when_true', executable='e', condition=IfCondition(LaunchConfiguration('gui'))),\n"
      "    Node(package='when_false', executable='e', "
      "condition=UnlessCondition(LaunchConfiguration('gui'))),\n"
      "    Node(package='faulty', executable=LaunchConfiguration('undeclared')),\n"
      "    Node(package='after_it', executable='e'),\n");
  launch_file("b.launch.py",
              "    DeclareLaunchArgument('required'),\n"
              "    Node(package='without_value', executable='e'),\n"
              "    Node(package='conditional', executable='e', condition=IfCondition("
              "LaunchConfiguration('required'))),\n");
  std::string names;
  for (const Finding& one : of("package.launch_dependency")) names += one.message;
  EXPECT_THAT(names, AllOf(HasSubstr("'when_true'"), HasSubstr("'when_false'"), HasSubstr("'after_it'")));
  const auto unread = of("package.launch_unread");
  ASSERT_THAT(unread, SizeIs(1));
  EXPECT_EQ(unread[0].severity, Severity::note);
  EXPECT_EQ(unread[0].where.line, 11);
  EXPECT_THAT(unread[0].message, HasSubstr("it is not read completely: launch rejects this line"));
}

// A check reads files of anyone: they are programs, and have no effect.
TEST_F(LaunchRulesTest, LaunchFileHasNoEffectWhileItIsChecked) {
  write("urdf/r.urdf", robot(""));
  package();
  const std::string folder = folder_.string();
  launch_file("a.launch.py", "    Node(package='after_all', executable='e'),\n",
              "  import os, pathlib, signal, socket, subprocess, ctypes\n"
              "  open('" +
                  folder +
                  "/written', 'w').write('x')\n"
                  "  pathlib.Path('" +
                  folder +
                  "/by_path').write_text('x')\n"
                  "  subprocess.run(['touch', '" +
                  folder +
                  "/by_program'])\n"
                  "  os.system('touch " +
                  folder +
                  "/by_shell')\n"
                  "  os.makedirs('" +
                  folder +
                  "/made')\n"
                  "  ctypes.CDLL(None).creat(b'" +
                  folder +
                  "/by_library', 0o600)\n"
                  "  ctypes.CDLL(None).unlink(b'" +
                  folder +
                  "/package.xml')\n"
                  "  ctypes.CDLL(None).kill(os.getppid(), 9)\n");
  launch_file("b.launch.py", "    Node(package='never', executable='e'),\n",
              "  import socket; socket.socket()\n");
  launch_file("c.launch.py", "    Node(package='never', executable='e'),\n", "  import os; os._exit(0)\n");
  launch_file("d.launch.py", "    Node(package='last', executable='e'),\n", "  raise SystemExit(3)\n");
  launch_file("e.launch.py", "    Node(package='last', executable='e'),\n");
  std::string names, notes;
  for (const Finding& one : of("package.launch_dependency")) names += one.message;
  EXPECT_THAT(names,
              AllOf(HasSubstr("'after_all'"), HasSubstr("'last'"), testing::Not(HasSubstr("'never'"))));
  for (const Finding& one : of("package.launch_unread"))
    notes += one.subject + ":" + std::to_string(one.where.line) + ": " + one.message + " | " + one.fix + "\n";
  for (const char* text :
       {"'a.launch.py':8: a file was not written", "'a.launch.py':9: a file was not written",
        "'a.launch.py':10: a command was not run", "'a.launch.py':11: a command was not run",
        "'a.launch.py':12: a folder was not made",
        "'b.launch.py':7: it is not read completely: it does what is not permitted while it is checked | "
        "nothing, if it is on purpose",
        "'c.launch.py':0: the launch file ended its reader",
        "'d.launch.py':1: it is not read completely: it ends its reader"})
    EXPECT_THAT(notes, HasSubstr(text));
  for (const char* name : {"written", "by_path", "by_program", "by_shell", "made", "by_library"})
    EXPECT_FALSE(std::filesystem::exists(folder_ / name)) << name;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "package.xml"));
}

// A report of a stranger's package may be published. The file tries all ways by which its text is reported.
TEST_F(LaunchRulesTest, WhatLaunchFileReadsIsNotReported) {
  setenv("DOPPEL_TEST_PASSWORD", "s3cr3t42", 1);
  write("urdf/r.urdf", robot(""));
  write("private", "s3cr3t42: Of.A.Person");
  package();
  const std::string read = "  import os\n  found = open('" + (folder_ / "private").string() + "').read()\n";
  launch_file("a.launch.py",
              "    Node(package='name_of_the_variable_' + os.environ.get('DOPPEL_TEST_PASSWORD', 'none'), "
              "executable='e'),\n    Node(package=found, executable='e'),\n",
              read + "  open('/tmp/' + found, 'w')\n  os.makedirs('/tmp/' + found)\n  os.system(found)\n");
  launch_file("b.launch.py", "", read + "  raise RuntimeError(found)\n");
  launch_file("c.launch.py", "",
              read + "  raise type(found.replace(': ', '').replace('.', ''), (Exception,), {})()\n");
  launch_file("d.launch.py", "", read + "  compile('(', found, 'exec')\n");
  launch_file(
      "e.launch.py", "",
      read + "  import json\n  place = {'file': '" + folder_.string() +
          "/' + found, 'line': 1}\n  result = {'files': [], 'arguments': [], 'expansions': [], 'made': "
          "{},\n    'actions': [dict(place, kind='node', package=found)], 'packages': [dict(place, "
          "package='placed')],\n    'warnings': [dict(place, rule='launch.confined', text=found, "
          "fix=found)],\n"
          "    'error': dict(place, kind=found, text=found, fix=found)}\n"
          "  os.write(3, (json.dumps({'result': result}) + chr(10)).encode())\n");
  std::string texts;
  for (const Finding& one : report().findings)
    texts += one.where.place() + one.subject + one.message + one.fix + "\n";
  EXPECT_THAT(texts, HasSubstr("'name_of_the_variable_none'"));
  EXPECT_THAT(texts, HasSubstr("it is not read completely: RuntimeError"));
  EXPECT_THAT(texts, testing::Not(testing::AnyOf(HasSubstr("s3cr3t42"), HasSubstr("Person"))));
}

// The answers of a reader are those of the launch file, which has its pipe.
TEST_F(LaunchRulesTest, AnswersWithoutEndAreRefused) {
  write("urdf/r.urdf", robot(""));
  package();
  const std::string put = "  import os\n  def put(data):\n    while data: data = data[os.write(3, data):]\n";
  const std::string head =
      "b'{\"result\":{\"files\":[],\"arguments\":[],\"actions\":[{\"kind\":\"node\",\"words\":'";
  launch_file("a.launch.py", "", put + "  put(" + head + " + b'[' * 5000 + b']' * 5000 + b'}]}}\\n')\n");
  launch_file("b.launch.py", "", put + "  for i in range(17): put(b'x' * 1048576)\n");
  std::string notes;
  for (const Finding& one : of("package.launch_unread")) notes += one.subject + ": " + one.message + "\n";
  EXPECT_THAT(notes,
              HasSubstr("'a.launch.py': the records of the launch file are too many, or nested too deeply"));
  EXPECT_THAT(notes, HasSubstr("'b.launch.py': the records of the launch file are larger than 16 MB"));
}

// Each answer is memory and time of this process.
TEST_F(LaunchRulesTest, RequestsBeyondTheirNumberEndReader) {
  write("urdf/r.urdf", robot(""));
  package();
  const auto notes_of = [&](int requests) {
    launch_file("a.launch.py", "",
                "  import os\n  for i in range(" + std::to_string(requests) +
                    "):\n    os.write(3, b'{}\\n')\n    os.read(4, 9)\n");
    std::string out;
    for (const Finding& one : of("package.launch_unread")) out += one.subject + ": " + one.message + "\n";
    return out;
  };
  EXPECT_EQ(notes_of(4000), "");
  EXPECT_THAT(notes_of(5001), HasSubstr("'a.launch.py': the launch file takes too long to read"));
}

TEST_F(LaunchRulesTest, FilesAfterFourThatEndTheirReadersAreNotRead) {
  write("urdf/r.urdf", robot(""));
  package();
  for (const char* name : {"a.launch.py", "b.launch.py", "c.launch.py", "d.launch.py", "e.launch.py"})
    launch_file(name, "", "  import os; os._exit(0)\n");
  std::string notes;
  for (const Finding& one : of("package.launch_unread")) notes += one.message + "\n";
  EXPECT_THAT(notes, HasSubstr("1 of 5 launch files are not read: too many files end their reader"));
}

}  // namespace
}  // namespace doppel
