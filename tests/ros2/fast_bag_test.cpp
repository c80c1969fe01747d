// The services of rosbag2's recorder and player as a ROS 2 process on Fast DDS calls them: of a twin that
// records itself, and of the player of this bag.

#include <gtest/gtest.h>
#include <rosbag2_interfaces.h>

#include <filesystem>

#include "fast_peer.h"
#include "twin_process.h"

namespace doppel::ros2_testing {
namespace {

namespace fs = std::filesystem;
using namespace rosbag2_interfaces::srv::dds_;  // NOLINT

template <class Request, class Response>
std::optional<Response> call(FastPeer& peer, const std::string& service, const Request& request = {}) {
  return ServiceClient<Request, Response>(peer, service).call(request);
}

const std::string kRecorder = "/rosbag2_recorder/", kPlayer = "/rosbag2_player/";

// Pauses and goes on.
void control_recorder(FastPeer& peer) {
  using IsPaused = ServiceClient<IsPaused_Request_, IsPaused_Response_>;
  IsPaused is_paused(peer, kRecorder + "is_paused");
  ASSERT_TRUE((call<Pause_Request_, Pause_Response_>(peer, kRecorder + "pause")));
  EXPECT_TRUE(is_paused.call({}).value().paused_());
  ASSERT_TRUE((call<Resume_Request_, Resume_Response_>(peer, kRecorder + "resume")));
  EXPECT_FALSE(is_paused.call({}).value().paused_());
  ASSERT_TRUE((call<SplitBagfile_Request_, SplitBagfile_Response_>(peer, kRecorder + "split_bagfile")));
}

void control_player(FastPeer& peer) {
  Burst_Request_ burst;
  burst.num_messages_() = 5;
  const auto played = call<Burst_Request_, Burst_Response_>(peer, kPlayer + "burst", burst);
  ASSERT_TRUE(played.has_value());
  EXPECT_EQ(played->actually_burst_(), 5U);
  SetRate_Request_ rate;
  rate.rate_() = 2;
  const auto is_set = call<SetRate_Request_, SetRate_Response_>(peer, kPlayer + "set_rate", rate);
  ASSERT_TRUE(is_set.has_value());
  EXPECT_TRUE(is_set->success_());
  EXPECT_EQ((call<GetRate_Request_, GetRate_Response_>(peer, kPlayer + "get_rate").value().rate_()), 2);
  Seek_Request_ seek;
  seek.time_().sec_() = 100'000;
  const auto is_there = call<Seek_Request_, Seek_Response_>(peer, kPlayer + "seek", seek);
  ASSERT_TRUE(is_there.has_value());
  EXPECT_FALSE(is_there->success_()) << "expected a refusal of a time behind the end";
}

TEST(FastBag, PeerControlsRecorderAndPlayer) {
  const fs::path bag = fs::path(testing::TempDir()) / "fast_bag";
  fs::remove_all(bag);
  FastPeer peer(own_domain());
  TwinProcess twin({"--record", bag.string()});
  control_recorder(peer);
  ASSERT_TRUE((call<Stop_Request_, Stop_Response_>(peer, kRecorder + "stop"))) << twin.output();
  EXPECT_TRUE(fs::exists(bag / "metadata.yaml")) << "expected a complete bag while the twin runs";
  EXPECT_EQ(twin.process().interrupt(), 0) << twin.output();

  Process player({doppel_program(), "bag", "play", bag.string(), "--headless", "--start-paused"},
                 twin.variables(), twin.folder() / "play.log");
  control_player(peer);
  ASSERT_TRUE((call<Stop_Request_, Stop_Response_>(peer, kPlayer + "stop")));
  EXPECT_EQ(player.wait(), 0);
  fs::remove_all(bag);
}

}  // namespace
}  // namespace doppel::ros2_testing
