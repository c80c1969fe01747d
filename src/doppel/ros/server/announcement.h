#pragma once
// The announcements by which shells find running twins: a file per twin in the user's run-time folder
// ($XDG_RUNTIME_DIR/doppel, else /tmp/doppel-<uid>, readable only by the user).

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct RunningTwin {
  int pid = 0;
  std::uint16_t port = 0;
  std::string robot;
  std::int64_t started = 0;                    // ns since the epoch, wall-clock time
  std::string address = "127.0.0.1", token{};  // for programs of this user on this machine
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

  [[nodiscard]] const std::string& problem() const { return problem_; }  // empty: announced

 private:
  std::filesystem::path file_;
  std::string problem_;
};

DOPPEL_API std::filesystem::path announcement_folder();

// Newest first. Removes announcements of processes that no longer exist.
DOPPEL_API std::vector<RunningTwin> find_running();

}  // namespace doppel
