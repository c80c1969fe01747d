// Parameters as text, as typed values, and through ROS 2's services.

#include "doppel/ros/bus/parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/ros/bus/parameter_services.h"

namespace doppel {
namespace {

namespace srv = rcl_interfaces::srv;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(ParameterText, TextIsReadAsYaml) {
  EXPECT_EQ(parse_parameter("1"), ParameterValue(std::int64_t{1}));
  EXPECT_EQ(parse_parameter("-1.50"), ParameterValue(-1.5));
  EXPECT_EQ(parse_parameter("1e3"), ParameterValue(1000.0));
  EXPECT_EQ(parse_parameter("true"), ParameterValue(true));
  EXPECT_EQ(parse_parameter("yes"), ParameterValue(std::string("yes")));
  EXPECT_EQ(parse_parameter("'1'"), ParameterValue(std::string("1")));
  EXPECT_EQ(parse_parameter("[1, 2]"), ParameterValue(std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(parse_parameter("[1, 2.5]"), ParameterValue(std::vector<double>{1, 2.5}));
  EXPECT_EQ(parse_parameter("[true, false]"), ParameterValue(std::vector<bool>{true, false}));
  EXPECT_EQ(parse_parameter("[Revolute 2, '3']"),
            ParameterValue(std::vector<std::string>{"Revolute 2", "3"}));
  EXPECT_EQ(parse_parameter("[a"), ParameterValue(std::string("[a")));
  EXPECT_EQ(parse_parameter(""), ParameterValue(std::string()));
}

TEST(ParameterText, WrittenTextReadsBackEqual) {
  const ParameterValue values[] = {true,
                                   std::int64_t{-3},
                                   1.0,
                                   1e-9,
                                   std::vector<bool>{false, true},
                                   std::vector<double>{1, -INFINITY},
                                   std::vector<std::int64_t>{1},
                                   std::vector<std::string>{"a", "1", "b c", "it's", ""}};
  for (const ParameterValue& value : values)
    EXPECT_EQ(parse_parameter(to_string(value)), value) << to_string(value);
  EXPECT_EQ(to_string(ParameterValue(1.0)), "1.0");
  EXPECT_EQ(parameter_type_name(std::vector<double>{}), "double_array");
}

Parameters some_parameters() {
  Parameters parameters;
  parameters.declare("rate", 100.0,
                     {.description = "Hz", .check = [](const ParameterValue& value) {
                        return std::get<double>(value) > 0 ? Status() : Status::refused("must be positive");
                      }});
  parameters.declare("joints", std::vector<std::string>{"a"}, {.read_only = true});
  parameters.declare("gains.a.p", std::int64_t{1}, {.description = "gain", .range = ParameterRange{0, 10}});
  parameters.declare("offsets", std::vector<double>{1});
  parameters.declare("goal_time", 0.5, {.range = ParameterRange{0, INFINITY}});
  return parameters;
}

TEST(Parameters, SetOfAnotherTypeIsRefused) {
  Parameters parameters = some_parameters();
  std::string received;
  parameters.on_change([&](const std::string& name, const ParameterValue& value) {
    received = name + "=" + to_string(value);
  });
  EXPECT_TRUE(parameters.set("rate", std::int64_t{50}));
  EXPECT_EQ(received, "rate=50.0");
  EXPECT_THAT(parameters.set("rate", std::string("x")).why(),
              HasSubstr("{rate} is of type {double}, setting it to {string}"));
  EXPECT_THAT(parameters.set("rate", -1.0).why(), HasSubstr("must be positive"));
  EXPECT_THAT(parameters.set("gains.a.p", 1.5).why(), HasSubstr("of type {integer}, setting it to {double}"));
  EXPECT_THAT(parameters.set("joints", std::vector<std::string>{}).why(), HasSubstr("it is read-only"));
  EXPECT_THAT(parameters.set("rat", 1.0).why(), HasSubstr("did you mean 'rate'?"));
  EXPECT_THAT(parameters.set("gains.a.p", std::int64_t{11}).why(), HasSubstr("comply with integer range"));
  EXPECT_THAT(parameters.set("goal_time", -0.1).why(), HasSubstr("comply with floating point range"));
  EXPECT_TRUE(parameters.set("gains.a.p", std::int64_t{10}));
  EXPECT_TRUE(parameters.set("offsets", parse_parameter("[1, 2]")));
  EXPECT_TRUE(parameters.set("offsets", parse_parameter("[]")));
  EXPECT_EQ(received, "offsets=[]");
  EXPECT_EQ(std::get<double>(parameters.find("rate")->value), 50.0);
  EXPECT_THROW(parameters.declare("rate", 1.0), std::logic_error);
}

TEST(Parameters, UndeclaredCanBeSetWhereAllowed) {
  Parameters parameters = some_parameters();
  parameters.allow_undeclared();
  std::vector<std::string> received, declared, deleted;
  parameters.on_change([&](const std::string& name, const ParameterValue&) { received.push_back(name); });
  parameters.on_event([&](const Parameters::Event& event) {
    for (const auto* one : event.declared) declared.push_back(one->name);
    for (const auto* one : event.deleted) deleted.push_back(one->name + "=" + to_string(one->value));
  });
  EXPECT_TRUE(parameters.set("arm.type", std::string("x/Y")));
  EXPECT_TRUE(parameters.set("arm.type", std::int64_t{1}))
      << "expected an undeclared parameter to change its type";
  EXPECT_EQ(parameters.find("arm.type")->value, ParameterValue(std::int64_t{1}));
  EXPECT_THAT(received, ElementsAre("arm.type", "arm.type"));
  EXPECT_THAT(declared, ElementsAre("arm.type"));
  EXPECT_FALSE(parameters.set("rate", std::string("x")))
      << "expected declared parameters to be checked still";
  EXPECT_FALSE(parameters.set_all({{"none", 1.0}, {"rate", -1.0}}));
  EXPECT_EQ(parameters.find("none"), nullptr) << "expected all parameters to be set or none";
  EXPECT_FALSE(parameters.set("", 1.0));
  EXPECT_FALSE(parameters.set("rate", std::monostate{}));
  EXPECT_TRUE(parameters.set("arm.type", std::monostate{}));
  EXPECT_EQ(parameters.find("arm.type"), nullptr);
  EXPECT_THAT(deleted, ElementsAre("arm.type=1"));
}

TEST(Parameters, OverrideBeforeDeclarationIsUsed) {
  Parameters parameters;
  parameters.allow_undeclared();
  ASSERT_TRUE(parameters.set_all({{"p", std::int64_t{2}}, {"q", std::string("x")}, {"r", -1.0}}));
  EXPECT_EQ(parameters.declare("p", 1.0), ParameterValue(2.0));
  EXPECT_EQ(parameters.declare("q", 1.0), ParameterValue(1.0))
      << "expected the default: the value has another type";
  EXPECT_EQ(parameters.declare("r", 1.0, {.range = ParameterRange{0, 1}}), ParameterValue(1.0));
  EXPECT_FALSE(parameters.set("p", std::string("x")));
  EXPECT_THROW(parameters.declare("p", 1.0), std::logic_error);
}

TEST(Parameters, UndeclaredAreBounded) {
  Parameters parameters;
  parameters.allow_undeclared();
  for (std::size_t i = 0; i < Parameters::kMaxUndeclared; ++i)
    ASSERT_TRUE(parameters.set(std::to_string(i), 1.0));
  EXPECT_THAT(parameters.set("more", 1.0).why(), HasSubstr("1000 undeclared parameters"));
  EXPECT_TRUE(parameters.set("0", std::monostate{}));
  EXPECT_TRUE(parameters.set("more", 1.0));
}

class ParameterServices : public testing::Test {
 protected:
  ParameterServices() {
    node_.parameters() = some_parameters();
    serve_parameters(node_);
  }

  template <class S>
  typename S::Response call(const std::string& service, const typename S::Request& request) {
    typename S::Response response;
    edge_->call("/n/" + service, to_cdr(request), [&](const Status& status, const Bytes& bytes) {
      EXPECT_TRUE(status) << status.why();
      EXPECT_TRUE(from_cdr(bytes, response));
    });
    bus_.spin();
    return response;
  }

  Bus bus_;
  Node node_{bus_, "/n"};
  std::unique_ptr<Edge> edge_ = bus_.attach("edge");
};

TEST_F(ParameterServices, ListParametersReturnsNames) {
  const auto all = call<srv::ListParameters>("list_parameters", {}).result;
  EXPECT_THAT(all.names, ElementsAre("gains.a.p", "goal_time", "joints", "offsets", "rate"));
  EXPECT_THAT(all.prefixes, ElementsAre("gains.a"));
  EXPECT_THAT(call<srv::ListParameters>("list_parameters", {{"gains"}, 0}).result.names,
              ElementsAre("gains.a.p"));
  EXPECT_THAT(call<srv::ListParameters>("list_parameters", {{}, 1}).result.names,
              ElementsAre("goal_time", "joints", "offsets", "rate"));
  EXPECT_THAT(call<srv::ListParameters>("list_parameters", {{"gains", "rate"}, 1}).result.names,
              ElementsAre("rate"));
  EXPECT_THAT(call<srv::ListParameters>("list_parameters", {{"gains", "none"}, 2}).result.names,
              ElementsAre("gains.a.p"));
}

TEST_F(ParameterServices, GetDescribeAndTypesReturnDeclared) {
  const auto values = call<srv::GetParameters>("get_parameters", {{"rate"}}).values;
  ASSERT_EQ(values.size(), 1U);
  EXPECT_EQ(values[0].double_value, 100.0);
  EXPECT_TRUE(call<srv::GetParameters>("get_parameters", {{"rate", "none"}}).values.empty())
      << "expected rclcpp's answer: no values";
  EXPECT_THAT(call<srv::GetParameterTypes>("get_parameter_types", {{"joints", "rate"}}).types,
              ElementsAre(9, 3));
  const auto described =
      call<srv::DescribeParameters>("describe_parameters", {{"joints", "rate"}}).descriptors;
  EXPECT_TRUE(described.at(0).read_only);
  EXPECT_EQ(described.at(1).description, "Hz");
  const auto ranges =
      call<srv::DescribeParameters>("describe_parameters", {{"gains.a.p", "goal_time"}}).descriptors;
  EXPECT_EQ(ranges.at(0).integer_range.at(0).to_value, 10);
  EXPECT_EQ(ranges.at(1).floating_point_range.at(0).from_value, 0.0);
  EXPECT_EQ(ranges.at(1).floating_point_range.at(0).to_value, std::numeric_limits<double>::max());
}

TEST_F(ParameterServices, UndeclaredParameterIsNotSet) {
  node_.parameters().allow_undeclared();
  const auto values = call<srv::GetParameters>("get_parameters", {{"rate", "none"}}).values;
  ASSERT_EQ(values.size(), 2U);
  EXPECT_EQ(values[0].double_value, 100.0);
  EXPECT_EQ(values[1].type, 0);
  EXPECT_THAT(call<srv::GetParameterTypes>("get_parameter_types", {{"none", "rate"}}).types,
              ElementsAre(0, 3));
  const auto described = call<srv::DescribeParameters>("describe_parameters", {{"none", "rate"}}).descriptors;
  ASSERT_EQ(described.size(), 2U);
  EXPECT_EQ(described[0].name, "none");
  const auto set = call<srv::SetParameters>("set_parameters", {{{"none", to_msg(5.0)}}}).results;
  EXPECT_TRUE(set.at(0).successful);
  EXPECT_EQ(call<srv::GetParameters>("get_parameters", {{"none"}}).values.at(0).double_value, 5.0);
  EXPECT_TRUE(
      call<srv::DescribeParameters>("describe_parameters", {{"none"}}).descriptors.at(0).dynamic_typing);
}

TEST_F(ParameterServices, SetIsPerParameterOrAtomic) {
  const std::vector<rcl_interfaces::msg::Parameter> wanted = {{"rate", to_msg(5.0)},
                                                              {"joints", to_msg(std::string("x"))}};
  const auto atomic = call<srv::SetParametersAtomically>("set_parameters_atomically", {wanted}).result;
  EXPECT_FALSE(atomic.successful);
  EXPECT_EQ(std::get<double>(node_.parameters().find("rate")->value), 100.0);
  const auto each = call<srv::SetParameters>("set_parameters", {wanted}).results;
  EXPECT_TRUE(each.at(0).successful);
  EXPECT_FALSE(each.at(1).successful);
  EXPECT_EQ(std::get<double>(node_.parameters().find("rate")->value), 5.0);
}

TEST_F(ParameterServices, EdgeCallsServices) {
  Status status;
  edge_->set_parameter("/n", "rate", 7.0, [&](Status s) { status = std::move(s); });
  bus_.spin();
  EXPECT_TRUE(status);
  Node part(bus_, "/n");
  part.parameters().declare("more", 1.0);
  edge_->set_parameter("/n", "more", 2.0, [&](Status s) { status = std::move(s); });
  bus_.spin();
  EXPECT_TRUE(status) << "expected success: a node may have several parts";
  EXPECT_EQ(std::get<double>(part.parameters().find("more")->value), 2.0);
  edge_->set_parameter("/m", "rate", 7.0, [&](Status s) { status = std::move(s); });
  std::size_t count = 0;
  edge_->get_parameters([&](const auto& parameters) { count = parameters->size(); });
  bus_.spin();
  EXPECT_THAT(status.why(), HasSubstr("there is no node /m"));
  EXPECT_EQ(count, 6U);
}

}  // namespace
}  // namespace doppel
