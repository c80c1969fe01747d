#include "doppel/ros/bus/parameter_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <random>

#include "doppel/control/manager/test/manager_rig.h"

namespace doppel {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

ParameterFile parse(const std::string& yaml) {
  return ParameterFile::parse(yaml, "p.yaml");
}

template <class T>
T value(ParameterOverrides overrides, const std::string& name) {
  const ParameterOverride* found = overrides.find(name);
  if (found == nullptr) throw std::logic_error("no override " + name);
  return std::get<T>(found->value);
}

TEST(ParameterFile, DottedNamesAreNested) {
  const auto overrides = parse(R"(
joint_trajectory_controller:
  ros__parameters:
    joints:
      - Revolute 1
      - "Revolute 2"
    gains:
      "Revolute 1": {p: 200.0, i: 1, i_clamp: 10.0}
      Revolute 2: {p: 300.0}
    constraints.goal_time: 0.6
)")
                             .overrides_for("/joint_trajectory_controller");
  EXPECT_THAT(value<std::vector<std::string>>(overrides, "joints"), ElementsAre("Revolute 1", "Revolute 2"));
  EXPECT_EQ(value<double>(overrides, "gains.Revolute 1.p"), 200.0);
  EXPECT_EQ(value<std::int64_t>(overrides, "gains.Revolute 1.i"), 1);
  EXPECT_EQ(value<double>(overrides, "constraints.goal_time"), 0.6);
  EXPECT_THAT(overrides.children("gains"), ElementsAre("Revolute 1", "Revolute 2"));
  EXPECT_TRUE(overrides.children("gain").empty());
}

TEST(ParameterFile, ElementsHavePlaces) {
  auto overrides =
      parse("c:\n  ros__parameters:\n    joints:\n      - a\n      -   b\n    rate: 7\n").overrides_for("c");
  const ParameterOverride* joints = overrides.find("joints");
  ASSERT_EQ(joints->elements.size(), 2u);
  EXPECT_EQ(joints->elements[0].place(), "p.yaml:4:9");
  EXPECT_EQ(joints->elements[1].place(), "p.yaml:5:11");
  EXPECT_EQ(overrides.find("rate")->source.place(), "p.yaml:6:11");
}

TEST(ParameterFile, ScalarsAreReadAsInRos2) {
  const auto o = parse(R"(
n:
  ros__parameters: {t: yes, f: "yes", i: 12, h: 0x10, m: -3, d: 1.5, e: 1e3, inf: .inf, ninf: -.inf, nan: .nan,
                    s: 1.2.3, q: '12', big: 99999999999999999999, plus: +2.5}
)")
                     .overrides_for("n");
  EXPECT_TRUE(value<bool>(o, "t"));
  EXPECT_EQ(value<std::string>(o, "f"), "yes");
  EXPECT_EQ(value<std::int64_t>(o, "i"), 12);
  EXPECT_EQ(value<std::int64_t>(o, "h"), 16);
  EXPECT_EQ(value<std::int64_t>(o, "m"), -3);
  EXPECT_EQ(value<double>(o, "d"), 1.5);
  EXPECT_EQ(value<double>(o, "e"), 1000.0);
  EXPECT_EQ(value<double>(o, "inf"), kInfinity);
  EXPECT_EQ(value<double>(o, "ninf"), -kInfinity);
  EXPECT_TRUE(std::isnan(value<double>(o, "nan")));
  EXPECT_EQ(value<std::string>(o, "s"), "1.2.3");
  EXPECT_EQ(value<std::string>(o, "q"), "12");
  EXPECT_EQ(value<double>(o, "big"), 1e20);
  EXPECT_EQ(value<double>(o, "plus"), 2.5);
}

TEST(ParameterFile, LocaleHasNoEffect) {
  // A locale with a decimal comma may not be installed; then this is the C locale, and the test still passes.
  const char* before = setlocale(LC_NUMERIC, "de_DE.UTF-8");
  const auto o = parse("n: {ros__parameters: {d: 0.5}}").overrides_for("n");
  setlocale(LC_NUMERIC, "C");
  static_cast<void>(before);
  EXPECT_EQ(value<double>(o, "d"), 0.5);
}

TEST(ParameterFile, MixedListIsRefused) {
  const auto o =
      parse("n: {ros__parameters: {mixed: [1, 2.5], ints: [1, 2], flags: [true, false], none: []}}")
          .overrides_for("n");
  EXPECT_THAT(value<std::vector<double>>(o, "mixed"), ElementsAre(1.0, 2.5));
  EXPECT_THAT(value<std::vector<std::int64_t>>(o, "ints"), ElementsAre(1, 2));
  EXPECT_THAT(value<std::vector<bool>>(o, "flags"), ElementsAre(true, false));
  EXPECT_TRUE(value<std::vector<std::string>>(o, "none").empty());
  EXPECT_THAT(input_error_of([] { parse("n:\n  ros__parameters:\n    joints: [a, 2]\n"); }),
              HasSubstr("p.yaml:3:17: error: '2' in the list 'joints' is a"));
  EXPECT_THAT(input_error_of([] { parse("n: {ros__parameters: {joints: [[a], [b]]}}"); }),
              HasSubstr("a list or a map"));
}

TEST(ParameterFile, WildcardsAndNamespacesMatchNodes) {
  const auto file = parse(R"(
arm:
  ros__parameters: {x: 2, mine: 1}
/**:
  ros__parameters: {x: 1, all: 1}
/ns/arm:
  ros__parameters: {y: 3}
ns2:
  arm:
    ros__parameters: {z: 4}
/*/arm:
  ros__parameters: {one: 5}
)");
  const auto arm = file.overrides_for("/arm");
  EXPECT_EQ(value<std::int64_t>(arm, "x"),
            2);  // the exact name takes precedence over the wildcard, in any order
  EXPECT_EQ(value<std::int64_t>(arm, "all"), 1);
  EXPECT_EQ(arm.all().size(), 3u);
  EXPECT_EQ(file.overrides_for("arm").all().size(), 3u);
  EXPECT_EQ(value<std::int64_t>(file.overrides_for("/ns/arm"), "y"), 3);
  EXPECT_EQ(value<std::int64_t>(file.overrides_for("/ns/arm"), "one"), 5);
  EXPECT_EQ(value<std::int64_t>(file.overrides_for("/ns2/arm"), "z"), 4);
  EXPECT_EQ(file.overrides_for("/other").all().size(), 2u);
  EXPECT_THAT(file.nodes(), ElementsAre("arm", "/ns/arm", "ns2/arm"));
}

TEST(ParameterFile, LaterOverrideWins) {
  auto file = parse("arm:\n  ros__parameters: {x: 1, y: 1, z: 1}\n");
  file.add(parse("/**:\n  ros__parameters: {y: 2}\narm:\n  ros__parameters: {z: 2}\n"));
  file.add("", "z", std::int64_t{3}, "-p z:=3");
  file.add("arm", "new", true, "-p arm:new:=true");
  file.add("other", "x", std::int64_t{9}, "-p other:x:=9");
  const auto arm = file.overrides_for("/arm");
  EXPECT_EQ(value<std::int64_t>(arm, "x"), 1);
  EXPECT_EQ(value<std::int64_t>(arm, "y"), 2)
      << "expected a later wildcard to take precedence over an earlier name";
  EXPECT_EQ(value<std::int64_t>(arm, "z"), 3);
  EXPECT_EQ(value<bool>(arm, "new"), true);
  EXPECT_EQ(value<std::int64_t>(file.overrides_for("/left/hand", "/arm"), "x"), 1)
      << "expected overrides of the former name to apply";
  EXPECT_EQ(file.overrides_for("/left/arm").all().size(), 2u) << "expected the fully qualified name to match";
}

TEST(ParameterFile, RepeatedNodeSectionsAreMerged) {
  const ParameterFile file = parse(
      "/**:\n  controller_manager:\n    ros__parameters:\n      update_rate: 100\n"
      "/**:\n  jtc:\n    ros__parameters:\n      joints: [f1]\n      x: 1\n"
      "jtc: {ros__parameters: {y: 2}}\njtc: {ros__parameters: {x: 3}}\n");
  EXPECT_NE(file.overrides_for("/controller_manager").find("update_rate"), nullptr);
  ParameterOverrides jtc = file.overrides_for("/jtc");
  ASSERT_EQ(jtc.all().size(), 3U);
  EXPECT_EQ(jtc.find("x")->value, ParameterValue(std::int64_t{3}))
      << "expected the later value to take precedence";
}

TEST(ParameterFile, InvalidFileIsRefusedAsInRos2) {
  EXPECT_THAT(input_error_of([] { parse("a:\n  ros__parameters:\n    x: 1\n    x: 2\n"); }),
              HasSubstr("p.yaml:4:5: error: 'x' is given twice; the first one is at p.yaml:3:5"));
  EXPECT_THAT(input_error_of([] { parse("a: {ros__parameters: {b.c: 1, b: {c: 2}}}"); }),
              HasSubstr("given twice"));
  EXPECT_THAT(input_error_of([] { parse("a:\n  joints: [b]\n"); }), HasSubstr("outside ros__parameters"));
  EXPECT_THAT(input_error_of([] { parse("a:\n  ros__parameters:\n    x:\n"); }),
              HasSubstr("p.yaml:3:5: error: parameter 'x' has no value"));
  EXPECT_THAT(input_error_of([] { parse("a:\n\t- b\n"); }),
              HasSubstr("p.yaml:2:2: error: this is not well-formed YAML"));
  EXPECT_THAT(input_error_of([] { parse("{}"); }), HasSubstr("is not a ROS 2 parameter file"));
  EXPECT_THAT(input_error_of([] { parse("- a\n- b\n"); }), HasSubstr("is not a ROS 2 parameter file"));
  EXPECT_THAT(input_error_of([] { parse("ros__parameters: {x: 1}"); }), HasSubstr("write the node's name"));
  EXPECT_THAT(input_error_of([] { ParameterFile::load("/nowhere/x.yaml"); }),
              HasSubstr("/nowhere/x.yaml: error"));
  EXPECT_THAT(input_error_of([] { parse("a: {ros__parameters: &x {b: *x}}"); }), HasSubstr("error"));
  EXPECT_EQ(input_error_of([] { parse("a: {ros__parameters: }"); }), "");  // empty sections are common
}

TEST(ParameterFile, PipeIsRefusedWithoutWaiting) {
  const std::string pipe = ::testing::TempDir() + "parameters." + std::to_string(::getpid());
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(input_error_of([&] { ParameterFile::load(pipe); }),
              AllOf(HasSubstr("it is not a regular file"), HasSubstr("write the parameters into a file")));
  ::unlink(pipe.c_str());
}

// Whatever the bytes are, the result is a file or an InputError, within a short time.
TEST(ParameterFile, RandomTextIsInputError) {
  const std::string seed_text = R"(controller_manager:
  ros__parameters:
    update_rate: 100 # Hz
    arm: {type: "x/Y", params_file: [a.yaml, 'b']}
/**: &all
  ros__parameters:
    joints: [Revolute 1, "Revolute 2"]
    gains: &g {a.b: {p: 1.0, i: .inf}}
    other: *g
)";
  const std::string alphabet = ":{}[]&*!|>'\"#%@`-? \n\t,.<~0aZ\x80\xff";
  for (unsigned seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::string text = seed_text;
    for (unsigned i = 0, n = 1 + random() % 6; i < n; ++i) {
      const std::size_t at = random() % text.size();
      const char c = alphabet[random() % alphabet.size()];
      switch (random() % 3) {
        case 0:
          text[at] = c;
          break;
        case 1:
          text.insert(at, 1 + random() % 3, c);
          break;
        default:
          text.erase(at, 1 + random() % 20);
          break;
      }
    }
    input_error_of([&] { static_cast<void>(parse(text).overrides_for("/controller_manager")); });
  }
  input_error_of([] { parse("a: {ros__parameters: {b: " + std::string(100'000, '[') + "}}"); });
  input_error_of([] { parse("a: {ros__parameters: {b: " + std::string(100'000, '{') + "}}"); });
  std::string bomb = "a: {ros__parameters: {x0: &x0 {v: 1}";
  for (int i = 1; i < 30; ++i) {
    const std::string name = fmt::format("x{}", i), last = fmt::format("*x{}", i - 1);
    bomb += ", " + name + ": &" + name + " {a: " + last + ", b: " + last + "}";
  }
  EXPECT_THAT(input_error_of([&] { parse(bomb + "}}"); }), HasSubstr("error"));
}

TEST(ParameterDeclaration, OverrideReplacesDefault) {
  Parameters parameters;
  auto o = parse("n: {ros__parameters: {gain: 3, list: [1, 2], none: [], unused: 1}}").overrides_for("n");
  EXPECT_EQ(declare<double>(parameters, &o, "gain", 1.0), 3.0);
  EXPECT_EQ(declare<double>(parameters, &o, "other", 1.5), 1.5);
  EXPECT_EQ(declare<double>(parameters, nullptr, "third", 2.5), 2.5);
  EXPECT_THAT(declare<std::vector<double>>(parameters, &o, "list", {}), ElementsAre(1.0, 2.0));
  EXPECT_TRUE(declare<std::vector<double>>(parameters, &o, "none", {7.0}).empty());
  EXPECT_EQ(std::get<double>(parameters.find("gain")->value), 3.0);
  Diagnostics diagnostics;
  report_unused(o, "n", {"gain", "unusedd"}, diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 1u);
  EXPECT_THAT(diagnostics.all()[0].str(), HasSubstr("'n' has no parameter 'unused'"));
  EXPECT_THAT(diagnostics.all()[0].str(), HasSubstr("did you mean 'unusedd'?"));
}

TEST(ParameterDeclaration, WrongTypeOrValueIsRefusedWithPlace) {
  Parameters parameters;
  auto o = parse("n:\n  ros__parameters:\n    joints: a\n    rate: 1.5\n    depth: -1\n").overrides_for("n");
  const std::string joints =
      input_error_of([&] { declare<std::vector<std::string>>(parameters, &o, "joints", {}); });
  EXPECT_THAT(joints, HasSubstr("p.yaml:3:13: error: parameter 'joints' is a"));
  EXPECT_THAT(joints, HasSubstr("write it as a list: [a]"));
  auto yes = parse("m: {ros__parameters: {joints: [y]}}").overrides_for("m");
  EXPECT_THAT(input_error_of([&] { declare<std::vector<std::string>>(parameters, &yes, "joints", {}); }),
              HasSubstr("quote names"));
  EXPECT_THAT(input_error_of([&] { declare<std::int64_t>(parameters, &o, "rate", 1); }),
              HasSubstr("p.yaml:4:11"));
  const auto check = [](const ParameterValue& v) {
    return std::get<std::int64_t>(v) > 0 ? Status{} : Status::refused("must be positive");
  };
  EXPECT_THAT(input_error_of([&] {
                declare<std::int64_t>(parameters, &o, "depth", 1, {"", false, check});
              }),
              HasSubstr("p.yaml:5:12: error: parameter 'depth': must be positive"));
}

}  // namespace
}  // namespace doppel
