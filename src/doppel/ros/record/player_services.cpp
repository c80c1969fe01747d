#include "doppel/ros/record/player_services.h"

#include <algorithm>
#include <utility>

namespace doppel {
namespace {

namespace srv = rosbag2_interfaces::srv;

constexpr std::size_t kBurstPart = 1000;  // messages of a burst between two looks for other requests

Duration not_negative(Duration duration) {
  return std::max(duration, Duration{});
}

}  // namespace

PlayerServices::PlayerServices(Bus& bus, BagPlayer& player) : player_(player), node_(bus, kPlayerNode) {
  serve_pace();
  serve_place();
}

template <Service S, class Act>
void PlayerServices::serve(const char* name, Act act) {
  node_.serve<S>(
      name, [this, act](const typename S::Request& request, const Responder<typename S::Response>& respond) {
        requests_.emplace_back([act, request, respond](Clock::time_point now) {
          typename S::Response response;
          act(request, response, now);
          respond(response);
        });
      });
}

void PlayerServices::serve_pace() {
  const auto pause = [this](bool yes, Clock::time_point now) {
    if (!player_.is_stopped()) player_.pause(yes, now);
  };
  serve<srv::Pause>("~/pause", [pause](const auto&, auto&, auto now) { pause(true, now); });
  serve<srv::Resume>("~/resume", [pause](const auto&, auto&, auto now) { pause(false, now); });
  serve<srv::TogglePaused>("~/toggle_paused",
                           [this, pause](const auto&, auto&, auto now) { pause(!player_.is_paused(), now); });
  serve<srv::IsPaused>("~/is_paused", [this](const auto&, srv::IsPaused::Response& response, auto) {
    response.paused = player_.is_paused();
  });
  serve<srv::GetRate>("~/get_rate", [this](const auto&, srv::GetRate::Response& response, auto) {
    response.rate = player_.rate();
  });
  serve<srv::SetRate>(
      "~/set_rate", [this](const srv::SetRate::Request& request, srv::SetRate::Response& response, auto now) {
        response.success = request.rate >= kMinPlayRate && request.rate <= kMaxPlayRate;
        if (response.success) player_.set_rate(request.rate, now);
      });
}

void PlayerServices::serve_place() {
  serve<srv::PlayNext>("~/play_next", [this](const auto&, srv::PlayNext::Response& response, auto now) {
    response.success = player_.is_paused() && player_.step(now);
  });
  serve<srv::Seek>(
      "~/seek", [this](const srv::Seek::Request& request, srv::Seek::Response& response, auto now) {
        const std::int64_t time = nanoseconds_of(from_msg(request.time));
        response.success = !player_.is_stopped() && time <= static_cast<std::int64_t>(player_.end());
        // A time before the beginning is the beginning, as in rosbag2.
        if (response.success) player_.seek(static_cast<std::uint64_t>(std::max<std::int64_t>(0, time)), now);
      });
  serve<srv::Play>("~/play",
                   [this](const srv::Play::Request& request, srv::Play::Response& response, auto now) {
                     PlayedPart part;
                     part.start = not_negative(Duration(nanoseconds_of(from_msg(request.start_offset))));
                     part.duration = not_negative(from_msg(request.playback_duration));
                     const std::int64_t until = nanoseconds_of(from_msg(request.playback_until_timestamp));
                     part.until = static_cast<std::uint64_t>(std::max<std::int64_t>(0, until));
                     response.success = player_.play_part(part, now);
                   });
  serve<srv::Stop>("~/stop", [this](const auto&, auto&, auto) { player_.stop(); });
  node_.serve<srv::Burst>(
      "~/burst", [this](const srv::Burst::Request& request, const Responder<srv::Burst::Response>& respond) {
        bursts_.push_back({request.num_messages, 0, respond});
      });
}

void PlayerServices::work(Clock::time_point now) {
  while (!requests_.empty()) {
    const auto request = std::move(requests_.front());
    requests_.pop_front();
    request(now);
  }
  if (!bursts_.empty()) go_on(now);
}

void PlayerServices::go_on(Clock::time_point now) {
  Burst& burst = bursts_.front();
  for (std::size_t i = 0; i < kBurstPart; ++i) {
    const bool is_complete = burst.count > 0 && burst.done == burst.count;
    if (is_complete || !player_.is_paused() || !player_.step(now)) {
      burst.respond({burst.done});
      bursts_.pop_front();
      return;
    }
    ++burst.done;
  }
}

}  // namespace doppel
