// The corpus of broken robots (tests/broken_robots): each fails the check that is meant to find its fault,
// with the cause, and no check that has nothing to do with it; the healthy one passes all.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <ostream>
#include <set>

#include "doppel/base/yaml/yaml_fields.h"
#include "doppel/validation/statics/audit_gates.h"
#include "doppel/validation/statics/file_gates.h"
#include "doppel/validation/statics/reachability.h"
#include "doppel/validation/statics/self_collision_sweep.h"
#include "doppel/validation/statics/sensor_coverage.h"
#include "doppel/validation/statics/shape_gates.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

const fs::path& corpus() {
  static const fs::path folder = DOPPEL_SOURCE_DIR "/tests/broken_robots";
  return folder;
}

struct BrokenRobot {
  std::string name, check, says;
  std::set<std::string> also, options;
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
    const PlacedYaml root = load_yaml(corpus() / "expected.yaml", rules, "table");
    const PlacedYaml& entries = root["robots"];
    std::vector<BrokenRobot> out;
    for (std::size_t i = 0; i < entries.keys.size(); ++i) {
      const PlacedYaml& one = entries.items[i];
      out.push_back({entries.keys[i].text, one["check"].text, one["says"].text, words_of(one["also"]),
                     words_of(one["options"])});
    }
    return out;
  }();
  return robots;
}

// The part of the gate that needs no running twin.
CheckResult check_declared_controllers(const CheckContext& context) {
  CheckResult out = begin_result("G09");
  add_control_findings(context, out);
  return out;
}

using CheckFunction = CheckResult (*)(const CheckContext&);
const std::map<std::string, CheckFunction>& functions() {
  static const std::map<std::string, CheckFunction> all = {{"G01", check_origin},
                                                           {"G02", check_parsing},
                                                           {"G03", check_tree},
                                                           {"G04", check_inertias},
                                                           {"G05", check_collision_shapes},
                                                           {"G06", check_limits},
                                                           {"G07", check_motion_ranges},
                                                           {"T1", check_reachability},
                                                           {"T3", check_self_collision},
                                                           {"T5", check_sensor_coverage},
                                                           {"G09", check_declared_controllers}};
  return all;
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
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "doppel-broken.XXXXXX").string();
    folder_ = mkdtemp(name.data());
    const std::string make = (corpus() / "make").string() + " " + folder_.string() + " " + GetParam().name;
    ASSERT_EQ(std::system(make.c_str()), 0);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::map<std::string, CheckResult> check() {
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / GetParam().name).string()}};
    scenario.enforce_limits = !GetParam().options.contains("--no-limits");
    const Suite suite = load_suite(folder_ / GetParam().name / "validation" / "suite.yaml");
    const Subject subject = read_subject(scenario, {});
    CheckContext context{subject, suite};
    context.effort = Effort::quick;
    context.write_answers = false;
    std::map<std::string, CheckResult> out;
    for (const auto& [id, function] : functions()) {
      // Without a machine there are only the gates of its files.
      if (subject.refusal.empty() || id == "G01" || id == "G02") out.emplace(id, function(context));
    }
    return out;
  }

  fs::path folder_;
};

TEST_P(BrokenRobots, FailTheirCheckAndNoOther) {
  const BrokenRobot& robot = GetParam();
  const std::map<std::string, CheckResult> results = check();
  for (const auto& [id, result] : results) {
    SCOPED_TRACE(text_of(result));
    if (id == robot.check) {
      EXPECT_EQ(result.verdict, Verdict::failed);
      EXPECT_NE(failures_of(result).find(robot.says), std::string::npos) << robot.says;
    } else if (!robot.also.contains(id)) {
      EXPECT_NE(result.verdict, Verdict::failed);
      EXPECT_NE(result.verdict, Verdict::not_run);
    }
    if (robot.check.empty()) {
      EXPECT_EQ(result.verdict, Verdict::passed);
    }
  }
  if (functions().contains(robot.check)) {
    EXPECT_TRUE(results.contains(robot.check));
  }
}

INSTANTIATE_TEST_SUITE_P(Corpus, BrokenRobots, testing::ValuesIn(table()),
                         [](const auto& robot) { return robot.param.name; });

}  // namespace
}  // namespace doppel
