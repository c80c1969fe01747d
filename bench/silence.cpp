// kill -9 of a driver in motion: how long, and how far, the emulated arm behind a pseudo-terminal moves on,
// in wall-clock time, for each protocol. The driver is another process: this program with --drive.
//
//   bench_silence [--runs 50] [--only doppel/DynamixelX]
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "doppel/twin/assembly/runner.h"
#include "servo_rig.h"

namespace {

using namespace doppel;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::string write_arm(const fs::path& file, const std::string& plugin, const std::string& params) {
  std::ofstream(file) << bench::arm_description(plugin, "<param name=\"gentle\">never</param>" + params);
  return file.string();
}

// -- the driver's process

void send_goal(Edge& edge, double sign) {
  std::string positions;
  for (std::size_t i = 0; i < bench::kArmJoints; ++i)
    positions += fmt::format("{}{}", i == 0 ? "" : ", ", sign * (i % 2 == 0 ? 1.5 : 0.5));
  const TypeSupport* const type = find_type("trajectory_msgs/msg/JointTrajectory");
  std::string names;
  for (std::size_t i = 1; i <= bench::kArmJoints; ++i) names += fmt::format("{}j{}", i == 1 ? "" : ", ", i);
  Bytes cdr;
  bench::require(type->yaml_to_cdr(
      fmt::format("{{joint_names: [{}], points: [{{positions: [{}], time_from_start: {{sec: 2}}}}]}}", names,
                  positions),
      cdr));
  bench::require(edge.publish("/bench", "/joint_trajectory_controller/joint_trajectory", type->name, cdr));
}

// Moves to and fro until it is killed; "moving" on standard output when it begins.
int drive(const std::string& arm) {
  Log log;
  log.add_sink([](const LogLine& line) {
    if (line.severity >= Severity::warning) fmt::print(stderr, "{}: {}\n", line.origin, line.text);
  });
  Diagnostics diagnostics;
  Scenario scenario;
  scenario.robots = {{.target = arm}};
  scenario.hardware = HardwareUse::real;
  Twin twin(scenario, log, diagnostics);
  const auto edge = twin.bus().attach("bench");
  std::thread mover([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(1300));  // the ramp of the torque
    fmt::print("moving\n");
    std::fflush(stdout);
    for (double sign = 1;; sign = -sign) {
      send_goal(*edge, sign);
      std::this_thread::sleep_for(std::chrono::milliseconds(1900));
    }
  });
  const std::atomic<bool> never{false};
  Runner(twin, {}).run(never);
  mover.join();
  return 0;
}

// The process that drives, from start() to kill().
class Driver {
 public:
  explicit Driver(const std::string& arm) {
    int out[2];
    if (pipe(out) != 0) throw std::runtime_error("pipe");
    process_ = fork();
    if (process_ == 0) {
      dup2(out[1], STDOUT_FILENO);
      execl("/proc/self/exe", "bench_silence", "--drive", arm.c_str(), nullptr);
      _exit(127);
    }
    close(out[1]);
    char text[16];
    is_moving_ = read(out[0], text, sizeof text) > 0;
    close(out[0]);
  }
  ~Driver() { end(); }
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;
  [[nodiscard]] bool is_moving() const { return is_moving_; }
  void end() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = 0;
  }

 private:
  pid_t process_ = 0;
  bool is_moving_ = false;
};

// -- the emulated arm's process

class EmulatedArm {
 public:
  EmulatedArm(const fs::path& folder, const std::string& plugin, const std::string& params) {
    log_.add_sink([this](const LogLine& line) {
      const std::size_t begin = line.text.find("/dev/pts/");
      if (begin != std::string::npos) port_ = line.text.substr(begin);
    });
    Scenario scenario;
    scenario.robots = {{.target = write_arm(folder / "emulated.urdf", plugin, params)}};
    scenario.hardware = HardwareUse::ports;
    twin_ = std::make_unique<Twin>(scenario, log_, diagnostics_);
    twin_->between_steps();
    if (port_.empty()) throw std::runtime_error("no port");
    thread_ = std::thread([this] { run(); });
  }
  ~EmulatedArm() {
    ends_ = true;
    thread_.join();
  }
  EmulatedArm(const EmulatedArm&) = delete;
  EmulatedArm& operator=(const EmulatedArm&) = delete;
  [[nodiscard]] const std::string& port() const { return port_; }
  std::vector<double> q() {
    const std::lock_guard lock(mutex_);
    return q_;
  }

