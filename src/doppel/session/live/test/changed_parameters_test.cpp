// The parameters that a copy of a robot gets: what no node has is not remembered.
#include "doppel/session/live/detail/changed_parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

class ChangedParametersTest : public testing::Test {
 protected:
  ChangedParametersTest() { arm_.parameters().declare("speed", 1.5); }

  // Anyone may publish such an event, with any content.
  void hear(const std::string& node, const std::string& parameter, double value) {
    rcl_interfaces::msg::ParameterEvent event;
    event.node = node;
    auto& changed = event.changed_parameters.emplace_back();
    changed.name = parameter;
    changed.value.type = rcl_interfaces::msg::ParameterType::PARAMETER_DOUBLE;
    changed.value.double_value = value;
    changed_.keep(event);
  }

  Bus bus_;
  Node arm_{bus_, "/left/arm"};
  ChangedParameters changed_{bus_};
};

TEST_F(ChangedParametersTest, ValuesThatNoNodeHasAreNotKept) {
  hear("/left/arm", "speed", 1.5);
  for (int i = 0; i < 100; ++i) {
    const std::string number = std::to_string(i);
    hear("/nobody" + number, "speed", 1.5);
    hear("/left/arm", "invented" + number, 1.5);
    hear("/left/arm", "speed", 2.0 + i);
  }
  EXPECT_EQ(changed_.count(), 1U);
  const std::vector<NamedParameter> values = changed_.values_of("left", {"arm"});
  ASSERT_EQ(values.size(), 1U);
  EXPECT_EQ(values[0].node, "arm");
  EXPECT_EQ(values[0].name, "speed");
  EXPECT_EQ(std::get<double>(values[0].value), 1.5);
}

TEST_F(ChangedParametersTest, NodesThatAreGoneAreForgotten) {
  for (int i = 0; i < 100; ++i) {
    Node guest(bus_, "/guest" + std::to_string(i));
    guest.parameters().declare("speed", 1.5);
    hear(guest.name(), "speed", 1.5);
  }
  hear("/left/arm", "speed", 1.5);
  EXPECT_EQ(changed_.count(), 1U);
}

}  // namespace
}  // namespace doppel
