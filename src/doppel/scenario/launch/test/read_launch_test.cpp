// Launch files in all notations, read without ROS.
#include <gmock/gmock.h>

#include "launch_fixture.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;
using testing::SizeIs;

class ReadLaunchTest : public LaunchFixture {
 protected:
  // The executables of all nodes below, in their order.
  static std::vector<std::string> executables(const std::vector<LaunchRecord>& records) {
    std::vector<std::string> out;
    for (const LaunchRecord& record : records) {
      if (record.kind == LaunchKind::node) out.push_back(record.executable);
      const std::vector<std::string> below = executables(record.children);
      out.insert(out.end(), below.begin(), below.end());
    }
    return out;
  }
};

TEST_F(ReadLaunchTest, NodeHasItsNamesParametersAndLine) {
  const LaunchDescription read =
      this->read(python("DeclareLaunchArgument('rate', default_value='50', description='of what'),\n"
                        "PushRosNamespace('left'),\n"
                        "Node(package='p', executable='e', name='n', namespace='inner', arguments=['-a', "
                        "LaunchConfiguration('rate')],\n"
                        "  parameters=[{'rate': LaunchConfiguration('rate'), 'text': 'no', 'deep': {'er': "
                        "[1, 2.5]}}, 'some.yaml'],\n"
                        "  remappings=[('a', ['b', 'c'])])"));
  ASSERT_THAT(read.arguments, SizeIs(1));
  EXPECT_EQ(read.arguments[0].description, "of what");
  EXPECT_EQ(read.arguments[0].value, "50");
  ASSERT_THAT(read.records, SizeIs(1));
  const LaunchRecord& node = read.records[0];
  EXPECT_EQ(node.kind, LaunchKind::node);
  EXPECT_EQ(node.name_space, "left/inner");
  EXPECT_THAT(node.words, ElementsAre("-a", "50"));
  EXPECT_THAT(node.remappings, ElementsAre(Pair("a", "bc")));
  ASSERT_THAT(node.parameters, SizeIs(2));
  // A substitution's text is read as YAML, a plain text is not, as in launch_ros.
  EXPECT_EQ(node.parameter("rate"), "50");
  EXPECT_THAT(
      node.parameters[0].values,
      testing::UnorderedElementsAre(Pair("rate", "50"), Pair("text", "\"no\""), Pair("deep.er", "[1,2.5]")));
  EXPECT_EQ(node.parameters[1].file, "some.yaml");
  EXPECT_EQ(node.source.line, 14);
}

TEST_F(ReadLaunchTest, ArgumentsOfCommandLineReplaceDefaults) {
  const auto file = python(
      "DeclareLaunchArgument('kind', default_value='a', choices=['a', 'b']),\n"
      "Node(package='p', executable=['is_', LaunchConfiguration('kind')])");
  EXPECT_THAT(executables(read(file).records), ElementsAre("is_a"));
  EXPECT_THAT(executables(read(file, {{"kind", "b"}}).records), ElementsAre("is_b"));
  EXPECT_THAT(error_of(file, {{"kind", "c"}}), HasSubstr("one of a, b"));
  EXPECT_THAT(error_of(file, {{"kid", "b"}}), HasSubstr("did you mean 'kind'?"));
}

TEST_F(ReadLaunchTest, RequiredArgumentIsNamedWithItsDescription) {
  const std::string error =
      error_of(python("DeclareLaunchArgument('robot_ip', description='of the controller')"));
  EXPECT_THAT(error, HasSubstr("arm.launch.py:12: error: the argument 'robot_ip' is required"));
  EXPECT_THAT(error, HasSubstr("append robot_ip:=VALUE  (of the controller)"));
}

