#pragma once
// The announcements by which shells find running twins: a file per twin in the user's run-time folder
// ($XDG_RUNTIME_DIR/doppel, else /tmp/doppel-<uid>, readable only by the user).

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API RunningTwin {
  int pid = 0;
  std::uint16_t port = 0;
  std::string robot;
  std::int64_t started = 0;                    // ns since the epoch, wall-clock time
  std::string address = "127.0.0.1", token{};  // for programs of this user on this machine
  bool emulated = false;                       // an arm behind a port, whose driver is another program
  // Its domain on the ROS 2 network, and its nodes there; nullopt: it has not joined one.
  std::optional<std::uint32_t> domain{};
  std::vector<std::string> nodes{};

  [[nodiscard]] std::string label() const;  // "desk_arm, emulated (port 8700)"
};

// The announcement of this process, removed by the destructor. If the folder cannot be used, the twin runs
// unannounced (problem()), and shells need --port.
class DOPPEL_API Announcement {
 public:
  Announcement(std::string robot, std::uint16_t port, const std::string& address = "127.0.0.1",
               const std::string& token = "");
  ~Announcement();
  Announcement(const Announcement&) = delete;
  Announcement& operator=(const Announcement&) = delete;

  // Why it is not announced, or not safely (enter_domain()); empty: it is.
  [[nodiscard]] const std::string& problem() const { return problem_; }

  void mark_emulated();
  // Announces the nodes that are about to join the domain, unless a running twin of this user has one of
  // their names there: it is returned, and nothing is announced. If two start at once, one gets the names,
  // unless another process keeps the folder locked for longer than `lock_timeout` (else
  // FolderLock::kLockTimeout).
  std::optional<RunningTwin> enter_domain(std::uint32_t domain, std::vector<std::string> nodes);
  std::optional<RunningTwin> enter_domain(std::uint32_t domain, std::vector<std::string> nodes,
                                          std::chrono::milliseconds lock_timeout);

 private:
  void write();

  RunningTwin about_;
  std::filesystem::path file_;
  std::string problem_;
};

DOPPEL_API std::filesystem::path announcement_folder();

// Newest first. Removes announcements of processes that no longer exist.
DOPPEL_API std::vector<RunningTwin> find_running();

}  // namespace doppel
