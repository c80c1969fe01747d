// The services of a validation, with the suite behind them.
#include "doppel/session/validation/live_validation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/session/live/validation_service.h"
#include "doppel/validation/reports/results.h"
#include "doppel/validation/suite_run/validate.h"

namespace doppel {
namespace {

using doppel_msgs::msg::Validation;
using doppel_msgs::srv::GetValidationReport;
using doppel_msgs::srv::ListChecks;
using doppel_msgs::srv::Validate;
using std_srvs::srv::Trigger;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;
using std::chrono::milliseconds;

Scenario scenario_of(const std::string& target) {
  Scenario out;
  out.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  out.robots = {{.target = target}};
  return out;
}

class LiveValidationTest : public testing::Test {
 protected:
  LiveValidationTest() : listener_(bus_, "/listener") {
    listener_.subscribe<Validation>("/doppel/validation",
                                    [this](const Validation& message) { states_.push_back(message); });
    listener_.subscribe<std_msgs::msg::String>(
        "/doppel/validation/results",
        [this](const std_msgs::msg::String& message) { results_ = message.data; });
    service_.emplace(bus_,
                     ValidationServiceOptions{
                         [this](const std::string& name_space) {
                           if (!name_space.empty())
                             throw InputError("validate.robot", {}, "there is no robot '" + name_space + "'");
                           return ValidatedRobot{scenario_of("omarm_zero"), "", {"arm"}};
                         },
                         [this] {
                           ++loads_;
                           return make_live_validation(
                               {{DOPPEL_SOURCE_DIR "/robots", DOPPEL_SOURCE_DIR "/datasheets"}, "1.2.3", 2});
                         },
                         "http://127.0.0.1:8711/"});
    edge_ = bus_.attach("edge");
  }

  template <class Condition>
  bool until(const Condition& condition, std::chrono::seconds at_most = std::chrono::seconds(240)) {
    for (const auto end = std::chrono::steady_clock::now() + at_most; !condition();) {
      if (std::chrono::steady_clock::now() > end) return false;
      bus_.wait(milliseconds(20));
      bus_.spin();
    }
    return true;
  }

  template <class Srv>
  typename Srv::Response call(const std::string& service, const typename Srv::Request& request) {
    typename Srv::Response response;
    bool done = false;
    edge_->call(service, to_cdr(request), [&](const Status& status, const Bytes& cdr) {
      EXPECT_TRUE(status) << status.why();
      EXPECT_TRUE(from_cdr(cdr, response));
      done = true;
    });
    EXPECT_TRUE(until([&] { return done; })) << service;
    return response;
  }

  Validate::Response start(std::vector<std::string> only, const std::string& joint = "") {
    Validate::Request request;
    request.effort = "quick";
    request.only.assign(only.begin(), only.end());
    request.joint = joint;
    return call<Validate>("/doppel/validate", request);
  }
  GetValidationReport::Response report(const std::string& format, const std::string& page = "") {
    GetValidationReport::Request request;
    request.format = format;
    request.page = page;
    return call<GetValidationReport>("/doppel/validate/report", request);
  }
  [[nodiscard]] bool is(std::uint8_t state) const {
    return !states_.empty() && states_.back().state == state;
  }