TEST_F(ReadLaunchTest, ConditionsGroupsAndFunctionsDecideWhatIsThere) {
  const auto file = python(
      "DeclareLaunchArgument('gui', default_value='false'),\n"
      "Node(package='p', executable='shown', condition=IfCondition(LaunchConfiguration('gui'))),\n"
      "Node(package='p', executable='plain', condition=UnlessCondition(LaunchConfiguration('gui'))),\n"
      "GroupAction([SetLaunchConfiguration('gui', 'true'), Node(package='p', executable='in_group',\n"
      "  condition=IfCondition(LaunchConfiguration('gui')))]),\n"
      "Node(package='p', executable='after_group', condition=IfCondition(LaunchConfiguration('gui'))),\n"
      "Node(package='p', executable='computed', condition=IfCondition(PythonExpression([\"'\", "
      "LaunchConfiguration('gui'), \"' == 'false' and \", '1 < 2']))),\n"
      "OpaqueFunction(function=many, args=['x'])",
      "def many(context, prefix):\n"
      "  return [Node(package='p', executable=prefix + str(i) + LaunchConfiguration('gui').perform(context)) "
      "for i in range(2)]\n");
  EXPECT_THAT(executables(read(file).records),
              ElementsAre("plain", "in_group", "computed", "x0false", "x1false"));
  EXPECT_EQ(read(file).records[0].kind, LaunchKind::skipped);
  EXPECT_EQ(read(file).records[0].text, "gui is false");
}

TEST_F(ReadLaunchTest, ActionsOfUsersHaveInterfaceOfLaunch) {
  const LaunchDescription read = this->read(python(
      "Pair('a'), Pair('b', condition=IfCondition('false')), Named(package='p', executable='c'), Bare()",
      "from launch import Action, LaunchDescriptionEntity\n"
      "class Pair(Action):\n"
      "  def __init__(self, name, **named):\n"
      "    super().__init__(**named)\n"
      "    self.name = name\n"
      "  def execute(self, context):\n"
      "    super().execute(context)\n"
      "    return [Node(package='p', executable=self.name + end) for end in '12']\n"
      "class Named(Node):\n"
      "  def execute(self, context):\n"
      "    return super().execute(context)\n"
      "class Bare(LaunchDescriptionEntity):\n"
      "  def visit(self, context):\n"
      "    return [Node(package='p', executable='d')]\n"));
  EXPECT_THAT(executables(read.records), ElementsAre("a1", "a2", "c", "d"));
}

TEST_F(ReadLaunchTest, IncludesAreReadInTheirOwnNotation) {
  write("arm_description/launch/inner.launch.xml",
        "<launch><arg name=\"who\" default=\"guest\"/><node pkg=\"p\" exec=\"xml_$(var who)\"/></launch>");
  write("arm_description/launch/inner.launch.yaml",
        "launch:\n- arg: {name: who, default: guest}\n- node: {pkg: p, exec: yaml_$(var who)}\n");
  const LaunchDescription read =
      this->read(python("IncludeLaunchDescription(AnyLaunchDescriptionSource(PathJoinSubstitution(["
                        "FindPackageShare('arm_description'),\n"
                        "  'launch', 'inner.launch.xml'])), launch_arguments={'who': 'a'}.items()),\n"
                        "GroupAction([IncludeLaunchDescription([ThisLaunchFileDir(), '/inner.launch.yaml'], "
                        "launch_arguments=[('who', 'b')])]),\n"
                        "IncludeLaunchDescription(PythonLaunchDescriptionSource([FindPackageShare('elsewhere'"
                        "), '/launch/x.launch.py']))"));
  EXPECT_THAT(executables(read.records), ElementsAre("xml_a", "yaml_b"));
  EXPECT_THAT(read.files, SizeIs(3));
  EXPECT_EQ(read.records.back().package, "elsewhere");
  EXPECT_TRUE(read.records.back().missing);
}

TEST_F(ReadLaunchTest, DescriptionRemembersXacroFileAndArguments) {
  const LaunchDescription read = this->read(
      python("Node(package='robot_state_publisher', executable='robot_state_publisher', "
             "parameters=[{'robot_description':\n"
             "  ParameterValue(Command([FindExecutable(name='xacro'), ' ', PathJoinSubstitution([\n"
             "  FindPackageShare('arm_description'), 'urdf', 'arm.urdf.xacro']), ' length:=2']), "
             "value_type=str)}])"));
  ASSERT_THAT(read.records[0].descriptions, SizeIs(1));
  const LaunchedRobotText& robot = read.records[0].descriptions[0].second;
  EXPECT_EQ(robot.source, workspace_ / "arm_description/urdf/arm.urdf.xacro");
  EXPECT_THAT(robot.arguments, ElementsAre(Pair("length", "2")));
  EXPECT_THAT(robot.text, HasSubstr("<mass value=\"2\"/>"));
}

