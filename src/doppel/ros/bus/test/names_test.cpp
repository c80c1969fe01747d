// ROS 2's rules for names, and renaming from the command line.
#include <gmock/gmock.h>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/node_arguments.h"
#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> words(std::initializer_list<const char*> list) {
  return {list.begin(), list.end()};
}

std::string error_of(std::vector<std::string> list) {
  try {
    take_ros_arguments(list);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Names, NamesAreCheckedByRos2Rules) {
  EXPECT_TRUE(check_node_name("arm_1"));
  EXPECT_THAT(check_node_name("arm-1").why(), HasSubstr("'-'"));
  EXPECT_THAT(check_node_name("1arm").why(), HasSubstr("digit"));
  EXPECT_FALSE(check_node_name(""));
  EXPECT_FALSE(check_node_name(std::string(256, 'a')));
  for (const char* good : {"/", "/a", "/a/b_2"}) EXPECT_TRUE(check_namespace(good)) << good;
  for (const char* bad : {"", "a", "/a/", "//a", "/a//b", "/2a", "/a b"})
    EXPECT_FALSE(check_namespace(bad)) << bad;
  for (const char* good : {"a", "/a", "a/b", "~/a", "~", "/_hidden/x1"})
    EXPECT_TRUE(check_topic_name(good)) << good;
  for (const char* bad : {"", "/", "a/", "a//b", "~a", "a~/b", "1", "a/1", "a b", "a-b"})
    EXPECT_FALSE(check_topic_name(bad)) << bad;
}

TEST(Names, NamesAreExpanded) {
  EXPECT_EQ(expand_name("x", "/arm"), "/x");
  EXPECT_EQ(expand_name("x/y", "/left/arm"), "/left/x/y");
  EXPECT_EQ(expand_name("~/x", "/left/arm"), "/left/arm/x");
  EXPECT_EQ(expand_name("~", "/left/arm"), "/left/arm");
  EXPECT_EQ(expand_name("/x", "/left/arm"), "/x");
  EXPECT_EQ(node_namespace("/arm"), "/");
  EXPECT_EQ(node_namespace("/a/b/arm"), "/a/b");
  EXPECT_EQ(node_base_name("/a/b/arm"), "arm");
}

TEST(NameRules, RemapsNodesTopicsAndServices) {
  NameRules rules;
  for (const char* rule : {"__ns:=/left", "arm:__node:=hand", "hand:__ns:=/right", "joint_states:=js",
                           "/tf:=tf", "hand:~/own:=/mine", "rosservice://both:=only_service"}) {
    rules.add(rule);
  }
  EXPECT_EQ(rules.node("/arm"), "/left/hand") << "expected the first rule for the namespace to apply";
  EXPECT_EQ(rules.node("/other"), "/left/other");
  EXPECT_EQ(rules.resolve(NameKind::topic, "joint_states", "/left/other"), "/left/js");
  EXPECT_EQ(rules.resolve(NameKind::topic, "/joint_states", "/left/other"), "/joint_states");
  EXPECT_EQ(rules.resolve(NameKind::topic, "/tf", "/left/other"), "/left/tf");
  EXPECT_EQ(rules.resolve(NameKind::topic, "~/own", "/left/hand"), "/mine");
  EXPECT_EQ(rules.resolve(NameKind::topic, "~/own", "/left/other"), "/left/other/own");
  EXPECT_EQ(rules.resolve(NameKind::topic, "both", "/left/other"), "/left/both");
  EXPECT_EQ(rules.resolve(NameKind::service, "both", "/left/other"), "/left/only_service");
}

TEST(NameRules, UnusedRuleIsReported) {
  NameRules rules;
  rules.add("joint_sttes:=js");
  rules.add("armm:x:=y");
  rules.add("joint_states:=js");
  rules.node("/arm");
  rules.resolve(NameKind::topic, "joint_states", "/arm");
  Diagnostics diagnostics;
  rules.report_unused(diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 2U);
  EXPECT_THAT(diagnostics.all()[0].message, HasSubstr("did you mean 'joint_states'?"));
  EXPECT_THAT(diagnostics.all()[1].message, HasSubstr("did you mean 'arm'?"));
}

TEST(NameRules, ApplyToAllBusNames) {
  NameRules rules;
  rules.add("__ns:=/left");
  rules.add("x:=y");
  rules.add("arm:~/ask:=/ask");
  Bus bus({.names = rules});
  Node node(bus, "/arm");
  node.advertise<std_msgs::msg::String>("x");
  node.advertise<std_msgs::msg::String>("/tf");
  node.serve<std_srvs::srv::Trigger>("~/ask", [](const auto&, auto respond) { respond({}); });
  EXPECT_EQ(node.name(), "/left/arm");
  EXPECT_EQ(node.given_name(), "/arm");
  std::vector<std::string> topics;
  for (const TopicInfo& topic : bus.topics()) topics.push_back(topic.name);
  EXPECT_THAT(topics, ElementsAre("/left/y", "/tf"));
  EXPECT_EQ(bus.services().at(0).name, "/ask");
  EXPECT_EQ(bus.services().at(0).node, "/left/arm");
}

TEST(RosArguments, RosArgsAreRemovedFromCommandLine) {
  auto line = words({"up",
                     "arm",
                     "use_sim:=true",
                     "--ros-args",
                     "-r",
                     "a:=b",
                     "--params-file",
                     "f.yaml",
                     "-p",
                     "arm:gains.p:=2.5",
                     "--param",
                     "joints:=[a, b]",
                     "--log-level",
                     "WARN",
                     "--enable-rosout-logs",
                     "-e",
                     "/cell/left",
                     "--",
                     "--headless",
                     "--ros-args",
                     "--remap",
                     "__ns:=/x"});
  const RosArguments arguments = take_ros_arguments(line);
  EXPECT_EQ(line, words({"up", "arm", "use_sim:=true", "--headless"}));
  NameRules names = arguments.names;
  EXPECT_EQ(names.node("/n"), "/x/n");
  ASSERT_EQ(arguments.parameters.size(), 3U);
  EXPECT_EQ(std::get<GivenParameterFile>(arguments.parameters[0]).path, "f.yaml");
  const auto& gain = std::get<GivenParameter>(arguments.parameters[1]);
  EXPECT_EQ(gain.node, "arm");
  EXPECT_EQ(gain.name, "gains.p");
  EXPECT_EQ(gain.value, ParameterValue(2.5));
  EXPECT_EQ(std::get<GivenParameter>(arguments.parameters[2]).node, "");
  EXPECT_EQ(arguments.log_level, Severity::warning);
  EXPECT_EQ(arguments.enclave, "/cell/left");
}

TEST(RosArguments, UnusedArgumentIsReported) {
  auto line = words({"--ros-args", "-r", "x:=y", "-p", "arm:gain:=1", "-p", "arm:gian:=1", "-p",
                     "amr:gain:=1", "-p", "gain:=2", "-p", "/**:none_such:=2"});
  const RosArguments arguments = take_ros_arguments(line);
  Bus bus({.names = arguments.names});
  Node node(bus, "/arm");
  node.parameters().declare("gain", 1.0);
  Diagnostics diagnostics;
  report_unused(arguments, bus, diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 4U);
  EXPECT_THAT(diagnostics.all()[0].message, HasSubstr("'x:=y'"));
  EXPECT_THAT(diagnostics.all()[1].message, HasSubstr("did you mean 'gain'?"));
  EXPECT_THAT(diagnostics.all()[2].message, HasSubstr("there is no node 'amr'"));
  EXPECT_THAT(diagnostics.all()[3].message, HasSubstr("none_such"));
}

TEST(RosArguments, InvalidArgumentIsReported) {
  EXPECT_THAT(error_of(words({"--ros-args", "-r", "a"})), HasSubstr("FROM:=TO"));
  EXPECT_THAT(error_of(words({"--ros-args", "-r"})), HasSubstr("a value is missing"));
  EXPECT_THAT(error_of(words({"--ros-args", "-r", "__ns:=left"})), HasSubstr("slash"));
  EXPECT_THAT(error_of(words({"--ros-args", "--enclave", "left"})), HasSubstr("slash"));
  EXPECT_THAT(error_of(words({"--ros-args", "-r", "__nss:=/left"})), HasSubstr("did you mean '__ns'?"));
  EXPECT_THAT(error_of(words({"--ros-args", "-r", "__node:=x"})), HasSubstr("select the node"));
  EXPECT_THAT(error_of(words({"--ros-args", "-r", "a b:=c"})), HasSubstr("' '"));
  EXPECT_THAT(error_of(words({"--ros-args", "-p", "x"})), HasSubstr("NAME:=VALUE"));
  EXPECT_THAT(error_of(words({"--ros-args", "a:=b"})), HasSubstr("-r a:=b"));
  EXPECT_THAT(error_of(words({"--ros-args", "--reamp", "a:=b"})), HasSubstr("did you mean '--remap'?"));
  EXPECT_THAT(error_of(words({"--ros-args", "--log-level", "wran"})), HasSubstr("did you mean 'warn'?"));
  EXPECT_THAT(error_of(words({"--ros-args", "--log-level", "arm:=debug"})), HasSubstr("--log-level debug"));
}

TEST(NameRules, RulesOfNodeDoNotApplyToNodeOfSameNameElsewhere) {
  NameRules rules;
  rules.add("arm:~/x:=/left_x", {&rules, "arm", "/left/arm"});
  rules.add("arm:~/x:=/right_x", {&rules, "arm", "/right/arm"});
  rules.add("arm:__node:=hand", {&rules, "arm", "/third/arm"});
  rules.add("hand:~/x:=/third_x", {&rules, "arm", "/third/arm"});
  EXPECT_EQ(rules.resolve(NameKind::topic, "~/x", rules.node("/left/arm")), "/left_x");
  EXPECT_EQ(rules.resolve(NameKind::topic, "~/x", rules.node("/right/arm")), "/right_x");
  EXPECT_EQ(rules.node("/third/arm"), "/third/hand");
  EXPECT_EQ(rules.resolve(NameKind::topic, "~/x", "/third/hand"), "/third_x");
  EXPECT_EQ(rules.resolve(NameKind::topic, "~/x", "/other/hand"), "/other/hand/x");
  rules.remove({&rules, "arm", "/left/arm"});
  EXPECT_EQ(rules.resolve(NameKind::topic, "~/x", rules.node("/left/arm")), "/left/arm/x");
  EXPECT_EQ(rules.resolve(NameKind::topic, "~/x", rules.node("/right/arm")), "/right_x");
}

TEST(NodeArguments, RulesApplyToOneNode) {
  const NodeArguments none = read_node_arguments({}, "/arm", {});
  EXPECT_TRUE(none.rules.empty() && none.parameters.empty());
  const NodeArguments own = read_node_arguments(words({"-r", "a:=b", "-r", "hand:rostopic://c:=d", "-r",
                                                       "__node:=hand", "-r", "__ns:=/left", "-p", "x:=1"}),
                                                "/arm", {});
  EXPECT_THAT(own.rules,
              ElementsAre("arm:__node:=hand", "hand:a:=b", "hand:rostopic://c:=d", "hand:__ns:=/left"));
  EXPECT_EQ(own.parameters.size(), 1u);
  NameRules process;
  process.add("arm:__node:=tool");
  EXPECT_THAT(read_node_arguments(words({"-r", "a:=b"}), "/arm", process).rules, ElementsAre("tool:a:=b"));
}

}  // namespace
}  // namespace doppel
