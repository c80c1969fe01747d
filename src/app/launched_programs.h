#pragma once
// The user's own programs of a launch file, beside a twin: started when it is ready, with their output in
// its log, and ended with it, together with the processes that they have left in their groups.

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "app/run_twin.h"
#include "doppel/scenario/launch/launch_plan.h"

namespace doppel::app {

class LaunchedPrograms {
 public:
  explicit LaunchedPrograms(std::vector<LaunchedProgram> programs);
  ~LaunchedPrograms();
  LaunchedPrograms(const LaunchedPrograms&) = delete;
  LaunchedPrograms& operator=(const LaunchedPrograms&) = delete;

  // The programs start on a thread of their own. `run` has to live until end().
  void begin(const StartedRun& run);
  // Ends them: SIGINT, as Ctrl-C does, after 5 s SIGTERM, after two more SIGKILL.
  void end();

 private:
  struct Running;
  void run(const StartedRun& run);
  void start_all_after(int record, const StartedRun& run);
  void start(const LaunchedProgram& program, const StartedRun& run);
  // Prints what the programs have written, waits for some milliseconds.
  void pass_output(const Log& log);
  void notice_ends(const StartedRun& run);
  void stop_all(const Log& log);

  const std::vector<LaunchedProgram> programs_;
  std::vector<std::unique_ptr<Running>> running_;  // of the thread
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace doppel::app
