// Lists of parameters: their declaration, their present values, and changes.
#include "doppel/ros/bus/parameter_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

using testing::ElementsAre;

struct Sizes {
  double radius = 0.5;
  std::int64_t wheels = 4;
  std::vector<std::string> joints = {"a"};

  std::vector<ParameterField> fields() {
    return {{"radius", &radius, "m", minimum(0)},
            {"wheels", &wheels, "in number", read_only(value_range(2, 6))},
            {"joints", &joints}};
  }
};

void declare_all(Parameters& parameters, ParameterOverrides& written, Sizes& sizes) {
  for (const ParameterField& field : sizes.fields()) declare_field(parameters, &written, field);
}

TEST(ParameterFields, MemberIsDefaultAndTakesWrittenValue) {
  Parameters parameters;
  ParameterOverrides written({{"joints", std::vector<std::string>{"b", "c"}, {}, {}}});
  Sizes sizes;
  declare_all(parameters, written, sizes);
  EXPECT_EQ(parameters.find("radius")->value, ParameterValue(0.5));
  EXPECT_EQ(parameters.find("radius")->options.description, "m");
  EXPECT_EQ(parameters.find("wheels")->options.range->to, 6);
  EXPECT_THAT(sizes.joints, ElementsAre("b", "c"));
  EXPECT_TRUE(written.all()[0].used);
}

TEST(ParameterFields, ValueOutsideRangeIsRefused) {
  Parameters parameters;
  ParameterOverrides written({{"radius", -1.0, {}, {}}});
  Sizes sizes;
  EXPECT_THROW(declare_all(parameters, written, sizes), InputError);
  EXPECT_EQ(sizes.radius, 0.5);
}

TEST(ParameterFields, ChangeIsReadOnRequestOrFollowed) {
  Parameters parameters;
  ParameterOverrides none;
  Sizes sizes;
  declare_all(parameters, none, sizes);
  follow_field(parameters, sizes.fields()[2]);
  ASSERT_TRUE(parameters.set("radius", 0.25).ok());
  ASSERT_TRUE(parameters.set("joints", std::vector<std::string>{"d"}).ok());
  EXPECT_FALSE(parameters.set("wheels", std::int64_t{6}).ok()) << "expected a read-only parameter";
  EXPECT_EQ(sizes.radius, 0.5);
  EXPECT_THAT(sizes.joints, ElementsAre("d"));
  for (const ParameterField& field : sizes.fields()) read_field(parameters, field);
  EXPECT_EQ(sizes.radius, 0.25);
}

}  // namespace
}  // namespace doppel
