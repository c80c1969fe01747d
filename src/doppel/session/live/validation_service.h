#pragma once
// The suite of `doppel validate` for the robots of a running twin: /doppel/validate with its progress on
// /doppel/validation and its results on /doppel/validation/results, both latched. It runs on copies of the
// robots' descriptions, in threads of the lowest priority, one run at a time.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/session/live/validation_work.h"

namespace doppel {

struct ValidatedRobot {
  Scenario scenario;  // of this robot alone, without a namespace
  std::string name_space;
  std::vector<std::string> controllers;  // names without the namespace
};

struct ValidationServiceOptions {
  // The loop's thread: the robot with that namespace; of an empty one the robot without a namespace, or the
  // first. Throws InputError: there is no such robot, or it has no description in a file.
  std::function<ValidatedRobot(const std::string& name_space)> robot;
  LoadValidation load;
  std::string page;  // this twin's, for the links of a report
};

class DOPPEL_API ValidationService {
 public:
  // The loop's thread, as all functions; the bus outlives the service.
  ValidationService(Bus& bus, ValidationServiceOptions options);
  // Cancels a run, and waits a moment for its end; see abandoned_thread.h.
  ~ValidationService();
  ValidationService(const ValidationService&) = delete;
  ValidationService& operator=(const ValidationService&) = delete;

 private:
  struct LoopPart;
  struct Shared;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
