// The services of a player, with the meaning that they have in rosbag2, and what its options choose.
#include "doppel/ros/record/player_services.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/record/bag_writer.h"
#include "doppel/ros/record/qos_overrides.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
namespace srv = rosbag2_interfaces::srv;
using std_msgs::msg::String;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using namespace std::chrono_literals;

constexpr std::uint64_t kOneSecond = 1'000'000'000;

// A bag with the messages "1" to "5" of /a, at 1 s to 5 s.
class PlayerServicesTest : public testing::Test {
 protected:
  PlayerServicesTest() {
    fs::remove_all(folder_);
    BagWriter writer({.folder = folder_});
    RecordedTopic topic;
    topic.name = "/a";
    topic.type = String::kType;
    topic.schema = find_type(topic.type)->schema();
    const std::size_t a = writer.add_topic(topic);
    for (std::uint64_t i = 1; i <= 5; ++i)
      writer.write(a, static_cast<std::uint32_t>(i), i * kOneSecond, i * kOneSecond,
                   to_cdr(String{std::to_string(i)}));
    writer.close();
    listener_.subscribe<String>("/a", [this](const String& message) { got_.push_back(message.data); });
    listener_.subscribe<rosgraph_msgs::msg::Clock>(
        "/clock", [this](const auto& message) { got_.push_back("t" + std::to_string(message.clock.sec)); });
  }
  ~PlayerServicesTest() override { fs::remove_all(folder_); }

