// What one client may ask of the server: one more is refused, and the client is served all the same.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/server/hub.h"

namespace doppel {
namespace {

// Keeps the bodies of the frames that a client gets.
struct KeepingLink final : ClientLink {
  void send(OutgoingFrame frame) override {
    frames.emplace_back(reinterpret_cast<const char*>(frame.body.data()), frame.body.size());
  }
  [[nodiscard]] std::size_t unsent_assets() const override { return unsent; }
  [[nodiscard]] std::size_t count(std::string_view text) const {
    std::size_t out = 0;
    for (const std::string& frame : frames) out += frame.find(text) != std::string::npos ? 1 : 0;
    return out;
  }
  std::vector<std::string> frames;
  std::size_t unsent = 0;
};

class HubLimitsTest : public testing::Test {
 protected:
  using Trigger = std_srvs::srv::Trigger;
  using Number = std_msgs::msg::Float64;

  HubLimitsTest() {
    arm_.serve<Trigger>("~/hold",
                        [this](const Trigger::Request&, const Responder<Trigger::Response>& respond) {
                          waiting_.push_back(respond);
                        });
    arm_.subscribe<Number>("/command", [this](const Number&) { ++received_; });
    client_ = hub_.join(link_);
    other_ = hub_.join(other_link_);
  }

  static HubOptions with_files() {
    HubOptions options;
    options.assets = std::make_shared<AssetLibrary>();
    return options;
  }
  void step() {
    bus_.spin();
    std::vector<std::function<void()>> tasks;
    {
      const std::lock_guard lock(mutex_);
      tasks.swap(tasks_);
    }
    for (const auto& task : tasks) task();
  }
  template <class Condition>
  bool step_until(const Condition& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      step();
      std::this_thread::yield();
    }
    return true;
  }

  [[nodiscard]] std::uint32_t service_id(const std::string& name) const {
    for (const std::string& frame : link_.frames) {
      auto json = nlohmann::json::parse(frame, nullptr, false);
      if (!json.is_object() || json.value("op", "") != "advertiseServices") continue;
      for (auto& service : json["services"]) {
        if (service["name"].get<std::string>() == name) return service["id"].get<std::uint32_t>();
      }
    }
    ADD_FAILURE() << "expected the service " << name;
    return 0;
  }
  void call(std::uint32_t service, std::uint32_t number) {
    const Bytes request = to_cdr(Trigger::Request{});
    hub_.on_binary(client_, foxglove::to_frame(foxglove::ServiceCall{service, number, "cdr", request}));
  }
  void advertise(std::uint32_t id, const std::string& topic, const std::string& encoding = "cdr",
                 const std::string& type = "std_msgs/msg/Float64") {
    foxglove::Advertise request;
    request.channels.push_back({.id = id, .topic = topic, .encoding = encoding, .schema_name = type});
    hub_.on_text(client_, foxglove::to_frame(request));
  }
  void publish(std::uint32_t channel, foxglove::ByteView payload) {
    hub_.on_binary(client_, foxglove::to_frame(foxglove::ClientData{channel, payload}));
  }
  void fetch(std::uint32_t request) {
    hub_.on_text(client_, foxglove::to_frame(foxglove::FetchAsset{request, "package://arm/none.stl"}));
  }

