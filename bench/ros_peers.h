#pragma once
// For benchmarks with ROS 2's network: a twin at 1 kHz, and peers in separate processes, on loopback and in a
// domain of the benchmark.

#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "doppel/ros/network/environment.h"
#include "doppel/ros/network/names.h"
#include "doppel/ros/network/participant.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel::bench {

// Wakes a peer's thread when data has arrived.
class Bell {
 public:
  void ring() {
    const std::lock_guard lock(mutex_);
    rung_ = true;
    condition_.notify_one();
  }
  void wait(std::chrono::milliseconds at_most) {
    std::unique_lock lock(mutex_);
    condition_.wait_for(lock, at_most, [this] { return rung_; });
    rung_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable condition_;
  bool rung_ = false;
};

inline ros2::ParticipantOptions own_domain() {
  ros2::ParticipantOptions options;
  options.domain = 29;
  return options;
}

// omarm_one with its controllers at the rate of the physics.
class FastScenario {
 public:
  FastScenario() {
    const std::filesystem::path robots = DOPPEL_ROBOTS;
    std::ostringstream text;
    text << std::ifstream(robots / "omarm_one/config/ros2_controllers.yaml").rdbuf();
    std::string yaml = text.str();
    const std::string slow = "update_rate: 100 ";
    const std::size_t at = yaml.find(slow);
    if (at == std::string::npos)
      throw std::runtime_error("expected omarm_one's controllers to run at 100 Hz");
    yaml.replace(at, slow.size(), "update_rate: 1000 ");
    file_ = std::filesystem::temp_directory_path() / ("bench_ros_" + std::to_string(getpid()) + ".yaml");
    std::ofstream(file_) << yaml;
    scenario.robots = {{.target = "omarm_one"}};
    scenario.bundled_robots = robots;
    scenario.robots.front().controllers = {file_};
  }
  ~FastScenario() { std::filesystem::remove(file_); }
  FastScenario(const FastScenario&) = delete;
  FastScenario& operator=(const FastScenario&) = delete;

  Scenario scenario;

 private:
  std::filesystem::path file_;
};

// For a peer: the peers of a killed benchmark end, so that they are not counted in the next one.
inline void end_with_parent() {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
}

// A process that runs until the object is destroyed. Its output is kept.
class Peer {
 public:
  // This program again, with the argument `role`.
  explicit Peer(const char* role) : Peer({"/proc/self/exe", role}) {}
  explicit Peer(std::vector<std::string> command) {
    if (pipe2(out_.data(), O_CLOEXEC) != 0) throw std::runtime_error("cannot create a pipe");
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, out_[1], STDOUT_FILENO);
    std::vector<char*> arguments;
    for (std::string& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const int failed = posix_spawn(&child_, arguments[0], &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    close(out_[1]);
    if (failed != 0) throw std::runtime_error("cannot start " + command[0]);
  }
  ~Peer() { end(); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  [[nodiscard]] pid_t pid() const { return child_; }
  // Ends it; returns its output.
  std::string end(int signal = SIGTERM) {
    if (child_ != 0) kill(child_, signal);
    return output();
  }
  // Waits until it exits.
  std::string output() {
    if (child_ == 0) return text_;
    std::array<char, 4096> part;
    for (ssize_t got = 0; (got = read(out_[0], part.data(), part.size())) > 0;)
      text_.append(part.data(), static_cast<std::size_t>(got));
    close(out_[0]);
    waitpid(child_, nullptr, 0);
    child_ = 0;
    return text_;
  }

 private:
  std::array<int, 2> out_{};
  pid_t child_ = 0;
  std::string text_;
};

inline ros2::EndpointSpec topic(std::string_view name, std::string_view type,
                                const ros2::QosProfile& qos = {}) {
  return {ros2::dds_name(ros2::NameKind::topic, name), ros2::dds_type(type), "", qos};
}

}  // namespace doppel::bench
