// doppel save, restore and rewind: states of a running twin, with its controllers.
#include <algorithm>
#include <charconv>

#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/ros/messages/doppel_msgs.h"

namespace doppel::app {
namespace {

struct SaveVerb {
  std::string name;
  bool strict = false, list = false, remove = false;
};

struct RestoreVerb {
  std::string name;
};

struct RewindVerb {
  std::string span = "1s";
};

// "5s", "500ms" or "5", in s.
double parse_span(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  if (error == std::errc() && value >= 0 && (unit.empty() || unit == "s")) return value;
  if (error == std::errc() && value >= 0 && unit == "ms") return value / 1000;
  throw_usage_error(fmt::format("'{}' is no span of time", text), "write seconds: 5s, or 500ms");
}

template <Service S>
int call_for_state(Client& twin, const std::string& service, const typename S::Request& request) {
  const auto answer = call<S>(twin, service, request);
  if (!answer.success) throw ClientError(answer.message);
  print_line("{}\n", answer.message);
  return 0;
}

int list_states(Client& twin) {
  const auto states = call<doppel_msgs::srv::ListStates>(twin, "/doppel/list_states");
  for (std::size_t i = 0; i < std::min(states.names.size(), states.sim_times.size()); ++i)
    print_line("{:<24} t = {:.3f} s\n", states.names[i], states.sim_times[i]);
  if (states.names.empty()) print_note("there are no saved states; doppel save NAME makes one");
  if (!states.automatic.empty())
    print_note(fmt::format("doppel rewind can go back to t = {:.3f} s", states.automatic.front()));
  return 0;
}

int save(Shell& shell, const SaveVerb& options) {
  if (options.list) return list_states(shell.twin());
  if (options.name.empty()) throw_usage_error("a saved state needs a name", "write doppel save NAME");
  if (options.remove)
    return call_for_state<doppel_msgs::srv::DeleteState>(shell.twin(), "/doppel/delete_state",
                                                         {options.name});
  return call_for_state<doppel_msgs::srv::SaveState>(shell.twin(), "/doppel/save_state",
                                                     {options.name, options.strict});
}

}  // namespace

void add_saved_states(CLI::App& app, int& exit_code) {
  add_verb<SaveVerb>(
      app, "save", "Save the state of a running twin, with its controllers, under a name",
      "doppel save before_grasp\n  doppel save --list\n  doppel save --delete before_grasp", exit_code,
      [](CLI::App& verb, SaveVerb& options) {
        verb.add_option("name", options.name, "Name of the state; one of this name is replaced");
        auto* const list = verb.add_flag("--list", options.list, "List the saved states");
        verb.add_flag("--delete", options.remove, "Delete the state")->excludes(list);
        verb.add_flag("--strict", options.strict,
                      "Refuse if a controller cannot be saved, instead of reactivating it at a restore")
            ->excludes(list);
      },
      save);
  add_verb<RestoreVerb>(
      app, "restore", "Bring a running twin back to a saved state", "doppel restore before_grasp", exit_code,
      [](CLI::App& verb, RestoreVerb& options) {
        verb.add_option("name", options.name, "Name of the state ('doppel save --list')")->required();
      },
      [](Shell& shell, const RestoreVerb& options) {
        return call_for_state<doppel_msgs::srv::RestoreState>(shell.twin(), "/doppel/restore_state",
                                                              {options.name});
      });
  add_verb<RewindVerb>(
      app, "rewind", "Bring a running twin back by some seconds of simulated time", "doppel rewind 5s",
      exit_code,
      [](CLI::App& verb, RewindVerb& options) {
        verb.add_option(
                "span", options.span,
                "At least so far back: 5s, 500ms; the state of the last half second before is restored")
            ->capture_default_str();
      },
      [](Shell& shell, const RewindVerb& options) {
        return call_for_state<doppel_msgs::srv::Rewind>(shell.twin(), "/doppel/rewind",
                                                        {parse_span(options.span)});
      });
}

}  // namespace doppel::app
