#include "app/reload.h"

#include <fmt/format.h>

#include <chrono>
#include <future>

namespace doppel::app {
namespace {

constexpr const char* kOrigin = "reload";
constexpr std::chrono::milliseconds kQuiet{20};  // after an editor's last stroke

std::string names_of(const std::vector<std::filesystem::path>& files) {
  std::string out;
  for (const auto& file : files) out += (out.empty() ? "" : ", ") + file.filename().string();
  return out;
}

}  // namespace

Reloader::Reloader(Twin& twin, const Log& log, std::function<void()> replaced)
    : twin_(twin), log_(log), replaced_(std::move(replaced)) {
  if (!watcher_.works()) {
    log.warning(kOrigin, "the system gives no file notifications; edits are not picked up");
    return;
  }
  const auto files = twin.files();
  watched_ = files.size();
  watcher_.watch(files);
  thread_ = std::thread([this] { run(); });
}

Reloader::~Reloader() {
  ending_ = true;
  watcher_.stop();
  if (thread_.joinable()) thread_.join();
}

void Reloader::run() {
  while (!ending_) {
    const auto changed = watcher_.wait(kQuiet);
    if (changed.empty()) return;
    reload(changed);
  }
}

bool Reloader::on_loop(const std::function<void()>& task) {
  const auto done = std::make_shared<std::promise<void>>();
  auto future = done->get_future();
  twin_.bus().post([task, done] {
    task();
    done->set_value();
  });
  while (future.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
    if (ending_) return false;
  }
  return true;
}

void Reloader::reload(const std::vector<std::filesystem::path>& changed) {
  const auto begin = std::chrono::steady_clock::now();
  ControllerWish wish;
  if (!on_loop([&] { wish = twin_.present_controllers(); })) return;
  Diagnostics said;
  try {
    const auto fresh = twin_.prepare(wish, said);
    auto how = Twin::Reload::controllers_went_on;
    std::vector<std::filesystem::path> files;
    std::exception_ptr refused;
    const auto take_over = [&] {
      try {
        how = twin_.replace(fresh);
        files = twin_.files();
        replaced_();
      } catch (const InputError&) {
        refused = std::current_exception();
      }
    };
    if (!on_loop(take_over)) return;
    if (refused) std::rethrow_exception(refused);
    watcher_.watch(files);
    const auto took =
        std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begin);
    log_.note(kOrigin, fmt::format("{} applied in {} ms; {}", names_of(changed), (took + kQuiet).count(),
                                   how == Twin::Reload::controllers_went_on
                                       ? "joints and controllers went on"
                                       : "joints kept their state, controllers were made anew"));
    for (const Diagnostic& diagnostic : said.all()) {
      if (diagnostic.severity != Severity::note) log_.warning(kOrigin, diagnostic.str());
    }
  } catch (const InputError& problem) {
    log_.error(kOrigin, fmt::format("{} cannot be used; the machine from before runs on\n{}",
                                    names_of(changed), problem.what()));
    // An attribute that nobody reads is often the reason why.
    for (const Diagnostic& diagnostic : said.all()) {
      if (diagnostic.rule.starts_with("schema.")) log_.warning(kOrigin, diagnostic.str());
    }
  }
}

}  // namespace doppel::app
