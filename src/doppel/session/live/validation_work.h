#pragma once
// The suite behind the services of a validation (validation_service.h). It is an interface, because the suite
// belongs to the second part of the program (docs/decisions/021): a twin loads it with the first request.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/parameters.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

struct ValidationRequest {
  Scenario scenario;  // one robot, without a world
  doppel_msgs::srv::Validate::Request call;
  std::vector<NamedParameter> parameters;  // of its controllers, that clients have set since the start
};

struct ValidationWatcher {
  std::function<void(std::vector<std::string> judged)> begins;  // once the machine is read
  // False: the validation ends.
  std::function<bool(double done, const std::string& check)> progress;
  std::function<void(const doppel_msgs::msg::CheckOutcome& outcome)> on_outcome;
};

class DOPPEL_API ValidationWork {
 public:
  virtual ~ValidationWork() = default;

  // -- any thread
  [[nodiscard]] virtual doppel_msgs::srv::ListChecks::Response checks() const = 0;
  // Throws InputError: an effort or a check that does not exist, with the nearest one.
  virtual void check_words(const doppel_msgs::srv::Validate::Request& call) const = 0;
  // JSON of docs/validate.schema.json with curves and commands: the results so far; empty: there are none.
  [[nodiscard]] virtual std::string results() const = 0;
  // Throws InputError: no run has ended, or there is no such format.
  [[nodiscard]] virtual std::string report(const std::string& format, const std::string& page) const = 0;

  // -- one thread at a time
  // Returns the verdict in a line. Throws InputError: there is nothing to judge, or a joint that the robot
  // does not have.
  virtual std::string run(const ValidationRequest& request, const ValidationWatcher& watcher) = 0;
};

// Any thread; called once. Throws: the second part of the program is missing.
using LoadValidation = std::function<std::shared_ptr<ValidationWork>()>;

}  // namespace doppel
