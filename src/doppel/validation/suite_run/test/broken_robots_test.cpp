// The corpus of broken robots (tests/broken_robots): each fails the check that is meant to find its fault,
// with the cause, and no check that has nothing to do with it; the healthy one passes all.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <set>

#include "broken_robot_files.h"
#include "doppel/base/yaml/yaml_fields.h"
#include "doppel/validation/suite_run/validate.h"

namespace doppel {
namespace {

struct BrokenRobot {
  std::string name, check, says;
  std::set<std::string> also, options;
  bool open = false;
};

void PrintTo(const BrokenRobot& robot, std::ostream* out) {
  *out << robot.name;
}

std::set<std::string> words_of(const PlacedYaml& list) {
  std::set<std::string> out;
  for (const PlacedYaml& item : list.items) out.insert(item.text);
  return out;
}

const std::vector<BrokenRobot>& table() {
  static const std::vector<BrokenRobot> robots = [] {
    const YamlRules rules{"", "", "", "", ""};
    const PlacedYaml root = load_yaml(broken_robots_corpus() / "expected.yaml", rules, "table");
    const PlacedYaml& entries = root["robots"];
    std::vector<BrokenRobot> out;
    for (std::size_t i = 0; i < entries.keys.size(); ++i) {
      const PlacedYaml& one = entries.items[i];
      out.push_back({entries.keys[i].text, one["check"].text, one["says"].text, words_of(one["also"]),
                     words_of(one["options"]), !one["open"].text.empty()});
    }
    return out;
  }();
  return robots;
}

// Those that need no running twin, besides the gate of controllers.
const std::vector<std::string>& quick_checks() {
  static const std::vector<std::string> ids = {"G01", "G02", "G03", "G04", "G05", "G06",
                                               "G07", "G09", "T1",  "T3",  "T5"};
  return ids;
}

// All that a report shows of a check.
std::string text_of(const CheckResult& result) {
  std::string out = fmt::format("{} {}: {}\n", result.id, to_string(result.verdict), result.summary);
  for (const CheckItem& item : result.items)
    out += fmt::format("  {} {}: {}; {}\n", to_string(item.verdict), item.subject, item.message, item.fix);
  for (const std::string& note : result.notes) out += fmt::format("  note {}\n", note);
  return out;
}

std::string failures_of(const CheckResult& result) {
  std::string out;
  for (const CheckItem& item : result.items)
    if (item.verdict == Verdict::failed) out += item.subject + ": " + item.message + "; " + item.fix + "\n";
  return out + (result.verdict == Verdict::failed ? result.summary : "");
}

class BrokenRobots : public testing::TestWithParam<BrokenRobot> {
 protected:
  // The quick checks, and the one that has to find the fault; of the healthy robot all.
  std::vector<CheckResult> check() {
    const BrokenRobot& robot = GetParam();
    const Suite suite = files_.suite();
    const Subject subject = files_.subject(!robot.options.contains("--no-limits"));
    ValidationOptions options;
    options.effort = Effort::quick;
    options.write_answers = false;
    options.only = quick_checks();
    if (robot.check.empty()) {
      options.only = check_ids({"gates", "tests"});
    } else if (std::ranges::find(options.only, robot.check) == options.only.end()) {
      options.only.push_back(robot.check);
    }
    return validate(subject, suite, options).checks;
  }

  const BrokenRobotFiles files_{GetParam().name};
};

TEST_P(BrokenRobots, FailTheirCheckAndNoOther) {
  const BrokenRobot& robot = GetParam();
  bool has_run = robot.check.empty();
  for (const CheckResult& result : check()) {
    SCOPED_TRACE(text_of(result));
    if (result.id == robot.check) {
      has_run = true;
      if (robot.open) continue;
      EXPECT_EQ(result.verdict, Verdict::failed);
      EXPECT_NE(failures_of(result).find(robot.says), std::string::npos) << robot.says;
    } else if (!robot.also.contains(result.id)) {
      EXPECT_NE(result.verdict, Verdict::failed);
      if (robot.check != "G02") {
        EXPECT_NE(result.verdict, Verdict::not_run);
      }
    }
    if (robot.check.empty()) {
      EXPECT_EQ(result.verdict, Verdict::passed);
    }
  }
  EXPECT_TRUE(has_run);
}

INSTANTIATE_TEST_SUITE_P(Corpus, BrokenRobots, testing::ValuesIn(table()),
                         [](const auto& robot) { return robot.param.name; });

}  // namespace
}  // namespace doppel
