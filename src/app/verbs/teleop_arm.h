#pragma once
// Moves single joints of an arm through its trajectory controllers, while a key is down.

#include <map>
#include <string>
#include <vector>

#include "app/verbs/shell.h"

namespace doppel::app {

class TeleopArm {
 public:
  // The joints of the active trajectory controllers, in their order. Without a controller manager: none.
  explicit TeleopArm(Client& twin);

  [[nodiscard]] const std::vector<std::string>& joints() const { return names_; }
  // A message of joint_states.
  void take(const Client::Received& message);
  // Moves joint `index` for `seconds` at `rate` (rad/s or m/s); false: it is not known where it is.
  bool move(std::size_t index, double rate, double seconds);
  // The next motion begins at the measured positions.
  void stop() { targets_.clear(); }

 private:
  struct Group {
    std::string topic;
    std::vector<std::string> joints;
  };
  Client& twin_;
  std::string states_;  // the topic of joint states
  std::vector<std::string> names_;
  std::vector<Group> groups_;
  std::map<std::string, double> positions_, targets_;
};

}  // namespace doppel::app