  Bus bus_;
  Node arm_{bus_, "/arm"};
  int received_ = 0;
  std::vector<Responder<Trigger::Response>> waiting_;
  std::mutex mutex_;
  std::vector<std::function<void()>> tasks_;  // of any thread
  KeepingLink link_, other_link_;
  Hub hub_{bus_, with_files(), [this](std::function<void()> task) {
             const std::lock_guard lock(mutex_);
             tasks_.push_back(std::move(task));
           }};
  Hub::ClientId client_ = 0, other_ = 0;
};

TEST_F(HubLimitsTest, UnansweredCallsAreBounded) {
  constexpr std::uint32_t kMaxCalls = 256;
  constexpr std::string_view kRefusal = "too many calls are waiting";
  const std::uint32_t service = service_id("/arm/hold");
  for (std::uint32_t i = 1; i <= kMaxCalls; ++i) call(service, i);
  EXPECT_EQ(link_.count(kRefusal), 0U);
  call(service, kMaxCalls + 1);
  EXPECT_EQ(link_.count(kRefusal), 1U);
  ASSERT_TRUE(step_until([&] { return waiting_.size() == kMaxCalls; }));
  const std::size_t before = link_.frames.size();
  for (const auto& respond : std::exchange(waiting_, {})) respond({.success = true, .message = "done"});
  ASSERT_TRUE(step_until([&] { return link_.frames.size() >= before + kMaxCalls; }));
  call(service, kMaxCalls + 2);
  EXPECT_TRUE(step_until([&] { return waiting_.size() == 1; })) << "expected the client to be served again";
  EXPECT_EQ(link_.count(kRefusal), 1U);
}

TEST_F(HubLimitsTest, ChannelsOfClientAreBounded) {
  constexpr std::uint32_t kMaxChannels = 1024;
  for (std::uint32_t i = 0; i < kMaxChannels; ++i) advertise(i, fmt::format("/topic_{}", i));
  EXPECT_EQ(link_.count("cannot advertise"), 0U);
  advertise(kMaxChannels, "/command");
  EXPECT_EQ(link_.count("the maximum of 1024 channels per client is reached"), 1U);
  hub_.on_text(client_, R"({"op":"unadvertise","channelIds":[0]})");
  advertise(kMaxChannels, "/command");
  publish(kMaxChannels, to_cdr(Number{.data = 5}));
  EXPECT_TRUE(step_until([&] { return received_ == 1; }));
}

TEST_F(HubLimitsTest, WatchedParametersAreBounded) {
  constexpr int kMaxWatched = 1024;
  nlohmann::json names = nlohmann::json::array();
  for (int i = 0; i < kMaxWatched; ++i) names.push_back(fmt::format("/arm.p{}", i));
  const auto watch = [this](const nlohmann::json& parameters) {
    const nlohmann::json request{{"op", "subscribeParameterUpdates"}, {"parameterNames", parameters}};
    hub_.on_text(client_, request.dump());
  };
  watch(names);
  EXPECT_EQ(link_.count("too many parameters are watched"), 0U);
  watch(nlohmann::json::array({"/arm.rate"}));
  EXPECT_EQ(link_.count("too many parameters are watched"), 1U);
}

TEST_F(HubLimitsTest, FetchesThatWaitAreBounded) {
  constexpr std::uint32_t kMaxFetches = 4096;
  constexpr std::string_view kRefusal = "the maximum of 4096 pending file requests is reached";
  link_.unsent = 1;  // a file that the client does not read, behind which the requests wait
  for (std::uint32_t i = 0; i < kMaxFetches; ++i) fetch(i);
  EXPECT_EQ(link_.count(kRefusal), 0U);
  fetch(kMaxFetches);
  EXPECT_EQ(link_.count(kRefusal), 1U);
  link_.unsent = 0;
  hub_.has_room(client_);
  EXPECT_TRUE(step_until([&] { return link_.count("cannot fetch 'package://arm/none.stl'") > 0; }));
  fetch(kMaxFetches + 1);
  EXPECT_EQ(link_.count(kRefusal), 1U) << "expected the next request to be accepted";
}

TEST_F(HubLimitsTest, ClientIsNotReadWhileSixteenRequestsWait) {
  const std::uint32_t service = service_id("/arm/hold");
  for (std::uint32_t i = 0; i < 16; ++i) {
    EXPECT_TRUE(hub_.is_ready(client_, false)) << i;
    call(service, i);
  }
  EXPECT_FALSE(hub_.is_ready(client_, false));
  EXPECT_TRUE(hub_.is_ready(other_, false)) << "expected the other client not to wait";
  step();
  EXPECT_TRUE(hub_.is_ready(client_, false));
}

TEST_F(HubLimitsTest, ClientIsNotReadWhileSixteenReadsAreUnanswered) {
  for (int i = 0; i < 16; ++i)
    hub_.on_text(client_, R"({"op":"getParameters","parameterNames":["/arm.rate"],"id":"x"})");
  bus_.spin();  // the loop has served them, and their answers wait for the server's thread
  EXPECT_FALSE(hub_.is_ready(client_, false));
  EXPECT_TRUE(hub_.is_ready(other_, false));
  step();
  EXPECT_TRUE(hub_.is_ready(client_, false));
  EXPECT_EQ(link_.count("parameterValues"), 16U);
}

// 36 MB wait, of 32 MiB for all clients together.
TEST_F(HubLimitsTest, NoClientIsReadWhileTooManyBytesWait) {
  advertise(1, "/text", "cdr", "std_msgs/msg/String");
  std_msgs::msg::String message;
  message.data = std::string(12'000'000, 'x');
  const Bytes cdr = to_cdr(message);
  publish(1, cdr);
  publish(1, cdr);
  EXPECT_TRUE(hub_.is_ready(other_, false));
  publish(1, cdr);
  EXPECT_FALSE(hub_.is_ready(client_, false));
  EXPECT_FALSE(hub_.is_ready(other_, false));
  step();
  EXPECT_TRUE(hub_.is_ready(client_, false));
  EXPECT_TRUE(hub_.is_ready(other_, false));
}

TEST_F(HubLimitsTest, JsonOfMoreThanMegabyteIsRefused) {
  advertise(1, "/command", "json");
  const std::string small = R"({"data": 5})", large = small + std::string(std::size_t{1} << 20, ' ');
  publish(1, std::as_bytes(std::span(large)));
  EXPECT_EQ(link_.count("JSON of more than 1048576 bytes; use cdr"), 1U);
  publish(1, std::as_bytes(std::span(small)));
  EXPECT_TRUE(step_until([&] { return received_ == 1; }));
}

}  // namespace
}  // namespace doppel
