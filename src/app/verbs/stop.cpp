// The emergency stop from the shell: of every controller manager of every twin of this user, independent of
// the source of commands.

#include <algorithm>
#include <future>

#include "app/verbs/controllers.h"
#include "app/verbs/verbs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/server/announcement.h"

namespace doppel::app {
namespace {

struct StopOptions {
  std::string manager;
  bool reset = false, all = false;
};

// The outcome in one twin.
struct Stopped {
  std::vector<std::string> lines, problems;
};

Stopped call_managers(Client& twin, const StopOptions& options) {
  Stopped done;
  const std::vector<std::string> managers =
      options.manager.empty() ? find_managers(twin) : std::vector{absolute(options.manager)};
  for (const std::string& manager : managers) {
    // One that does not respond must not prevent the stop of the others.
    try {
      const char* service = options.reset ? "reset_emergency_stop" : "emergency_stop";
      const auto response = call<std_srvs::srv::Trigger>(twin, fmt::format("{}/{}", manager, service));
      (response.success ? done.lines : done.problems)
          .push_back(fmt::format("{}: {}", manager, response.message));
    } catch (const ClientError& problem) {
      done.problems.push_back(fmt::format("{}: {}", manager, problem.what()));
    }
  }
  return done;
}

int print(const Stopped& done, const std::string& prefix) {
  for (const std::string& line : done.lines) print_line("{}{}\n", prefix, line);
  for (const std::string& problem : done.problems) print_note(prefix + problem);
  return done.problems.empty() ? 0 : 1;
}

// Each twin on its own thread, so that one that does not respond delays no other.
std::vector<Stopped> in_each(const std::vector<RunningTwin>& twins,
                             const std::function<Stopped(Client&)>& run) {
  std::vector<std::future<Stopped>> pending;
  for (const RunningTwin& twin : twins) {
    pending.push_back(std::async(std::launch::async, [&run, &twin]() -> Stopped {
      try {
        return run(*Shell::connect(twin));
      } catch (const std::exception& problem) {
        return {{}, {problem.what()}};
      }
    }));
  }
  std::vector<Stopped> done;
  done.reserve(pending.size());
  for (std::future<Stopped>& one : pending) done.push_back(one.get());
  return done;
}

// A stop is reset where it was set: several are not reset by one command that names none of them. Twins that
// do not respond are printed, and `unknown` is set.
std::vector<RunningTwin> to_reset(const std::vector<RunningTwin>& twins, bool all, bool& unknown) {
  const std::vector<Stopped> states = in_each(twins, [](Client& twin) {
    Stopped state;
    for (const std::string& manager : find_managers(twin)) {
      if (is_stopped(twin, manager)) state.lines.push_back(manager);
    }
    return state;
  });
  std::vector<RunningTwin> stopped;
  std::string names;
  for (std::size_t i = 0; i < twins.size(); ++i) {
    for (const std::string& problem : states[i].problems) print_note(twins[i].label() + ": " + problem);
    unknown = unknown || !states[i].problems.empty();
    if (states[i].lines.empty()) continue;
    stopped.push_back(twins[i]);
    names += (names.empty() ? "" : ", ") + twins[i].label();
  }
  if (stopped.size() > 1 && !all) {
    throw_usage_error(
        fmt::format("the emergency stop is on in {} twins: {}", stopped.size(), names),
        fmt::format("reset one of them: doppel stop --reset --port {}; or all of them: doppel stop "
                    "--reset --all",
                    stopped.front().port));
  }
  return stopped;
}

int stop(Shell& shell, const StopOptions& options) {
  std::vector<RunningTwin> twins = shell.unselected_twins();
  if (twins.size() > 1) {
    bool unknown = false;
    if (options.reset) twins = to_reset(twins, options.all, unknown);
    if (twins.empty()) {
      print_line("The emergency stop is not active in any twin{}.\n", unknown ? " that responds" : "");
      return unknown ? 1 : 0;
    }
    int exit_code = unknown ? 1 : 0;
    const std::vector<Stopped> done =
        in_each(twins, [&](Client& twin) { return call_managers(twin, options); });
    bool has_manager = false;
    for (std::size_t i = 0; i < twins.size(); ++i) {
      has_manager = has_manager || !done[i].lines.empty() || !done[i].problems.empty();
      if (done[i].lines.empty() && done[i].problems.empty())
        print_note(twins[i].label() + ": no controller manager, nothing to stop");
      exit_code = std::max(exit_code, print(done[i], twins[i].label() + ": "));
    }
    if (!has_manager) throw ClientError("there is no controller manager to stop");
    return exit_code;
  }
  const Stopped done = call_managers(shell.twin(), options);
  if (done.lines.empty() && done.problems.empty())
    throw ClientError("there is no controller manager to stop");
  return print(done, "");
}

}  // namespace

void add_stop(CLI::App& app, int& exit_code) {
  add_verb<StopOptions>(
      app, "stop", "Emergency stop of all running twins: stop all motion until `stop --reset`",
      "doppel stop              # every twin of this user\n  doppel stop --port 8701  # only this one\n  "
      "doppel "
      "stop --reset      # previously active controllers are activated again, without their goals",
      exit_code,
      [](CLI::App& verb, StopOptions& options) {
        CLI::Option* const reset = verb.add_flag("--reset", options.reset, "Reset the emergency stop");
        verb.add_flag("--all", options.all, "With --reset: in all twins, if more than one is stopped")
            ->needs(reset);
        verb.add_option("-c,--controller-manager", options.manager,
                        "Only this controller manager (default: all)");
      },
      stop);
}

}  // namespace doppel::app