TEST_F(ReadLaunchTest, XacroModuleAndReadFilesAreDescriptionsToo) {
  write("arm_description/urdf/plain.urdf", "<robot name=\"plain\"><link name=\"a\"/></robot>");
  const LaunchDescription read = this->read(python(
      "Node(package='p', executable='a', parameters=[{'robot_description': expanded.toxml()}]),\n"
      "Node(package='p', executable='b', parameters=[{'robot_description': FileContent([FindPackageShare("
      "'arm_description'), '/urdf/plain.urdf'])}]),\n"
      "Node(package='p', executable='c', parameters=[{'robot_description': '<robot name=\"made\"/>'}])",
      "import os, xacro\n"
      "from ament_index_python.packages import get_package_share_directory\n"
      "expanded = xacro.process_file(os.path.join(get_package_share_directory('arm_description'), 'urdf',\n"
      "  'arm.urdf.xacro'), mappings={'length': '3'})\n"));
  EXPECT_THAT(read.records[0].descriptions[0].second.arguments, ElementsAre(Pair("length", "3")));
  EXPECT_EQ(read.records[1].descriptions[0].second.source.filename(), "plain.urdf");
  EXPECT_TRUE(read.records[2].descriptions[0].second.source.empty());
}

TEST_F(ReadLaunchTest, UnknownModulesAndActionsAreNamedAndSkipped) {
  const LaunchDescription read =
      this->read(python("Odd(1, a=2),\nNode(package='p', executable='e', parameters=[Strange('file')])",
                        "from odd_package.actions import Odd\nfrom odd_package import Strange\n"));
  EXPECT_EQ(read.records[0].kind, LaunchKind::unknown);
  EXPECT_EQ(read.records[0].name, "odd_package.actions.Odd");
  EXPECT_EQ(read.records[0].source.line, 14);
  EXPECT_EQ(read.records[1].executable, "e");
  ASSERT_FALSE(read.diagnostics.all().empty());
  EXPECT_THAT(read.diagnostics.all()[0].message, HasSubstr("'odd_package' is not on this machine"));
  EXPECT_EQ(read.diagnostics.all()[0].where.line, 10);
}

TEST_F(ReadLaunchTest, ErrorsOfUsersCodeHaveTheirLine) {
  EXPECT_THAT(error_of(python("Node(package='p', executable=nonsense)")),
              HasSubstr("arm.launch.py:12: error: NameError: name 'nonsense' is not defined"));
  EXPECT_THAT(error_of(python("Node(package='p'")), HasSubstr("arm.launch.py:12: error: SyntaxError"));
  EXPECT_THAT(error_of(python("Node(package='p', executable=LaunchConfiguration('undeclared'))")),
              HasSubstr("launch configuration 'undeclared' does not exist"));
  EXPECT_THAT(error_of(python("OpaqueFunction(function=lambda context: 1 / 0)")),
              HasSubstr("arm.launch.py:12: error: ZeroDivisionError"));
  EXPECT_THAT(error_of(write("x.launch.py", "import sys\nsys.exit(3)\n")), HasSubstr("launch.unreadable"));
  EXPECT_THAT(error_of(write("x.launch.py", "a = 1\n")),
              HasSubstr("no function generate_launch_description()"));
  EXPECT_THAT(error_of(write("x.launch.xml", "<launch>\n<node>\n</launch>")),
              HasSubstr("x.launch.xml:3: error: this is not XML"));
  EXPECT_THAT(error_of(write("x.launch.yaml", "launch:\n- node: {pkg: p\n")), HasSubstr("this is not YAML"));
  const auto circle = write("c.launch.xml", "<launch><include file=\"$(dirname)/c.launch.xml\"/></launch>");
  EXPECT_THAT(error_of(circle), HasSubstr("includes are in a circle"));
}

