#pragma once
// The process that reads launch files (python/launch_reader), and what it asks for.

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/child_process.h"
#include "doppel/base/packages/package_resolver.h"

namespace doppel {

// Bounds of a reader of files that nobody vouches for: it is confined, and ended at a time.
struct ReaderBounds {
  std::chrono::steady_clock::time_point end;
};

class LaunchReader {
 public:
  // `words`: those of read_launch_file.py. `bounds`: nullptr for none. Both references outlive it. Throws
  // InputError: there is no Python; ConfinementError.
  LaunchReader(std::vector<std::string> words, PackageResolver& resolver, const std::filesystem::path& folder,
               const ReaderBounds* bounds);

  // Answers requests until the next result; a discarded value: the reader has ended, or its time is over.
  nlohmann::json next();
  [[nodiscard]] bool is_late() const { return late_; }

 private:
  std::string line();
  bool send(const std::string& text);
  // Waits for a pipe; false: the time is over.
  bool wait_for(int fd, short events);
  nlohmann::json answer(const nlohmann::json& request);
  nlohmann::json answer_xacro(const nlohmann::json& request);
  nlohmann::json answer_package(const std::string& name);
  nlohmann::json answer_write(const nlohmann::json& request);

  PackageResolver& resolver_;
  const std::filesystem::path& folder_;
  std::optional<ReaderBounds> bounds_;
  std::optional<ChildProcess> python_;
  std::string buffer_;
  std::size_t searched_ = 0, written_ = 0;
  int requests_ = 0;
  bool late_ = false;
};

}  // namespace doppel