 private:
  void run() {
    const auto begin = Clock::now();
    while (!ends_) {
      const Time now{std::chrono::duration_cast<Duration>(Clock::now() - begin)};
      while (twin_->now() < now) {
        twin_->between_steps();
        twin_->step();
      }
      {
        const std::lock_guard lock(mutex_);
        const auto q = twin_->robot().instance().q();
        q_.assign(q.begin(), q.end());
      }
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
  }

  Log log_;
  Diagnostics diagnostics_;
  std::unique_ptr<Twin> twin_;
  std::string port_;
  std::mutex mutex_;
  std::vector<double> q_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

struct Aftermath {
  double seconds = 0;   // until the last joint rests
  double distance = 0;  // rad, of the joint that moves furthest
  double speed = 0;     // rad/s, of the fastest joint when the driver was killed
};

Aftermath watch(EmulatedArm& arm, Driver& driver) {
  constexpr double kSettled = 0.003;  // rad: as near to where it ends, a joint rests
  std::vector<std::pair<double, std::vector<double>>> samples;
  const std::vector<double> before = arm.q();
  const auto measured = Clock::now();
  std::this_thread::sleep_for(std::chrono::milliseconds(10));
  driver.end();
  const auto begin = Clock::now();
  const std::vector<double> start = arm.q();
  Aftermath out;
  for (std::size_t i = 0; i < start.size(); ++i)
    out.speed = std::max(
        out.speed, std::abs(start[i] - before[i]) / std::chrono::duration<double>(begin - measured).count());
  while (Clock::now() - begin < std::chrono::milliseconds(1500)) {
    samples.emplace_back(std::chrono::duration<double>(Clock::now() - begin).count(), arm.q());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const std::vector<double>& end = samples.back().second;
  for (const auto& [seconds, q] : samples) {
    for (std::size_t i = 0; i < end.size(); ++i) {
      if (std::abs(q[i] - end[i]) > kSettled) out.seconds = seconds;
      out.distance = std::max(out.distance, std::abs(q[i] - start[i]));
    }
  }
  return out;
}

void measure(const fs::path& folder, const char* plugin, const char* watchdog, const char* params, int runs) {
  EmulatedArm arm(folder, plugin, params);
  const std::string driven = write_arm(folder / "driven.urdf", plugin,
                                       fmt::format("<param name=\"port\">{}</param>{}", arm.port(), params));
  std::mt19937 random(7);
  std::vector<double> seconds, distances;
  double fastest = 0;
  int failed = 0;
  for (int run = 0; run < runs; ++run) {
    Driver driver(driven);
    if (!driver.is_moving()) {
      ++failed;
      continue;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300 + random() % 3000));
    const Aftermath found = watch(arm, driver);
    seconds.push_back(found.seconds);
    distances.push_back(found.distance);
    fastest = std::max(fastest, found.speed);
  }
  std::ranges::sort(seconds);
  std::ranges::sort(distances);
  if (seconds.empty()) seconds = distances = {NAN};
  fmt::print(
      "{:<18} {} runs at up to {:.2f} rad/s ({} did not start), watchdog {}: at rest after median {:.3f} s, "
      "latest {:.3f} s; moved median {:.3f} rad, most {:.3f} rad\n",
      plugin, runs, fastest, failed, watchdog, seconds[seconds.size() / 2], seconds.back(),
      distances[distances.size() / 2], distances.back());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "--drive") == 0) return drive(argv[2]);
  int runs = 50;
  std::string only;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--runs") == 0) runs = std::stoi(argv[i + 1]);
    if (std::strcmp(argv[i], "--only") == 0) only = argv[i + 1];
  }
  const fs::path folder = fs::temp_directory_path() / fmt::format("bench_silence_{}", getpid());
  fs::create_directories(folder);
  fmt::print("kill -9 of the driver in motion, emulated servos\n");
  struct Case {
    const char *plugin, *watchdog, *params;
  };
  for (const Case& one : {Case{"doppel/FeetechSts", "none (goals are at most 50 ms ahead)", ""},
                          Case{"doppel/DynamixelX", "0.2 s", "<param name=\"rate\">1000000</param>"},
                          Case{"doppel/ServoLine", "0.3 s", "<param name=\"confirm_pose\">false</param>"}}) {
    if (only.empty() || only == one.plugin) measure(folder, one.plugin, one.watchdog, one.params, runs);
  }
  fs::remove_all(folder);
  return 0;
}
