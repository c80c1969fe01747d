#pragma once
// Lines of /rosout, by which a verb quotes the reason of a refusal: most services and actions answer only
// with yes or no.

#include <map>
#include <string>

#include "app/verbs/shell.h"

namespace doppel::app {

inline constexpr const char* kReasonElsewhere = "; the twin's terminal and /rosout give the reason";

class LogLines {
 public:
  // Subscribes, so that lines are received from now on.
  explicit LogLines(Client& twin);
  ~LogLines();
  LogLines(const LogLines&) = delete;
  LogLines& operator=(const LogLines&) = delete;

  // Remembers a warning or an error; messages of other topics are ignored.
  void take(const Client::Received& message);
  // The last warning or error of the node ("/left/arm_controller"); waits for one for a short time, in which
  // messages of other topics are dropped. "": there is none.
  std::string last_problem(const std::string& node);
  // ": " and that line, or where to look for the reason.
  std::string reason(const std::string& node);

 private:
  Client& twin_;
  bool subscribed_ = false;
  std::map<std::string, std::string> last_;  // by logger name
};

}  // namespace doppel::app