  void start(const PlayerOptions& options) {
    reader_.emplace(folder_.string());
    player_.emplace(bus_, *reader_, options, log_);
    services_.emplace(bus_, *player_);
    bus_.spin();
    player_->begin_now(now_);
  }
  void pass(std::chrono::milliseconds time) {
    now_ += time;
    services_->work(now_);
    player_->play(now_);
    bus_.spin();
  }
  template <Service S>
  typename S::Response call(const std::string& name, const typename S::Request& request = {}) {
    std::optional<typename S::Response> out;
    client_->call("/rosbag2_player/" + name, to_cdr(request), [&](const Status& status, const Bytes& cdr) {
      EXPECT_TRUE(status) << status.why();
      EXPECT_TRUE(from_cdr(cdr, out.emplace()));
    });
    for (int i = 0; i < 10 && !out; ++i) pass(0ms);
    EXPECT_TRUE(out.has_value()) << name;
    return out.value_or(typename S::Response{});
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("player_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  Log log_;
  Bus bus_;
  Node listener_{bus_, "/listener"};
  std::unique_ptr<Edge> client_ = bus_.attach("client");
  std::vector<std::string> got_;
  std::optional<BagReader> reader_;
  std::optional<BagPlayer> player_;
  std::optional<PlayerServices> services_;
  BagPlayer::Clock::time_point now_ = BagPlayer::Clock::now();
};

TEST_F(PlayerServicesTest, PauseHoldsMessagesAndResumeGoesOn) {
  start({});
  pass(1100ms);
  EXPECT_FALSE(call<srv::IsPaused>("is_paused").paused);
  call<srv::Pause>("pause");
  EXPECT_TRUE(call<srv::IsPaused>("is_paused").paused);
  pass(10s);
  EXPECT_THAT(got_, ElementsAre("1", "2"));
  call<srv::TogglePaused>("toggle_paused");
  pass(1100ms);
  EXPECT_THAT(got_, ElementsAre("1", "2", "3"));
  call<srv::Pause>("pause");
  call<srv::Resume>("resume");
  EXPECT_FALSE(player_->is_paused());
}

TEST_F(PlayerServicesTest, RateIsSetWhereItIsValid) {
  start({});
  EXPECT_TRUE(call<srv::SetRate>("set_rate", {2}).success);
  for (const double wrong : {0.0, -1.0, 1e300, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_FALSE(call<srv::SetRate>("set_rate", {wrong}).success) << wrong;
  EXPECT_EQ(call<srv::GetRate>("get_rate").rate, 2);
  pass(1100ms);
  EXPECT_THAT(got_, ElementsAre("1", "2", "3"));
}

TEST_F(PlayerServicesTest, NextMessageAndBurstNeedPause) {
  start({.paused = true});
  EXPECT_TRUE(call<srv::PlayNext>("play_next").success);
  EXPECT_EQ(call<srv::Burst>("burst", {2}).actually_burst, 2U);
  EXPECT_THAT(got_, ElementsAre("1", "2", "3"));
  call<srv::Resume>("resume");
  EXPECT_FALSE(call<srv::PlayNext>("play_next").success);
  EXPECT_EQ(call<srv::Burst>("burst", {2}).actually_burst, 0U);
  call<srv::Pause>("pause");
  EXPECT_EQ(call<srv::Burst>("burst", {0}).actually_burst, 2U);
  EXPECT_FALSE(call<srv::PlayNext>("play_next").success);
  EXPECT_EQ(got_.size(), 5U);
}

TEST_F(PlayerServicesTest, SeekGivesMessagesFromThereOn) {
  start({.paused = true});
  EXPECT_TRUE(call<srv::Seek>("seek", {{.sec = 4}}).success);
  got_.clear();  // the state at that time
  call<srv::Burst>("burst", {0});
  EXPECT_THAT(got_, ElementsAre("4", "5"));
  EXPECT_FALSE(call<srv::Seek>("seek", {{.sec = 6}}).success);
  EXPECT_TRUE(call<srv::Seek>("seek", {}).success) << "expected the beginning";
  EXPECT_EQ(player_->time(), kOneSecond);
}

TEST_F(PlayerServicesTest, StoppedPlayerPlaysPartThatIsAskedFor) {
  start({});
  EXPECT_FALSE(call<srv::Play>("play").success) << "expected a refusal while it plays";
  call<srv::Stop>("stop");
  EXPECT_TRUE(player_->at_end());
  EXPECT_FALSE(call<srv::PlayNext>("play_next").success);
  EXPECT_FALSE(call<srv::Seek>("seek", {{.sec = 4}}).success);
  got_.clear();
  EXPECT_TRUE(call<srv::Play>("play", {{.sec = 1}, {.sec = 1}, {}}).success);
  pass(10s);
  EXPECT_THAT(got_, ElementsAre("1", "2", "3"));  // "1": the state at its beginning
  got_.clear();
  EXPECT_TRUE(call<srv::Play>("play", {{.sec = 1}, {.sec = 1}, {.sec = 4}}).success);
  pass(10s);
  EXPECT_THAT(got_, ElementsAre("1", "2", "3", "4")) << "expected the later of the two ends";
}

TEST_F(PlayerServicesTest, DelayComesBeforeEachRoundOfLoop) {
  start({.part = {.until = 2 * kOneSecond}, .delay = 1s, .loop = true});
  pass(900ms);
  EXPECT_THAT(got_, IsEmpty());
  pass(1200ms);
  EXPECT_THAT(got_, ElementsAre("1", "2"));
  pass(900ms);
  EXPECT_THAT(got_, ElementsAre("1", "2"));
  pass(200ms);
  EXPECT_THAT(got_, ElementsAre("1", "2", "1"));
}

TEST_F(PlayerServicesTest, ClockComesBeforeMessagesOfItsTopics) {
  start({.part = {.until = 2 * kOneSecond}, .clock_topics = {"/a"}});
  pass(5s);
  EXPECT_THAT(got_, ElementsAre("t1", "1", "t2", "2"));
}

TEST_F(PlayerServicesTest, QualitiesOfFileReplaceRecordedOnes) {
  const fs::path file = folder_ / "qos.yaml";
  std::ofstream(file) << "/a:\n  reliability: best_effort\n  depth: 7\n  lifespan: {sec: 1, nsec: 5}\n";
  start({.qos = read_qos_overrides(file)});
  for (const TopicInfo& topic : bus_.topics()) {
    if (topic.name != "/a") continue;
    ASSERT_EQ(topic.publishers.size(), 1U);
    EXPECT_EQ(topic.publishers[0].node, "/rosbag2_player");
    EXPECT_EQ(topic.publishers[0].qos, (Qos{.depth = 7, .best_effort = true, .lifespan = 1s + 5ns}));
  }
  std::ofstream(file) << "/a:\n  relability: best_effort\n  depth: many\n";
  try {
    static_cast<void>(read_qos_overrides(file));
    FAIL() << "expected an error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'reliability'"));
    EXPECT_THAT(error.what(), HasSubstr("qos.yaml:3:10"));
  }
}

}  // namespace
}  // namespace doppel
