#include "doppel/session/live/reload.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <future>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "doppel/base/core/file_version.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/scenario/compile/robot_setup.h"
#include "doppel/session/live/audit_result.h"
#include "doppel/session/live/detail/edited_files.h"

namespace doppel {
namespace {

constexpr const char* kOrigin = "reload";
constexpr std::chrono::milliseconds kDebounceTime{20};  // after an editor's last stroke
constexpr std::chrono::seconds kBuildDeadline{
    2};  // after it the build is reported, and a new edit replaces it
constexpr std::chrono::milliseconds kPollInterval{20};
constexpr int kMaxUnfinished = 2;  // builds at once; more would take the processors from the loop
constexpr int kMaxBuilds = 3;      // of one edit, repeated when robots were added or removed meanwhile
constexpr const char* kRobotsChanged = "reload.robots_changed";

std::string names_of(const std::vector<std::filesystem::path>& files) {
  std::set<std::string> names;  // a file may have several paths
  for (const auto& file : files) names.insert(file.filename().string());
  return fmt::format("{}", fmt::join(names, ", "));
}

// The replacement, with the misspellings of its descriptions; those of a refused edit are often its cause.
std::shared_ptr<Twin::Replacement> prepared(const std::shared_ptr<const Twin::Running>& running,
                                            Diagnostics& diagnostics) {
  try {
    auto fresh = Twin::prepare(running, diagnostics);
    for (const auto& robot : Twin::robots(*fresh)) report_misspellings(*robot, diagnostics);
    return fresh;
  } catch (const InputError&) {
    for (const ExpandedDescription& description : Twin::expand(*running))
      report_misspellings(description, diagnostics);
    throw;
  }
}

std::shared_ptr<Viewer::Replacement> prepared(const Scenario& scenario, Diagnostics& diagnostics) {
  try {
    auto fresh = Viewer::prepare(scenario, diagnostics);
    report_misspellings(Viewer::expanded(*fresh), diagnostics);
    return fresh;
  } catch (const InputError&) {
    if (const auto description = expanded_if_possible(scenario, scenario.robots.front()))
      report_misspellings(*description, diagnostics);
    throw;
  }
}

FileVersions versions_of(const std::vector<std::filesystem::path>& files) {
  FileVersions out;
  for (const std::filesystem::path& file : files) out[file] = FileVersion::of(file);
  return out;
}

// The versions that were read, of the files that the build notes; the present ones of others.
FileVersions read_versions(const std::vector<std::filesystem::path>& files, FilesRead& read) {
  FileVersions out = versions_of(files);
  for (const auto& [file, version] : read.take()) {
    if (const auto found = out.find(file); found != out.end()) found->second = version;
  }
  return out;
}

}  // namespace

Reloadable reloadable(Twin& twin, std::function<void(const Twin::Replacement&)> before,
                      std::function<void()> afterwards) {
  const auto files_read = std::make_shared<FilesRead>();
  const auto versions = std::make_shared<FileVersions>(versions_of(twin.files()));  // of the running machine
  const auto begin = [&twin, before = std::move(before), files_read, versions]() -> Reloadable::Build {
    return [&twin, before, files_read, versions, former = *versions,
            running = twin.running()](Diagnostics& diagnostics) -> Reloadable::TakeOver {
      FilesRead read;
      const FilesRead::Recording for_watcher(*files_read), recording(read);
      const auto fresh = prepared(running, diagnostics);
      const FileVersions present = read_versions(Twin::files(*fresh), read);
      return [&twin, before, versions, fresh, present, edit = to_cdr(edited_files(former, present))] {
        before(*fresh);
        twin.bus().report_input({BusInput::Kind::edit, "", "", "", edit});
        *versions = present;
        return twin.replace(fresh) == Twin::Reload::controllers_kept
                   ? "joints and controllers kept their state"
                   : "joints kept their state, controllers were recreated";
      };
    };
  };
  return {twin.bus(), [&twin] { return twin.files(); }, begin, std::move(afterwards), files_read};
}

Reloadable reloadable(Viewer& viewer, std::function<void(const Viewer::Replacement&)> before,
                      std::function<void()> afterwards) {
  const auto files_read = std::make_shared<FilesRead>();
  const auto begin = [&viewer, before = std::move(before), files_read]() -> Reloadable::Build {
    return [&viewer, before, files_read,
            scenario = viewer.scenario()](Diagnostics& diagnostics) -> Reloadable::TakeOver {
      const FilesRead::Recording recording(*files_read);
      return [&viewer, before, fresh = prepared(*scenario, diagnostics)] {
        before(*fresh);
        viewer.replace(fresh);
        return "joints keep their positions";
      };
    };
  };
  return {viewer.bus(), [&viewer] { return viewer.files(); }, begin, std::move(afterwards), files_read};
}

Reloader::Reloader(Reloadable what, const Log& log) : what_(std::move(what)), log_(log) {
  if (!watcher_.works()) {
    log.warning(kOrigin, "file notifications are not available; edits are not reloaded");
    return;
  }
  watcher_.watch_read(what_.files_read);
  watcher_.watch(what_.files());
  thread_ = guarded_thread([this] { run(); },
                           [this](const std::string& thrown) {
                             log_.error(kOrigin, fmt::format("edits are no longer reloaded: {}", thrown));
                           });
}

Reloader::~Reloader() {
  ending_ = true;
  watcher_.stop();
  if (thread_.joinable()) thread_.join();
}

struct Reloader::Attempt {
  // The build's thread keeps what it uses, because it may outlive the reloader.
  struct Work {
    Reloadable::Build build;
    Diagnostics diagnostics;
    Reloadable::TakeOver take_over;
    std::exception_ptr thrown;
  };
  std::vector<std::filesystem::path> changed;
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  std::shared_ptr<Work> work;
  int builds = 0;
  bool late = false;  // and reported
};

void Reloader::run() {
  while (!ending_) {
    const auto at_most = attempt_ ? std::optional(kPollInterval) : std::nullopt;
    auto changed = watcher_.wait(kDebounceTime, at_most);
    if (ending_ || (changed.empty() && !attempt_)) break;
    if (!changed.empty()) {
      if (attempt_) abandon_attempt();
      begin_attempt(std::move(changed));
    }
    if (!attempt_ || !finish_attempt() || !what_.afterwards) continue;
    try {
      on_loop(what_.afterwards);
    } catch (...) {
      log_.error(kOrigin, fmt::format("after the reload: {}", thrown_text()));
    }
  }
  if (attempt_) abandon_attempt();
}

bool Reloader::on_loop(const std::function<void()>& task) {
  struct LoopTask {
    // Claimed either by the loop, which then runs the task, or by the end, after which it must not run.
    std::atomic<bool> taken{false};
    std::promise<void> done;
  };
  const auto loop_task = std::make_shared<LoopTask>();
  auto future = loop_task->done.get_future();
  what_.bus.post([task, loop_task] {
    if (loop_task->taken.exchange(true)) return;
    try {
      task();
      loop_task->done.set_value();
    } catch (...) {  // rethrown on the waiting thread, not in the loop
      loop_task->done.set_exception(std::current_exception());
    }
  });
  while (future.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
    if (ending_ && !loop_task->taken.exchange(true)) return false;
  }
  future.get();
  return true;
}

void Reloader::begin_attempt(std::vector<std::filesystem::path> changed) {
  if (!attempt_) {
    attempt_ = std::make_unique<Attempt>();
    attempt_->changed = std::move(changed);
  }
  ++attempt_->builds;
  const auto work = attempt_->work = std::make_shared<Attempt::Work>();
  try {
    if (builds_.unfinished() >= kMaxUnfinished) {
      throw InputError("reload.unfinished", {},
                       fmt::format("{} earlier edits are still being read", kMaxUnfinished),
                       "restart doppel to apply this edit");
    }
    if (!on_loop([&] { work->build = what_.begin(); })) return;
    const auto build = [work] {
      try {
        work->take_over = work->build(work->diagnostics);
      } catch (...) {
        work->thrown = std::current_exception();
      }
    };
    builds_.start(build, {}, {});
  } catch (...) {
    work->thrown = std::current_exception();
  }
}

bool Reloader::finish_attempt() {
  const auto deadline = attempt_->begin + kBuildDeadline;
  while (!builds_.wait_for(kPollInterval)) {
    if (ending_) return false;
    if (std::chrono::steady_clock::now() < deadline) continue;
    if (!std::exchange(attempt_->late, true)) {
      log_.note(kOrigin,
                fmt::format("{} takes long to read; the previous model keeps running, and a new edit is read "
                            "instead of this one",
                            names_of(attempt_->changed)));
    }
    return false;
  }
  if (ending_) return false;  // the build was perhaps not begun
  try {
    if (attempt_->work->thrown) std::rethrow_exception(attempt_->work->thrown);
    take_over();
  } catch (const InputError& refused) {
    const bool rebuild = attempt_->builds < kMaxBuilds && !ending_ &&
                         std::ranges::any_of(refused.diagnostics(), [](const Diagnostic& d) {
                           return d.rule == kRobotsChanged || d.rule == kEditedMeanwhile;
                         });
    if (rebuild) {
      begin_attempt({});
      return finish_attempt();
    }
    report_refusal();
  } catch (...) {
    report_refusal();
  }
  attempt_.reset();
  return !ending_;
}

// The result of the build is dropped.
void Reloader::abandon_attempt() {
  builds_.abandon();
  attempt_.reset();
}

// Throws InputError.
void Reloader::take_over() {
  const Attempt& attempt = *attempt_;
  std::string outcome;
  std::vector<std::filesystem::path> files;
  const auto take = [&] {
    outcome = attempt.work->take_over();
    files = what_.files();
  };
  if (!on_loop(take)) return;
  watcher_.watch(files);
  const auto took =
      std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - attempt.begin);
  log_.note(kOrigin, fmt::format("{} applied in {} ms; {}", names_of(attempt.changed),
                                 (took + kDebounceTime).count(), outcome));
  for (const Diagnostic& diagnostic : condensed(attempt.work->diagnostics, kFewOfRule)) {
    if (diagnostic.severity != Severity::note) log_.warning(kOrigin, diagnostic.str());
  }
}

// Called in a catch clause.
void Reloader::report_refusal() {
  log_.error(kOrigin, fmt::format("{} cannot be used; the previous model keeps running\n{}",
                                  names_of(attempt_->changed), thrown_text()));
  // An unknown attribute is often the cause.
  for (const Diagnostic& diagnostic : attempt_->work->diagnostics.all()) {
    if (diagnostic.rule.starts_with("schema.")) log_.warning(kOrigin, diagnostic.str());
  }
}

}  // namespace doppel
