// Parameters as text, read again by the reader of parameter files.
#include "doppel/ros/bus/parameter_file_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/ros/bus/parameter_file.h"

namespace doppel {
namespace {

using Named = std::vector<std::pair<std::string, ParameterValue>>;

TEST(ParameterFileTextTest, EveryTypeIsReadAgainWithItsValue) {
  const Named parameters = {{"flag", true},
                            {"gains.arm.p", 12.5},
                            {"gains.arm.count", std::int64_t{3}},
                            {"gains.whole", 2.0},
                            {"names", std::vector<std::string>{"a b", "true", "1"}},
                            {"text.plain", std::string("hello")},
                            {"text.empty", std::string()},
                            {"text.number", std::string("12")},
                            {"text.colon", std::string("a: b # c")},
                            {"text.lines", std::string("one\ntwo\t\"three\"")},
                            {"values", std::vector<double>{1.0, -0.5}}};
  const ParameterFile file = ParameterFile::parse(parameter_file_text("/arm", parameters), "text");
  const ParameterOverrides overrides = file.overrides_for("/arm");
  Named read;
  for (const ParameterOverride& parameter : overrides.all())
    read.emplace_back(parameter.name, parameter.value);
  EXPECT_THAT(read, testing::UnorderedElementsAreArray(parameters));
}

TEST(ParameterFileTextTest, ParameterThatIsNotSetIsSkipped) {
  EXPECT_EQ(parameter_file_text("/arm", {{"a", std::monostate{}}}), "/arm:\n  ros__parameters:\n");
}

}  // namespace
}  // namespace doppel
