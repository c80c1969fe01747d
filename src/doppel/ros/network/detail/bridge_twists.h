#pragma once
// Private to the bridge: publishers of geometry_msgs Twist on topics where the bus's nodes read TwistStamped, or the
// reverse (ros/bus/twist_conversion.h). DDS never connects endpoints of different types, so that such a publisher is
// known by discovery only: it is reported once, and read by a further participant, because Fast DDS gives a topic
// one type in each participant. That participant exists only once there has been such a publisher. The bridge's
// thread only.

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "doppel/ros/network/bridge.h"
#include "doppel/ros/network/detail/bridge_backlog.h"
#include "doppel/ros/network/detail/bridge_topics.h"

namespace doppel::ros2 {

class BridgedTwists {
 public:
  using Join = std::function<std::unique_ptr<Participant>()>;
  // `join` makes the further participant; throws NetworkError.
  BridgedTwists(Bus& bus, Edge& edge, NetworkStatus& status, RejectionLog& rejections, const Log& log,
                Join join)
      : bus_(bus), edge_(edge), status_(status), rejections_(rejections), log_(log), join_(std::move(join)) {}

  using SteadyTime = std::chrono::steady_clock::time_point;
  // After a change of the graph. `own`: the bridge's participant.
  void look_at(const std::vector<GraphTopic>& topics, const Gid& own, SteadyTime now);
  // Reports publishers whose nodes have not been announced for some time: a node of ROS 2 is announced after its
  // endpoints.
  void report_unnamed(const Gid& own, SteadyTime now);
  // From the network to the bus, a limited number; true: there may be more.
  bool take();
  [[nodiscard]] bool is_held_back() const { return backlog_.is_full(); }
  // True if it is the further participant.
  [[nodiscard]] bool is_own(const Gid& gid) const {
    return participant_ != nullptr && participant_->gid() == gid;
  }

 private:
  void report(const std::string& topic, const GraphEndpoint& publisher, const Gid& own);
  void read(const std::string& topic, const std::string& type);

  Bus& bus_;
  Edge& edge_;
  NetworkStatus& status_;
  RejectionLog& rejections_;
  const Log& log_;
  const Join join_;
  std::unique_ptr<Participant> participant_;  // before the readers, which it outlives
  std::map<std::pair<std::string, std::string>, std::unique_ptr<Reader>> readers_;  // by topic and type
  std::set<std::pair<std::string, Gid>> reported_;
  struct Unnamed {
    GraphEndpoint publisher;
    SteadyTime since;
  };
  std::map<std::pair<std::string, Gid>, Unnamed> unnamed_;  // by topic; not reported yet
  bool failed_ = false;                                     // the participant could not be made
  Sample sample_;
  Backlog backlog_;
};

}  // namespace doppel::ros2
