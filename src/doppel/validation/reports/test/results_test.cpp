#include "doppel/validation/reports/results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "doppel/base/core/diagnostic.h"
#include "doppel/validation/reports/test/example_report.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using reports_test::example_report;

class ResultsTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "doppel_results_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& text) {
    const fs::path file = folder_ / "results.json";
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  std::string refusal(const std::string& text) {
    try {
      read_results(write(text));
    } catch (const InputError& error) {
      return error.diagnostics().front().rule;
    }
    return "";
  }

  fs::path folder_;
};

TEST_F(ResultsTest, EvidenceHasCurvesWithExtremesAndCommands) {
  ValidationReport report;
  CheckResult& check = report.checks.emplace_back(begin_result("T4"));
  CheckItem& item = check.add({.subject = "a", .message = "slow"});
  PlotCurve curve{"q", {}, {}};
  for (int i = 0; i < 10'000; ++i) {
    curve.times.push_back(i);
    curve.values.push_back(i == 5'432 ? 7.25 : 0.5);
  }
  item.curves.push_back(
      {"step", "rad", "", {curve}, {{"limit", 0, std::numeric_limits<double>::infinity(), 1, 2}}});
  item.curves.back().x_axis = "Hz";
  item.poses.push_back({"there", {{"Revolute 1", 0.5}}});
  EXPECT_FALSE(Json::parse(to_json(report))["checks"][0]["items"][0].contains("curves"));
  const Json shown = Json::parse(to_json(report, {.evidence = true}))["checks"][0]["items"][0];
  const Json& panel = shown["curves"][0];
  EXPECT_EQ(panel["x_axis"], "Hz");
  EXPECT_EQ(panel["bands"][0]["high"], nullptr);
  EXPECT_LE(panel["curves"][0]["x"].size(), kMaxCurvePoints);
  EXPECT_EQ(panel["curves"][0]["x"].size(), panel["curves"][0]["y"].size());
  const auto values = panel["curves"][0]["y"].get<std::vector<double>>();
  EXPECT_EQ(std::ranges::count(values, 7.25), 1);
  EXPECT_EQ(shown["poses"][0]["command"], "doppel move 'Revolute 1=0.5'");
}

TEST_F(ResultsTest, JsonHasChecksItemsMetricsAndTiming) {
  const Json json = Json::parse(to_json(example_report()));
  EXPECT_EQ(json["schema_version"], 1);
  EXPECT_EQ(json["passed"], false);
  EXPECT_EQ(json["counts"]["failed"], 2);
  EXPECT_EQ(json["inputs"][1]["sha256"], nullptr);
  const Json& step = *std::ranges::find(json["checks"], "T4", [](const Json& check) { return check["id"]; });
  EXPECT_EQ(step["verdict"], "failed");
  EXPECT_EQ(step["items"][0]["line"], 14);
  EXPECT_EQ(step["items"][0]["poses"][0]["joints"]["Revolute 2"], 1.2);
  EXPECT_EQ(step["metrics"][1]["limit"], 0.5);
  EXPECT_EQ(step["metrics"][4]["limit"], nullptr);
  EXPECT_EQ(step["metrics"][4]["better"], "neither");
  const Json& start =
      *std::ranges::find(json["checks"], "G10", [](const Json& check) { return check["id"]; });
  EXPECT_TRUE(start["metrics"].empty());
  EXPECT_EQ(json["timing"]["seconds"], 41.3);
}

TEST_F(ResultsTest, JsonWithoutWallClockIsEqualInEachRun) {
  ValidationReport first = example_report(), second = example_report();
  second.seconds = 12;
  for (CheckResult& check : second.checks) {
    check.seconds += 3;
    for (Metric& metric : check.metrics) metric.value += metric.wall_clock ? 0.2 : 0;
    if (check.id == "G10") check.summary = "first motion after 1.04 s (limit 2 s)";
  }
  EXPECT_NE(to_json(first), to_json(second));
  EXPECT_EQ(to_json(first, {.wall_clock = false}), to_json(second, {.wall_clock = false}));
}

TEST_F(ResultsTest, ValueThatIsNotFiniteIsNull) {
  ValidationReport report = example_report();
  report.checks.front().metrics = {{"drift", "", NAN, "m", INFINITY}};
  const Json json = Json::parse(to_json(report));
  EXPECT_EQ(json["checks"][0]["metrics"][0]["value"], nullptr);
  EXPECT_EQ(json["checks"][0]["metrics"][0]["limit"], nullptr);
}

TEST_F(ResultsTest, ResultsAreReadBackWithoutWallClockTime) {
  const ValidationReport report = example_report();
  const Baseline baseline = read_results(write(to_json(report)));
  EXPECT_EQ(baseline.robot, "omarm");
  EXPECT_EQ(baseline.effort, "standard");
  EXPECT_EQ(baseline.metrics.size(), 8U);
  EXPECT_TRUE(regressions(report, baseline, 0).empty());
  EXPECT_TRUE(improvements(report, baseline, 0).empty());
}

TEST_F(ResultsTest, MetricBeyondToleranceIsRegressionOrImprovement) {
  ValidationReport report = example_report();
  const Baseline baseline = read_results(write(to_json(report)));
  for (CheckResult& check : report.checks) {
    for (Metric& metric : check.metrics) {
      if (metric.name == "settling") metric.value *= 1.1;                      // 10 % worse
      if (metric.name == "reached") metric.value *= 0.9;                       // 10 % worse
      if (metric.name == "overshoot") metric.value *= 0.9;                     // 10 % better
      if (metric.name == "saturated" || metric.wall_clock) metric.value *= 3;  // not compared
    }
  }
  const auto names = [](const std::vector<Regression>& changes) {
    std::vector<std::string> out;
    for (const Regression& one : changes) out.push_back(one.check + " " + one.metric.name);
    return out;
  };
  EXPECT_THAT(names(regressions(report, baseline, 0.05)),
              testing::ElementsAre("T1 reached", "T4 settling", "T4 settling"));
  EXPECT_THAT(names(improvements(report, baseline, 0.05)),
              testing::ElementsAre("T4 overshoot", "T4 overshoot"));
  EXPECT_TRUE(regressions(report, baseline, 0.2).empty());
  EXPECT_NEAR(regressions(report, baseline, 0.05)[1].before, 0.62, 1e-12);
}

TEST_F(ResultsTest, MetricThatWasZeroOrIsNoLongerFiniteIsRegression) {
  ValidationReport report;
  report.checks.push_back(begin_result("T1"));
  report.checks[0].metrics = {{"missed", "", 0, ""}, {"error", "", 0.1, "m"}};
  const Baseline baseline = read_results(write(to_json(report)));
  report.checks[0].metrics[0].value = 1e-3;
  report.checks[0].metrics[1].value = NAN;
  EXPECT_EQ(regressions(report, baseline, 0.05).size(), 2U);
}

TEST_F(ResultsTest, FilesThatAreNoResultsAreRefused) {
  EXPECT_EQ(refusal("{\"schema_version\": 2}"), "baseline.version");
  EXPECT_EQ(refusal("{\"schema_version\": 1}"), "baseline.not_results");
  EXPECT_EQ(refusal("{\"schema_version\": 1, \"robot\": 3}"), "baseline.not_results");
  EXPECT_EQ(refusal("[]"), "baseline.not_results");
  EXPECT_EQ(refusal("{"), "baseline.not_json");
  EXPECT_THROW(read_results(folder_ / "none.json"), InputError);
  EXPECT_THROW(read_results(folder_), InputError);
}

TEST_F(ResultsTest, PlacesBelowFolderAreRelative) {
  ValidationReport report = example_report();
  report.files[0].file = "/home/me/arm/arm.urdf";
  report.checks[0].add({.subject = "x",
                        .verdict = Verdict::failed,
                        .message = "see /home/me/arm/arm.urdf:3:1",
                        .where = make_location("/home/me/arm/arm.urdf", 3, 1)});
  shorten_places(report, "/home/me/arm");
  EXPECT_EQ(report.files[0].file, "arm.urdf");
  EXPECT_EQ(report.checks[0].items[0].message, "see arm.urdf:3:1");
  EXPECT_EQ(report.checks[0].items[0].where.str(), "arm.urdf:3:1");
}

}  // namespace
}  // namespace doppel
