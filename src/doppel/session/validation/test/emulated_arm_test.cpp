// The services of a validation beside a twin whose arm has emulated servos: they judge the machine as the
// verb does, without the servos.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/session/live/session.h"
#include "doppel/session/validation/live_validation.h"

namespace doppel {
namespace {

using doppel_msgs::msg::Validation;
using doppel_msgs::srv::Validate;

Scenario arm_with_emulated_servos() {
  Scenario out;
  out.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  out.robots = {{.target = "desk_arm", .arguments = {{"use_sim", "false"}}}};
  out.hardware = HardwareUse::emulated;
  return out;
}

class ValidationBesideServos : public testing::Test {
 protected:
  ValidationBesideServos()
      : twin_(arm_with_emulated_servos(), log_, diagnostics_),
        listener_(twin_.bus(), "/listener"),
        edge_(twin_.bus().attach("edge")) {
    listener_.subscribe<Validation>("/doppel/validation",
                                    [this](const Validation& message) { last_ = message; });
    SessionOptions options;
    options.reload = false;
    options.scenario = arm_with_emulated_servos();
    options.validation = [] {
      return make_live_validation(
          {{DOPPEL_SOURCE_DIR "/robots", DOPPEL_SOURCE_DIR "/datasheets"}, "1.2.3", 2});
    };
    session_.emplace(twin_, options, log_);
    session_->begin();
  }
  ~ValidationBesideServos() override {
    session_->end();
    session_.reset();
  }

  template <class Condition>
  bool run_until(const Condition& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(240);
    while (!condition() && std::chrono::steady_clock::now() < end) {
      twin_.between_steps();
      twin_.step();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return condition();
  }
  Validate::Response start(const Validate::Request& request) {
    std::optional<Validate::Response> out;
    edge_->call("/doppel/validate", to_cdr(request), [&](const Status& status, const Bytes& cdr) {
      EXPECT_TRUE(status) << status.why();
      EXPECT_TRUE(from_cdr(cdr, out.emplace()));
    });
    EXPECT_TRUE(run_until([&] { return out.has_value(); }));
    return out.value_or(Validate::Response{});
  }

  Log log_;
  Diagnostics diagnostics_;
  Twin twin_;
  Node listener_;
  Validation last_;
  std::unique_ptr<Edge> edge_;
  std::optional<TwinSession> session_;
};

TEST_F(ValidationBesideServos, ArmIsJudgedWithoutThem) {
  Validate::Request request;
  request.effort = "quick";
  request.only = {"G09", "G13", "T2", "T4"};
  request.joint = "elbow_flex";
  const Validate::Response started = start(request);
  ASSERT_TRUE(started.success) << started.message;
  ASSERT_TRUE(
      run_until([&] { return last_.state == Validation::FINISHED || last_.state == Validation::FAILED; }));
  EXPECT_EQ(last_.state, Validation::FINISHED) << last_.message;
  ASSERT_EQ(last_.outcomes.size(), 4U);
  for (const auto& outcome : last_.outcomes) {
    // G09 warns of a plugin of Gazebo beside the driver, as the verb does with use_sim:=false.
    const bool warns = outcome.id == "G09";
    EXPECT_EQ(std::string(outcome.verdict), warns ? "warning" : "passed")
        << outcome.id << ": " << outcome.summary;
  }
}

}  // namespace
}  // namespace doppel
