#include "doppel/session/reload.h"

#include <fmt/format.h>

#include <chrono>
#include <future>

#include "doppel/core/guarded_thread.h"

namespace doppel {
namespace {

constexpr const char* kOrigin = "reload";
constexpr std::chrono::milliseconds kDebounceTime{20};  // after an editor's last stroke

std::string names_of(const std::vector<std::filesystem::path>& files) {
  std::string out;
  for (const auto& file : files) out += (out.empty() ? "" : ", ") + file.filename().string();
  return out;
}

}  // namespace

Reloadable reloadable(Twin& twin, std::function<void(const Twin::Replacement&)> before,
                      std::function<void()> afterwards) {
  const auto files_read = std::make_shared<FilesRead>();
  const auto begin = [&twin, before = std::move(before), files_read]() -> Reloadable::Build {
    return [&twin, before, files_read, running = twin.running()](Diagnostics& said) -> Reloadable::TakeOver {
      const FilesRead::Recording recording(*files_read);
      return [&twin, before, fresh = twin.prepare(running, said)] {
        before(*fresh);
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
    return [&viewer, before, files_read](Diagnostics& said) -> Reloadable::TakeOver {
      const FilesRead::Recording recording(*files_read);
      return [&viewer, before, fresh = viewer.prepare(said)] {
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

void Reloader::run() {
  while (!ending_) {
    const auto changed = watcher_.wait(kDebounceTime);
    if (changed.empty()) return;
    reload(changed);
    if (!what_.afterwards) continue;
    try {
      on_loop(what_.afterwards);
    } catch (...) {
      log_.error(kOrigin, fmt::format("after the reload: {}", thrown_text()));
    }
  }
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

bool Reloader::apply(std::string& outcome, Diagnostics& said) {
  Reloadable::Build build;
  if (!on_loop([&] { build = what_.begin(); })) return false;
  const Reloadable::TakeOver take_over = build(said);
  std::vector<std::filesystem::path> files;
  const auto take = [&] {
    outcome = take_over();
    files = what_.files();
  };
  if (!on_loop(take)) return false;
  watcher_.watch(files);
  return true;
}

void Reloader::reload(const std::vector<std::filesystem::path>& changed) {
  const auto begin = std::chrono::steady_clock::now();
  Diagnostics said;
  try {
    std::string outcome;
    if (!apply(outcome, said)) return;
    const auto took =
        std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begin);
    log_.note(kOrigin, fmt::format("{} applied in {} ms; {}", names_of(changed),
                                   (took + kDebounceTime).count(), outcome));
    for (const Diagnostic& diagnostic : said.all()) {
      if (diagnostic.severity != Severity::note) log_.warning(kOrigin, diagnostic.str());
    }
  } catch (...) {
    log_.error(kOrigin, fmt::format("{} cannot be used; the previous model keeps running\n{}",
                                    names_of(changed), thrown_text()));
    // An unknown attribute is often the cause.
    for (const Diagnostic& diagnostic : said.all()) {
      if (diagnostic.rule.starts_with("schema.")) log_.warning(kOrigin, diagnostic.str());
    }
  }
}

}  // namespace doppel
