#include "app/launched_programs.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <system_error>
#include <utility>

#include "app/process.h"
#include "doppel/base/core/child_process.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/log.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr const char* kOrigin = "launch";
constexpr int kPollMs = 50;
constexpr std::size_t kMaxLine = 4096;  // of output; a longer one is divided

}  // namespace

struct LaunchedPrograms::Running {
  LaunchedProgram program;
  ChildProcess child;
  std::string line = {};
  bool output_open = true;
  bool has_ended = false;  // what it has left of its group may run

  Running(LaunchedProgram started, const ChildStart& start) : program(std::move(started)), child(start) {}

  // At most what a pipe holds: a process that the program has left may write without end.
  void take_rest(const Log& log) {
    constexpr int kParts = 16;
    pollfd output{child.output(), POLLIN, 0};
    for (int i = 0; i < kParts && output_open && poll(&output, 1, 0) > 0; ++i) take(log);
  }

  void take(const Log& log) {
    std::array<char, 4096> part{};
    const ssize_t size = read(child.output(), part.data(), part.size());
    if (size <= 0) {
      output_open = false;
      if (!line.empty()) log.note(program.label, std::exchange(line, {}));
      return;
    }
    line.append(part.data(), static_cast<std::size_t>(size));
    for (std::size_t end = 0; (end = line.find('\n')) != std::string::npos || line.size() > kMaxLine;) {
      const std::size_t length = std::min(end, kMaxLine);
      if (length > 0) log.note(program.label, line.substr(0, length));
      line.erase(0, length + (end == length ? 1 : 0));
    }
  }
};

LaunchedPrograms::LaunchedPrograms(std::vector<LaunchedProgram> programs) : programs_(std::move(programs)) {}

LaunchedPrograms::~LaunchedPrograms() {
  end();
}

void LaunchedPrograms::begin(const StartedRun& run) {
  if (programs_.empty() || thread_.joinable()) return;
  // Processes that outlive their program become children of this process, which reaps them. The first process
  // of a container may never do so.
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  thread_ = guarded_thread([this, run] { this->run(run); },
                           [&log = run.log](const std::string& what) { log.error(kOrigin, what); });
}

void LaunchedPrograms::end() {
  ends_ = true;
  if (thread_.joinable()) thread_.join();
}

void LaunchedPrograms::run(const StartedRun& run) {
  start_all_after(0, run);
  while (!ends_) {
    pass_output(run.log);
    notice_ends(run);
  }
  stop_all(run.log);
}

void LaunchedPrograms::start_all_after(int record, const StartedRun& run) {
  for (const LaunchedProgram& program : programs_) {
    if (program.after == record) start(program, run);
  }
}

void LaunchedPrograms::start(const LaunchedProgram& program, const StartedRun& run) {
  ChildStart start{.words = program.words,
                   .folder = program.folder,
                   .environment = program.environment,
                   .output_piped = true};
  // A verb of doppel for this twin, from a command that the launch file gives to ros2.
  if (start.words.front() == "doppel") start.words.front() = "/proc/self/exe";
  start.environment.emplace_back("DOPPEL_PORT", std::to_string(run.port));
  start.environment.emplace_back("PYTHONUNBUFFERED", "1");
  try {
    running_.push_back(std::make_unique<Running>(program, start));
  } catch (const std::system_error& error) {
    run.log.error(kOrigin, fmt::format("'{}' cannot be started: {}", program.label, error.code().message()));
  }
}

void LaunchedPrograms::pass_output(const Log& log) {
  std::vector<pollfd> files;
  std::vector<Running*> owners;
  for (const auto& one : running_) {
    if (!one->output_open) continue;
    files.push_back({one->child.output(), POLLIN, 0});
    owners.push_back(one.get());
  }
  if (poll(files.data(), files.size(), kPollMs) <= 0) return;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (files[i].revents != 0) owners[i]->take(log);
  }
}

void LaunchedPrograms::notice_ends(const StartedRun& run) {
  std::vector<LaunchedProgram> ended;
  for (const auto& one : running_) {
    const std::optional<int> code = one->child.ended();
    if (!code || std::exchange(one->has_ended, true)) continue;
    one->take_rest(run.log);
    if (*code == 0) {
      run.log.note(kOrigin, fmt::format("'{}' has ended", one->program.label));
    } else {
      run.log.warning(kOrigin, fmt::format("'{}' has ended with exit code {}", one->program.label, *code));
    }
    ended.push_back(one->program);
  }
  std::erase_if(running_, [](const auto& one) { return !one->output_open && one->child.group_ended(); });
  for (const LaunchedProgram& program : ended) {
    start_all_after(program.record, run);
    if (!program.required) continue;
    run.log.note(kOrigin, fmt::format("the launch ends with '{}', as its file says", program.label));
    request_stop();
  }
}

void LaunchedPrograms::stop_all(const Log& log) {
  struct Step {
    int signal;
    std::chrono::seconds limit;
  };
  constexpr std::array kSteps = {Step{SIGINT, std::chrono::seconds(5)},
                                 Step{SIGTERM, std::chrono::seconds(2)}};
  for (const auto& [signal, limit] : kSteps) {
    for (const auto& one : running_) one->child.signal(signal);
    const auto end = Clock::now() + limit;
    while (!running_.empty() && Clock::now() < end) {
      pass_output(log);
      std::erase_if(running_, [&log](const auto& one) {
        if (!one->child.group_ended()) return false;
        one->take_rest(log);
        return true;
      });
    }
  }
  for (const auto& one : running_)
    log.warning(kOrigin, fmt::format("'{}' does not end; it is killed", one->program.label));
  running_.clear();
}

}  // namespace doppel::app
