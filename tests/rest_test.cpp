// Every bundled robot, and every robot of ../shared/corpus if it is there, loads and is at rest half a second
// after the start: no joint beyond its limits, none above 0.1 rad/s, without a command.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kShards = 8;  // so that several cores share the corpus

// What cannot be at rest, each with the cause that the report must name.
const std::map<std::string, std::string>& restless() {
  // The masses in the file are too large for the effort limits in the file.
  static const std::map<std::string, std::string> cases{
      {"moveo-moveo_urdf", "its effort limit of 5 N m is too low for its load"},
      {"moveo-moveo_urdf_new", "its effort limit of 5 N m is too low for its load"},
      {"moveo-moveo_urdf_og", "its effort limit of 5 N m is too low for its load"},
      {"erd_open-simple_humanoid", "its effort limit of 30 N m is too low for its load"},
      {"erd_open-simple_humanoid_classical", "its effort limit of 30 N m is too low for its load"}};
  return cases;
}

struct Outcome {
  std::string refusal;
  bool diverged = false;
  std::vector<std::string> unsettled;
};

Outcome outcome_of(const fs::path& target) {
  Scenario scenario;
  scenario.robots = {{.target = target.string()}};
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  Outcome out;
  const Log log;
  Diagnostics diagnostics;
  try {
    Twin twin(scenario, log, diagnostics);
    while (!twin.robot().rest() && !twin.diverged() && twin.now() < time_from_seconds(1.0)) {
      twin.between_steps();
      twin.step();
    }
    out.diverged = twin.diverged();
    if (!twin.robot().rest()) {
      out.unsettled.push_back("rest was not looked at");
    } else {
      out.unsettled = twin.robot().rest()->unsettled;
    }
  } catch (const InputError& error) {
    out.refusal = error.what();
  }
  return out;
}

void expect_rest(const std::string& name, const fs::path& target) {
  SCOPED_TRACE(name);
  const Outcome outcome = outcome_of(target);
  EXPECT_EQ(outcome.refusal, "");
  EXPECT_FALSE(outcome.diverged);
  const auto known = restless().find(name);
  if (known == restless().end()) {
    EXPECT_THAT(outcome.unsettled, IsEmpty());
  } else {
    EXPECT_THAT(outcome.unsettled, ::testing::Each(HasSubstr(known->second)));
    EXPECT_THAT(outcome.unsettled, ::testing::Not(IsEmpty()))
        << "expected motion; it is at rest now: remove it from the list";
  }
}

TEST(RestAfterStart, BundledRobotsAreAtRestAfterHalfSecond) {
  int robots = 0;
  for (const auto& entry : fs::directory_iterator(DOPPEL_SOURCE_DIR "/robots")) {
    if (!fs::exists(entry.path() / "package.xml")) continue;
    expect_rest(entry.path().filename().string(), entry.path());
    ++robots;
  }
  EXPECT_GE(robots, 3);
}

class CorpusAtRestTest : public ::testing::TestWithParam<int> {};

TEST_P(CorpusAtRestTest, RobotAcceptedByCheckUrdfIsAtRest) {
  const fs::path corpus = fs::weakly_canonical(fs::path(DOPPEL_SOURCE_DIR) / ".." / "shared" / "corpus");
  std::ifstream in(corpus / "manifest.json");
  if (!in) GTEST_SKIP() << "no corpus at " << corpus;
  int index = 0;
  for (const Json& record : Json::parse(in)) {
    if (record["expect"] != "ok" || record["kind"] == "srdf_xacro" || !record["check_urdf"]["ok"]) continue;
    if (index++ % kShards != GetParam()) continue;
    const Json& file = record["expected"].is_null() ? record["input"] : record["expected"];
    expect_rest(record["id"], corpus / file.get<std::string>());
  }
  EXPECT_GT(index, 200);
}

INSTANTIATE_TEST_SUITE_P(Shards, CorpusAtRestTest, ::testing::Range(0, kShards));

}  // namespace
}  // namespace doppel
