#pragma once
// The tree of frames as a client receives it on /tf and /tf_static.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/verbs/shell.h"
#include "doppel/base/math/pose.h"

namespace doppel::app {

struct TfFrame {
  std::string parent;
  Pose X_PF = Pose::Identity();  // this frame in its parent
  Time stamp{};
  bool fixed = false;
  // Statistics of the received messages.
  std::size_t count = 0;
  Time first_stamp{};
};

class TfFrames {
 public:
  explicit TfFrames(Client& twin);

  // Receives transforms until `enough`, or until the timeout (false).
  bool gather(const std::function<bool()>& enough, std::chrono::steady_clock::time_point until);
  // Until each of the two topics that has publishers has sent a message, at most 2 s.
  bool gather_all();

  [[nodiscard]] bool has_dynamic() const { return has_dynamic_; }
  [[nodiscard]] bool has_static() const { return has_static_; }
  [[nodiscard]] bool moving_expected() const;
  [[nodiscard]] const std::map<std::string, TfFrame>& all() const { return frames_; }
  [[nodiscard]] std::vector<std::string> names() const;
  // The nodes that publish transforms of this kind.
  [[nodiscard]] std::vector<std::string> broadcasters(bool fixed) const;
  // `child` in `parent`, if both are in one tree; `stamp`: the latest on the path.
  [[nodiscard]] bool look_up(const std::string& parent, const std::string& child, Pose& X, Time& stamp) const;

 private:
  // With --ns those of the selected robot, without prefixes.
  const std::string moving_topic_ = absolute("tf"), fixed_topic_ = absolute("tf_static");

  void take(const Client::Received& message);
  std::string root_of(std::string name, Pose& X_RootF, Time& stamp) const;

  Client& twin_;
  std::map<std::string, TfFrame> frames_;
  bool has_dynamic_ = false, has_static_ = false;
};

}  // namespace doppel::app
