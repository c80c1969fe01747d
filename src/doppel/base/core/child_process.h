#pragma once
// A program that runs beside this one, in a process group of its own; it ends with this process.

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/export.h"

namespace doppel {

// The file of a program as a shell finds it: a path, or a name in the folders of PATH. Empty: there is none
// that may be executed.
DOPPEL_API std::filesystem::path find_program(const std::string& name);
DOPPEL_API bool is_program(const std::filesystem::path& file);

struct ChildStart {
  std::vector<std::string> words;     // the program, searched in PATH, and its arguments
  std::filesystem::path folder = {};  // empty: that of this process
  // Variables in addition to those of this process. A confined program, which may be a stranger's, inherits
  // only those by which programs are found and those of the distribution of ROS.
  std::vector<std::pair<std::string, std::string>> environment = {};
  bool output_piped = false;  // stdout and stderr are one pipe, stdin is empty
  bool converses = false;     // descriptor 3 is a pipe that it writes to, 4 one that it reads
  bool own_group = true;      // false: signals of the terminal reach it, too
  // It reads files and computes, and has no effect but by its pipes: it cannot change a file, start a
  // process, use the network or signal others. It can open a device to read it. Its output is discarded
  // unless it is piped; processor time and memory are limited.
  bool confined = false;
};

// The kernel or the processor has no filter of system calls for `ChildStart::confined`.
class DOPPEL_API ConfinementError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class DOPPEL_API ChildProcess {
 public:
  // Throws std::system_error: it cannot be started (no such program, too many processes); ConfinementError:
  // it would not be confined. Call it from a thread that lives as long as the child: the kernel ends the
  // child with that thread.
  explicit ChildProcess(const ChildStart& start);
  // Ends what still runs of its group with SIGKILL.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  // The pipes; -1: none.
  [[nodiscard]] int output() const { return output_.get(); }
  [[nodiscard]] int requests() const { return requests_.get(); }
  [[nodiscard]] int answers() const { return answers_.get(); }

  // Sends a signal to the group, also to processes that the program has left there at its end.
  void signal(int number);
  // The exit code of the program, or 128 + signal; nullopt: it runs.
  std::optional<int> ended();
  int wait();
  // Neither the program nor another process of its group runs.
  bool group_ended();

 private:
  pid_t pid_ = 0;
  bool own_group_;
  std::optional<int> exit_code_;
  bool group_ended_ = false;
  FileDescriptor output_{-1}, requests_{-1}, answers_{-1};
};

}  // namespace doppel