  Bus bus_;
  Node listener_;
  std::vector<Validation> states_;
  std::string results_;
  int loads_ = 0;
  std::optional<ValidationService> service_;
  std::unique_ptr<Edge> edge_;
};

TEST_F(LiveValidationTest, ChecksAreListedWithTheirLimits) {
  const ListChecks::Response checks = call<ListChecks>("/doppel/validate/checks", {});
  ASSERT_TRUE(checks.success) << checks.message;
  EXPECT_EQ(checks.ids.size(), check_table().size());
  const auto step = std::ranges::find(checks.ids, "T4") - checks.ids.begin();
  EXPECT_EQ(checks.kinds[static_cast<std::size_t>(step)], "test");
  EXPECT_THAT(std::string(checks.limits[static_cast<std::size_t>(step)]), HasSubstr("10 %"));
}

TEST_F(LiveValidationTest, ResultsAreThoseOfVerb) {
  const Validate::Response started = start({"G02", "G06", "T4"}, "Revolute 2");
  ASSERT_TRUE(started.success) << started.message;
  EXPECT_EQ(started.run, 1U);
  ASSERT_TRUE(until([&] { return is(Validation::FINISHED); })) << states_.back().message;
  const Subject subject = read_subject(scenario_of("omarm_zero"),
                                       {.datasheets = DOPPEL_SOURCE_DIR "/datasheets", .datasheet = {}});
  ValidationOptions options;
  options.effort = Effort::quick;
  options.only = check_ids({"G02", "G06", "T4"});
  options.joint = "Revolute 2";
  options.write_answers = false;
  ValidationReport expected = validate(subject, {}, options);
  expected.target = "omarm_zero";
  expected.version = "1.2.3";
  shorten_places(expected, std::filesystem::current_path());
  Json ours = Json::parse(report("json").text), theirs = Json::parse(to_json(expected));
  ours.erase("timing");
  theirs.erase("timing");
  EXPECT_EQ(ours, theirs);
  EXPECT_EQ(loads_, 1);
}

TEST_F(LiveValidationTest, ProgressRisesAndOutcomesFollow) {
  ASSERT_TRUE(start({"G02", "G06", "T4"}, "Revolute 2").success);
  ASSERT_TRUE(until([&] { return is(Validation::FINISHED); }));
  double done = 0;
  for (const Validation& state : states_) {
    EXPECT_GE(state.done, done);
    done = state.done;
  }
  EXPECT_EQ(done, 1);
  const Validation& last = states_.back();
  EXPECT_EQ(last.outcomes.size(), 3U);
  EXPECT_EQ(last.effort, "quick");
  EXPECT_THAT(std::string(last.judged.front()), HasSubstr("omarm_zero"));
  const Json results = Json::parse(results_);
  EXPECT_EQ(results["complete"], true);
  EXPECT_EQ(results["checks"].size(), 3U);
  const Json& step = results["checks"][2];
  ASSERT_EQ(step["id"], "T4");
  EXPECT_EQ(step["items"][0]["curves"][0]["x_axis"], "s");
  EXPECT_GT(step["items"][0]["curves"][0]["curves"][0]["x"].size(), 100U);
}

TEST_F(LiveValidationTest, UnknownWordsAreRefusedWithNearest) {
  EXPECT_THAT(std::string(start({"T44"}).message), HasSubstr("did you mean 'T4'"));
  Validate::Request request;
  request.effort = "quik";
  EXPECT_THAT(std::string(call<Validate>("/doppel/validate", request).message),
              HasSubstr("did you mean 'quick'"));
  request.effort = "";
  request.robot = "left";
  EXPECT_THAT(std::string(call<Validate>("/doppel/validate", request).message), HasSubstr("no robot 'left'"));
  EXPECT_TRUE(is(Validation::NONE)) << "expected no run";
  EXPECT_THAT(std::string(report("html").message), HasSubstr("no validation has ended"));
}

TEST_F(LiveValidationTest, UnknownJointFailsRunWithNearest) {
  ASSERT_TRUE(start({"T4"}, "Revolute 22").success);
  ASSERT_TRUE(until([&] { return is(Validation::FAILED); }));
  EXPECT_THAT(std::string(states_.back().message), HasSubstr("did you mean 'Revolute 2'"));
  EXPECT_TRUE(start({"G06"}).success) << "expected a new run after the failed one";
}

TEST_F(LiveValidationTest, SecondStartIsRefusedAndCancelEndsRun) {
  Trigger::Response cancelled = call<Trigger>("/doppel/validate/cancel", {});
  EXPECT_FALSE(cancelled.success);
  ASSERT_TRUE(start({"tests"}).success);
  const Validate::Response second = start({"G06"});
  EXPECT_FALSE(second.success);
  EXPECT_THAT(std::string(second.message), HasSubstr("a validation runs already"));
  EXPECT_THAT(std::string(report("html").message), HasSubstr("when it has ended"));
  ASSERT_TRUE(until([&] { return is(Validation::RUNNING) && states_.back().done > 0; }));
  cancelled = call<Trigger>("/doppel/validate/cancel", {});
  EXPECT_TRUE(cancelled.success) << cancelled.message;
  ASSERT_TRUE(until([&] { return is(Validation::CANCELLED); }));
  EXPECT_LT(states_.back().done, 1);
  EXPECT_EQ(Json::parse(results_)["complete"], false);
  ASSERT_TRUE(until([&] { return start({"G06"}).success; })) << "expected a new run after the cancelled one";
}

TEST_F(LiveValidationTest, ReportLinksToPageThatIsNamed) {
  ASSERT_TRUE(start({"G06", "T3"}).success);
  ASSERT_TRUE(until([&] { return is(Validation::FINISHED); }));
  EXPECT_THAT(std::string(report("html").text), HasSubstr("http://127.0.0.1:8711/?q="));
  const std::string other = report("html", "http://arm.local:9000/").text;
  EXPECT_THAT(other, HasSubstr("http://arm.local:9000/?q="));
  EXPECT_THAT(other, Not(HasSubstr(":8711")));
  EXPECT_THAT(std::string(report("markdown").text), HasSubstr("T3"));
  EXPECT_THAT(std::string(report("htm").message), HasSubstr("did you mean 'html'"));
}

TEST_F(LiveValidationTest, ParametersOfClientsActOnCopy) {
  Node arm(bus_, "/arm");
  arm.parameters().declare("gains.a.p", 1.0);
  arm.parameters().declare("other", 1.0);
  rcl_interfaces::msg::ParameterEvent event;
  event.node = "/arm";
  for (const auto& [name, value] : {std::pair{"gains.a.p", 3.0}, std::pair{"other", 7.0}}) {
    auto& changed = event.changed_parameters.emplace_back();
    changed.name = name;
    changed.value.type = rcl_interfaces::msg::ParameterType::PARAMETER_DOUBLE;
    changed.value.double_value = value;
  }
  ASSERT_TRUE(arm.parameters().set("gains.a.p", 3.0));
  listener_.advertise<rcl_interfaces::msg::ParameterEvent>("/parameter_events").publish(event, bus_.now());
  bus_.spin();
  ASSERT_TRUE(start({"G06"}).success);
  ASSERT_TRUE(until([&] { return is(Validation::FINISHED); }));
  std::string judged;
  for (const auto& sentence : states_.back().judged) judged += std::string(sentence) + "\n";
  EXPECT_THAT(judged, HasSubstr("arm.gains.a.p = 3"));
  EXPECT_THAT(judged, Not(HasSubstr("other"))) << "expected only values that are still in force";
}

TEST_F(LiveValidationTest, ServiceMayEndDuringRun) {
  ASSERT_TRUE(start({"tests"}).success);
  ASSERT_TRUE(until([&] { return is(Validation::RUNNING); }));
  const auto begin = std::chrono::steady_clock::now();
  service_.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3));
  bus_.spin();
}

}  // namespace
}  // namespace doppel
