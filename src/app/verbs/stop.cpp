// The emergency stop from the shell: of every controller manager, independent of the source of commands.

#include "app/verbs/controllers.h"
#include "app/verbs/verbs.h"
#include "doppel/messages/std_srvs.h"

namespace doppel::app {
namespace {

struct StopOptions {
  std::string manager;
  bool reset = false;
};

int stop(Shell& shell, const StopOptions& options) {
  Client& twin = shell.twin();
  const std::vector<std::string> managers =
      options.manager.empty() ? find_managers(twin) : std::vector{absolute(options.manager)};
  if (managers.empty()) throw ClientError("there is no controller manager to stop");
  int exit_code = 0;
  for (const std::string& manager : managers) {
    // One that does not respond must not prevent the stop of the others.
    try {
      const char* service = options.reset ? "reset_emergency_stop" : "emergency_stop";
      const auto response = call<std_srvs::srv::Trigger>(twin, fmt::format("{}/{}", manager, service));
      print_line("{}: {}\n", manager, response.message);
      if (!response.success) exit_code = 1;
    } catch (const ClientError& problem) {
      print_note(fmt::format("{}: {}", manager, problem.what()));
      exit_code = 1;
    }
  }
  return exit_code;
}

}  // namespace

void add_stop(CLI::App& app, int& exit_code) {
  add_verb<StopOptions>(
      app, "stop", "Emergency stop: stop all motion until `stop --reset`",
      "doppel stop\n  doppel stop --reset      # previously active controllers are activated again, without "
      "their goals",
      exit_code,
      [](CLI::App& verb, StopOptions& options) {
        verb.add_flag("--reset", options.reset, "Reset the emergency stop");
        verb.add_option("-c,--controller-manager", options.manager,
                        "Only this controller manager (default: all)");
      },
      stop);
}

}  // namespace doppel::app
