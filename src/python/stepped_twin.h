#pragma once
// A twin as Python's Twin holds it: stepped on the thread that asks for it, with its state in arrays that
// keep their place in memory, and an edge to its bus.

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/base/mcap/mcap_file_sink.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/record/bus_recorder.h"
#include "doppel/session/live/session.h"
#include "doppel/twin/assembly/twin.h"
#include "python/fair_mutex.h"
#include "python/process_owned.h"

namespace doppel::python {

// The state of one robot, copied from the engine after each step() and each jump. Sizes never change, because
// a robot that is spawned later under the same namespace is another one.
struct RobotArrays {
  explicit RobotArrays(const TwinRobot& robot);

  std::string name_space;
  std::weak_ptr<const CompiledRobot> machine;
  std::atomic<bool> removed{false};  // any thread reads it
  std::vector<double> q, v;          // [nq] [nv] rad, m and their rates
  std::vector<double> effort;        // [nv] N m, N: of the drives in the last step
  std::vector<double> command;       // [driven] rad, m: written by Python; NaN: none
  std::vector<int> driven;           // joints of the model
  std::vector<double> applied;       // [driven] the commands of the last step
};

struct TextMessage {
  double time = 0;  // s, when it was published
  std::string json;
};

class SteppedTwin {
 public:
  // Throws InputError.
  explicit SteppedTwin(const Scenario& scenario);
  ~SteppedTwin();
  SteppedTwin(const SteppedTwin&) = delete;
  SteppedTwin& operator=(const SteppedTwin&) = delete;

  // All functions lock the twin, unless they say otherwise, so that several threads of Python may use it.
  // Callers do not hold the interpreter's lock. In a fork of the process all but close(), unsubscribe() and
  // stop_recording(), which have no effect there, throw InputError "python.forked".
  //
  // Ends everything but the arrays. The functions below throw InputError "python.closed" afterwards.
  void close();
  [[nodiscard]] bool is_closed() const;

  // `steps` steps with the present commands. Ends early if the physics diverges, and throws InputError. A
  // new command of a joint that a controller commands is discarded, and InputError "python.claimed" thrown
  // before the first step.
  void step(std::uint64_t steps);
  void reset();
  // Throws InputError "python.claimed" if a controller commands this one of RobotArrays::driven.
  void check_command(std::size_t robot, std::size_t driven) const;
  void set_state(std::size_t robot, const std::vector<double>& q, const std::vector<double>& v);
  [[nodiscard]] std::shared_ptr<const SavedState> save();
  void restore(const SavedState& state);

  // A copy of what `function` reads from the twin, or from one of its robots.
  template <class Function>
  [[nodiscard]] auto read(Function function) const {
    const auto lock = hold();
    return function(twin());
  }
  template <class Function>
  [[nodiscard]] auto read_robot(std::size_t robot, Function function) const {
    const auto lock = hold();
    return function(std::as_const(robot_of(robots_.at(robot))));
  }

  // Without a lock: what does not change, and the log, which has a lock of its own.
  [[nodiscard]] const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }
  [[nodiscard]] RobotArrays& arrays(std::size_t robot) { return robots_.at(robot); }
  [[nodiscard]] std::vector<LogLine> take_log();
  // Throws InputError "python.robot_removed" if the robot was deleted before the end of the last call that
  // changed the state. Without a lock.
  void check_present(std::size_t robot) const;

  // -- the bus; messages are JSON
  void publish(const std::string& topic, const std::string& type, const std::string& json);
  // Keeps the last `depth` messages from now on.
  void subscribe(const std::string& topic, std::size_t depth);
  void unsubscribe(const std::string& topic);
  // The messages since the last call, the oldest first.
  [[nodiscard]] std::vector<TextMessage> take_messages(const std::string& topic);
  // The bytes of the newest message, in CDR; empty: none has come.
  [[nodiscard]] Bytes newest(const std::string& topic, double& time);
  // The number of a request, whose answer take_answer() gives. Throws InputError: no such service, or a
  // request that is not of its type.
  std::uint32_t begin_call(const std::string& service, const std::string& json);
  // Steps until the answer is there, at most `steps` times. False: it is not. Throws as step().
  bool step_until_answered(std::uint32_t call, std::uint64_t steps);
  // nullopt: not yet. Throws InputError "service.refused" with the reason.
  std::optional<std::string> take_answer(std::uint32_t call);
  [[nodiscard]] std::vector<NamedParameter> parameters();
  void set_parameter(const std::string& node, const std::string& name, const ParameterValue& value);

  // Serves the page of the twin; it shows what steps do. `port`: 0: 8700 or the next that is free. Returns
  // its address; a second call only that. Throws InputError.
  std::string view(int port);

  // One file, until stop_recording() or the end of the twin; returns the number of messages.
  void record(const std::string& file);
  std::uint64_t stop_recording();

 private:
  struct Subscription {
    TopicId topic = 0;
    std::string type;
    std::size_t depth = 1;
    std::deque<std::pair<Time, Bytes>> messages;  // not yet taken
    std::pair<Time, Bytes> newest;
  };
  struct Answer {
    const TypeSupport* type = nullptr;
    bool is_there = false;
    Status status;
    Bytes cdr;
  };

  [[nodiscard]] std::unique_lock<FairMutex> hold() const;
  // The functions below: `mutex_` is held.
  [[nodiscard]] Twin& twin() const;
  void discard_claimed_commands();
  void apply_commands();
  void take_steps(std::uint64_t steps, const bool* enough = nullptr);
  void copy_state();
  void receive();
  [[nodiscard]] TwinRobot* find(const RobotArrays& arrays) const;  // nullptr: it was removed
  [[nodiscard]] TwinRobot& robot_of(const RobotArrays& arrays) const;
  [[nodiscard]] Subscription& subscription(const std::string& topic);

  OwningProcess process_;
  mutable FairMutex mutex_;
  Log log_;
  std::deque<LogLine> lines_;
  std::mutex lines_mutex_;
  std::vector<Diagnostic> diagnostics_;
  ProcessOwned<Twin> twin_;
  std::deque<RobotArrays> robots_;
  ProcessOwned<Edge> edge_;
  std::map<std::string, Subscription> subscriptions_;
  std::map<std::uint32_t, std::shared_ptr<Answer>> answers_;
  std::uint32_t next_call_ = 1;
  ProcessOwned<McapFileSink> sink_;
  ProcessOwned<BusRecorder> recorder_;
  ProcessOwned<TwinSession> session_;  // nullptr: no page is served
};

}  // namespace doppel::python