TEST_F(ReadLaunchTest, EventsNameActionsThatTheyFollow) {
  const LaunchDescription read =
      this->read(python("first := Node(package='p', executable='first'),\n"
                        "RegisterEventHandler(OnProcessExit(target_action=first, on_exit=[Node(package='p', "
                        "executable='second')])),\n"
                        "TimerAction(period=5.0, actions=[Node(package='p', executable='third')])"));
  EXPECT_EQ(read.records[1].kind, LaunchKind::event);
  EXPECT_THAT(read.records[1].after, ElementsAre(read.records[0].id));
  EXPECT_EQ(read.records[2].period, 5);
  EXPECT_THAT(executables(read.records), ElementsAre("first", "second", "third"));
}

TEST_F(ReadLaunchTest, XmlHasGroupsConditionsAndParameters) {
  const LaunchDescription read = this->read(write("arm_description/launch/arm.launch.xml", R"X(<launch>
  <arg name="n" default="2"/>
  <let name="twice" value="$(eval '$(var n) * 2')"/>
  <group if="$(eval '$(var n) > 1')"><push_ros_namespace namespace="left"/>
    <node pkg="p" exec="e" name="n$(var twice)" args="-x 'a b'">
      <param name="urdf" type="str"
       value="$(command 'xacro $(find-pkg-share arm_description)/urdf/arm.urdf.xacro')"/>
      <param name="number" value="3"/>
      <param from="p.yaml"/>
      <remap from="a" to="b"/>
      <env name="E" value="v"/>
    </node>
  </group>
  <node pkg="p" exec="never" unless="true"/>
  <odd_tag/>
</launch>)X"));
  const LaunchRecord& node = read.records[0];
  EXPECT_EQ(node.name, "n4");
  EXPECT_EQ(node.name_space, "left");
  EXPECT_THAT(node.words, ElementsAre("-x", "a b"));
  EXPECT_EQ(node.parameter("number"), "3");
  EXPECT_THAT(node.parameter("urdf").value_or(""), HasSubstr("<robot"));
  EXPECT_THAT(node.environment, ElementsAre(Pair("E", "v")));
  EXPECT_EQ(node.source.line, 5);
  EXPECT_EQ(read.records[1].kind, LaunchKind::skipped);
  EXPECT_EQ(read.records[2].name, "<odd_tag>");
}

TEST_F(ReadLaunchTest, RoslaunchHasItsOwnRules) {
  write("arm_description/launch/inner.launch",
        "<launch><arg name=\"a\" default=\"none\"/><node pkg=\"p\" type=\"inner_$(arg a)\" "
        "name=\"i\"/></launch>");
  const LaunchDescription read = this->read(write("arm_description/launch/arm.launch", R"X(<launch>
  <arg name="a" default="1"/>
  <param name="robot_description"
   command="$(find xacro)/xacro --inorder '$(find arm_description)/urdf/arm.urdf.xacro' length:=$(arg a)"/>
  <rosparam file="$(find arm_description)/config.yaml" command="load" ns="arm"/>
  <group ns="left" if="$(eval a == 1)">
    <node pkg="controller_manager" type="spawner" name="s" args="one two" ns="inner"/>
    <include file="$(find arm_description)/launch/inner.launch"/>
    <include file="$(find arm_description)/launch/inner.launch" pass_all_args="true"/>
  </group>
  <node pkg="p" type="never" name="x" unless="true"/>
</launch>)X"));
  EXPECT_EQ(read.records[0].name, "/robot_description");
  EXPECT_THAT(read.records[0].descriptions[0].second.arguments, ElementsAre(Pair("length", "1")));
  EXPECT_EQ(read.records[1].name, "/arm");
  EXPECT_EQ(read.records[2].name_space, "/left/inner");
  EXPECT_THAT(executables(read.records), ElementsAre("spawner", "inner_none", "inner_1"));
}

TEST_F(ReadLaunchTest, ScriptAroundXacroIsLeftOutWithWarning) {
  const LaunchDescription read = this->read(write("arm_description/launch/arm.launch", R"X(<launch>
  <param name="robot_description" command="$(find arm_description)/scripts/env_run
   $(find arm_description)/config/plain
   $(find xacro)/xacro $(find arm_description)/urdf/arm.urdf.xacro --inorder length:=4"/>
</launch>)X"));
  const LaunchedRobotText& robot = read.records.at(0).descriptions.at(0).second;
  EXPECT_EQ(robot.source, workspace_ / "arm_description/urdf/arm.urdf.xacro");
  EXPECT_THAT(robot.arguments, ElementsAre(Pair("length", "4")));
  ASSERT_THAT(read.diagnostics.all(), SizeIs(1));
  EXPECT_THAT(read.diagnostics.all()[0].message, HasSubstr("env_run' was not run, only xacro after it"));
}

TEST_F(ReadLaunchTest, ParameterFileWithSubstitutionsIsWritten) {
  write("arm_description/p.yaml",
        "/**:\n  ros__parameters:\n    path: $(find-pkg-share arm_description)/x\n");
  const LaunchDescription read =
      this->read(python("Node(package='p', executable='e', "
                        "parameters=[ParameterFile([FindPackageShare('arm_description'), '/p.yaml'],\n"
                        "  allow_substs=True)])"));
  const std::filesystem::path file = read.records[0].parameters[0].file;
  EXPECT_EQ(file.parent_path(), workspace_ / "made");
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(text, HasSubstr((workspace_ / "arm_description/x").string()));
  EXPECT_THAT(read.made_files, ElementsAre(Pair(file, workspace_ / "arm_description/p.yaml")));
}

TEST_F(ReadLaunchTest, OutputOfLaunchFileDoesNotDisturbReading) {
  const LaunchDescription read =
      this->read(python("Node(package='p', executable='e')", "print('{\"result\": 1}')\n"));
  EXPECT_THAT(read.records, SizeIs(1));
}

TEST(FindLaunchFile, NearNamesAreOffered) {
  PackageResolver resolver;
  const std::filesystem::path package =
      std::filesystem::path(::testing::TempDir()) / "launch" / "named_package";
  std::filesystem::create_directories(package / "launch");
  std::ofstream(package / "package.xml") << "<package><name>named_package</name></package>";
  std::ofstream(package / "launch" / "display.launch.py") << "\n";
  resolver.add_context(package);
  EXPECT_EQ(find_launch_file("named_package", "display.launch.py", resolver),
            package / "launch/display.launch.py");
  EXPECT_EQ(find_launch_file(package.string(), "", resolver), package / "launch/display.launch.py");
  const auto error = [&](const std::string& word, const std::string& file) -> std::string {
    try {
      find_launch_file(word, file, resolver);
    } catch (const InputError& refused) {
      return refused.what();
    }
    return "";
  };
  EXPECT_THAT(error("named_package", "displai.launch.py"), HasSubstr("did you mean 'display.launch.py'?"));
  EXPECT_THAT(error("named_pakage", "display.launch.py"), HasSubstr("there is no package 'named_pakage'"));
  EXPECT_THAT(error("nothing.launch.py", ""), HasSubstr("there is no launch file"));
}

// `doppel check` reads packages of strangers.
TEST_F(ReadLaunchTest, InstallationBesidePackageMakesNothingThere) {
  write("arm_description/CMakeLists.txt",
        "project(arm_description)\n"
        "install(DIRECTORY hooks/ DESTINATION share/${PROJECT_NAME}/../../../escaped)\n"
        "install(DIRECTORY ../outside/ DESTINATION share/${PROJECT_NAME}/taken)\n"
        "install(DIRECTORY tree/ DESTINATION share/${PROJECT_NAME}/)\n"
        "install(DIRECTORY hooks/ DESTINATION share/${PROJECT_NAME}/b/c)\n");
  write("arm_description/hooks/post-commit", "");
  write("outside/kept", "");
  std::filesystem::create_directories(workspace_ / "arm_description/tree");
  std::filesystem::create_directory_symlink(workspace_ / "outside", workspace_ / "arm_description/tree/b");
  static_cast<void>(read(python("",
                                "from ament_index_python.packages import *\n"
                                "assert get_package_share_directory('arm_description')")));
  EXPECT_TRUE(std::filesystem::exists(workspace_ / "made/share/arm_description/hooks"));
  EXPECT_FALSE(std::filesystem::exists(workspace_ / "escaped"));
  EXPECT_FALSE(std::filesystem::exists(workspace_ / "outside/c"));
  EXPECT_FALSE(std::filesystem::exists(workspace_ / "made/share/arm_description/taken"));
}

}  // namespace
}  // namespace doppel
