#pragma once
// `doppel up` as a separate process, which ends with the test in any case. The program is DOPPEL
// (environment) of the source tree DOPPEL_ROOT.

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace doppel::ros2_testing {

// DOPPEL_ROOT
std::filesystem::path source_folder();
// DOPPEL
std::string doppel_program();

// A ROS domain that no other test on this machine uses at the moment; the same one for the life of this
// process.
int own_domain();

// A child of this process that is killed when the object is destroyed, and by the kernel when this process
// ends.
class Process {
 public:
  // Standard output and error go to the file `log`. The environment is this process's, with `variables`
  // ("NAME=value").
  Process(const std::vector<std::string>& command, const std::vector<std::string>& variables,
          const std::filesystem::path& log);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  [[nodiscard]] bool running();
  [[nodiscard]] pid_t pid() const { return pid_; }  // -1 once it has ended
  void kill();                                      // SIGKILL: without a chance to clean up
  int interrupt();  // SIGINT; waits; the exit code (128 + signal, if a signal ended it)
  int wait();       // waits until it exits; the exit code likewise

 private:
  int reap(int options);
  pid_t pid_ = -1;
  int exit_code_ = -1;
};

class TwinProcess {
 public:
  // `doppel up` of a bundled robot in own_domain(), with additional arguments, and with `range` as
  // ROS_AUTOMATIC_DISCOVERY_RANGE: this machine's loopback only. Returns at once.
  explicit TwinProcess(const std::vector<std::string>& more_arguments = {},
                       const std::string& robot = "omarm_one", const std::string& range = "LOCALHOST");
  ~TwinProcess();

  Process& process() { return *process_; }
  [[nodiscard]] std::string output() const;  // its output so far
  // For other programs in its network, which find it by its announcement.
  [[nodiscard]] const std::vector<std::string>& variables() const { return variables_; }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }  // removed at the end

 private:
  std::filesystem::path folder_;
  std::vector<std::string> variables_;
  std::unique_ptr<Process> process_;
};

}  // namespace doppel::ros2_testing
