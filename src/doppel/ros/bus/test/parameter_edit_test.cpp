// Numbers in a parameter file, and all other bytes as they were.
#include "doppel/ros/bus/parameter_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

constexpr const char* kGains = R"(# gains
arm:
  ros__parameters:
    joints: [a, "b c"]   # two
    gains:
      a: {p: 10, d: 0.5}     # one line
      b c:
        p: 1e2   # a hundred

        d: 2.0
)";

std::string edited(const std::string& text, const std::vector<NumberEdit>& edits) {
  return with_numbers(text, "c.yaml", edits, "test.rule");
}

void expect_refused(const std::string& text, const std::vector<NumberEdit>& edits, const std::string& why) {
  try {
    edited(text, edits);
    FAIL() << "expected an error";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr(why));
  }
}

TEST(ParameterEdit, OnlyNumbersChange) {
  const std::string out = edited(kGains, {{"arm", "gains.a.p", "120.0"}, {"arm", "gains.b c.p", "7.5"}});
  EXPECT_EQ(out, R"(# gains
arm:
  ros__parameters:
    joints: [a, "b c"]   # two
    gains:
      a: {p: 120.0, d: 0.5}     # one line
      b c:
        p: 7.5   # a hundred

        d: 2.0
)");
  EXPECT_EQ(edited(out, {{"arm", "gains.a.p", "120.0"}, {"arm", "gains.b c.p", "7.5"}}), out);
}

TEST(ParameterEdit, MissingNumbersAreAddedBehindTheirNeighbour) {
  const std::string out = edited(
      kGains, {{"arm", "gains.a.i", "3.0", "gains.a.p"}, {"arm", "gains.b c.i", "4.0", "gains.b c.p"}});
  EXPECT_THAT(out, HasSubstr("a: {p: 10, i: 3.0, d: 0.5}     # one line\n"));
  EXPECT_THAT(out, HasSubstr("        p: 1e2   # a hundred\n        i: 4.0\n\n        d: 2.0\n"));
}

TEST(ParameterEdit, LastLineWithoutEndIsExtended) {
  EXPECT_EQ(edited("a:\n  ros__parameters:\n    p: 1.0", {{"a", "i", "2.0", "p"}}),
            "a:\n  ros__parameters:\n    p: 1.0\n    i: 2.0");
}

TEST(ParameterEdit, LineEndsOfWindowsStay) {
  EXPECT_EQ(edited("a:\r\n  ros__parameters:\r\n    p: 1.0\r\n    q: 2\r\n",
                   {{"a", "p", "3.0"}, {"a", "i", "2.0", "p"}}),
            "a:\r\n  ros__parameters:\r\n    p: 3.0\r\n    i: 2.0\r\n    q: 2\r\n");
}

TEST(ParameterEdit, ValuesThatAreNoNumbersAreRefusedWithPlaceAndFix) {
  expect_refused("a:\n  ros__parameters:\n    p: \"1.0\"\n", {{"a", "p", "2.0"}}, "c.yaml:3:");
  expect_refused("a:\n  ros__parameters:\n    p: \"1.0\"\n", {{"a", "p", "2.0"}}, "write p: 2.0 yourself");
  expect_refused("a:\n  ros__parameters:\n    q: 1.0\n", {{"a", "p", "2.0"}}, "cannot be written here");
}

TEST(ParameterEdit, SharedAnchorsAreRefused) {
  const std::string shared = "a:\n  ros__parameters:\n    one: &g\n      p: 1.0\n    two: *g\n";
  expect_refused(shared, {{"a", "one.p", "2.0"}}, "by an alias");
  expect_refused(shared, {{"a", "one.p", "2.0"}, {"a", "two.p", "3.0"}}, "another name");
  EXPECT_THAT(edited(shared, {{"a", "one.p", "2.0"}, {"a", "two.p", "2.0"}}), HasSubstr("p: 2.0"));
}

}  // namespace
}  // namespace doppel
