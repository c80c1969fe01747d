#include <algorithm>
#include <array>

#include "app/verbs/goals.h"
#include "app/verbs/message_echo.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kCancelTimeout = std::chrono::seconds(5);

struct ActionOptions {
  std::string name, type, yaml;
  bool types = false, feedback = false;
};

int list_actions(Shell& shell, const ActionOptions& options) {
  Client& twin = shell.twin();
  for (const std::string& name : action_list(twin)) {
    print_line("{}",
               options.types ? fmt::format("{} [{}]\n", name, find_action_type(twin, name)) : name + "\n");
  }
  return 0;
}

int show_action(Shell& shell, const ActionOptions& options) {
  Client& twin = shell.twin();
  const std::string name = absolute(options.name);
  const std::string type = find_action_type(twin, name);
  const Client::Service& service = twin.services().at(name + "/_action/send_goal");
  print_line("Action: {}\nType: {}\nAction clients: {}\n", name, type, service.clients.size());
  for (const std::string& client : service.clients) print_line("    {}\n", client);
  print_line("Action servers: {}\n", service.providers.size());
  for (const std::string& server : service.providers) print_line("    {}\n", server);
  return 0;
}

std::string indented(const std::string& yaml) {
  std::string out = "    ";
  for (std::size_t i = 0; i < yaml.size(); ++i) {
    out += yaml[i];
    if (yaml[i] == '\n' && i + 1 < yaml.size()) out += "    ";
  }
  return out;
}

// Waits for the goal's end, printing feedback on the way.
GoalOutcome follow(Client& twin, ActionGoal& goal, bool feedback, Clock::time_point until) {
  GoalOutcome outcome;
  while (true) {
    Client::Received message;
    bool done = false;
    static_cast<void>(twin.wait_until(
        [&] {
          return (done = done || goal.take_outcome(outcome)) ||
                 (feedback && twin.next(message, Clock::now()));
        },
        until));
    if (!message.cdr.empty()) {
      const std::string text = goal.feedback_yaml(message);
      if (!text.empty()) print_line("Feedback:\n{}\n", indented(text));
    }
    if (done) return outcome;
    if (Clock::now() >= until) throw ClientError("the goal does not finish");
  }
}

// The interfaces of an action by the names of `ros2 action echo`.
struct ActionInterface {
  const char* name;
  const char* topic;  // below the action
  bool is_event;
};
constexpr std::array kInterfaces = {
    ActionInterface{"GOAL_SERVICE", "/_action/send_goal/_service_event", true},
    ActionInterface{"CANCEL_SERVICE", "/_action/cancel_goal/_service_event", true},
    ActionInterface{"RESULT_SERVICE", "/_action/get_result/_service_event", true},
    ActionInterface{"FEEDBACK_TOPIC", "/_action/feedback", false},
    ActionInterface{"STATUS_TOPIC", "/_action/status", false}};

struct ActionEchoOptions {
  std::string name, type, interfaces;
  EchoAllOptions echo;
};

// "GOAL_SERVICE|FEEDBACK_TOPIC" in any case; all of them without the option.
std::vector<std::string> chosen_interfaces(const std::string& text) {
  std::vector<std::string> names, chosen;
  for (const ActionInterface& interface : kInterfaces) names.emplace_back(interface.name);
  if (text.empty()) return names;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('|', begin), text.size());
    std::string name = text.substr(begin, end - begin);
    name.erase(0, name.find_first_not_of(' '));
    name.erase(name.find_last_not_of(' ') + 1);
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::toupper(c); });
    if (std::ranges::find(names, name) == names.end()) {
      throw_usage_error(
          fmt::format("'{}' is not an interface of an action{}", name, did_you_mean(name, names)),
          fmt::format("choose from {}", fmt::join(names, "|")));
    }
    chosen.push_back(std::move(name));
    begin = end + 1;
  }
  return chosen;
}

int echo_action(Shell& shell, const ActionEchoOptions& options) {
  const std::vector<std::string> chosen = chosen_interfaces(options.interfaces);
  const std::string name = absolute(options.name);
  const std::string type = find_action_type(shell.twin(), name);
  if (!options.type.empty() && options.type != type)
    throw_usage_error(fmt::format("{} has type {}, not {}", name, type, options.type));
  std::vector<EchoSource> sources;
  for (const ActionInterface& interface : kInterfaces) {
    if (std::ranges::find(chosen, interface.name) != chosen.end())
      sources.push_back({name + interface.topic, interface.name, interface.is_event});
  }
  return echo_all(shell, sources, options.echo);
}

int report_goal(const GoalOutcome& outcome) {
  print_line("Result:\n{}\nGoal finished with status: {}\n", indented(outcome.result_yaml),
             status_name(outcome.status));
  return outcome.status == kSucceeded ? 0 : 1;
}

int send_goal(Shell& shell, const ActionOptions& options) {
  const ActionSupport* type = find_action(options.type);
  if (type == nullptr) {
    throw_unknown_type(options.type, "action type", action_names());
  }
  const Bytes goal_cdr = to_request(*type->goal, options.yaml);
  const std::string name = absolute(options.name);
  Client& twin = shell.twin();
  if (const std::string offered = find_action_type(twin, name); offered != type->name) {
    throw_usage_error(fmt::format("{} has type {}, not {}", name, offered, type->name));
  }
  Shell::catch_interrupts();
  if (options.feedback) {
    const std::string topic = name + "/_action/feedback";
    if (twin.topics().contains(topic)) twin.subscribe(topic);
  }
  ActionGoal goal(twin, name, *type, goal_cdr);
  print_line("Goal accepted with ID: {}\n\n", to_string(goal.id()));
  try {
    return report_goal(follow(twin, goal, options.feedback, Clock::now() + kForever));
  } catch (const Interrupted&) {
    Shell::clear_interrupt();
    print_note("Canceling goal...");
    goal.cancel();
    return report_goal(follow(twin, goal, false, Clock::now() + kCancelTimeout));
  }
}

}  // namespace

void add_action(CLI::App& app, int& exit_code) {
  CLI::App& group =
      add_group(app, "action", "Send goals to actions",
                "doppel action list -t\n  doppel action info /omarm_arm_controller/follow_joint_trajectory");
  add_verb<ActionOptions>(
      group, "list", "List actions", "doppel action list -t", exit_code,
      [](CLI::App& verb, ActionOptions& options) {
        verb.add_flag("-t,--show-types", options.types, "Show their types");
      },
      list_actions);
  add_verb<ActionOptions>(
      group, "info", "Print the servers and clients of an action",
      "doppel action info /omarm_arm_controller/follow_joint_trajectory", exit_code,
      [](CLI::App& verb, ActionOptions& options) {
        verb.add_option("action", options.name, "Action name")->required();
        verb.add_flag("-t,--show-types", options.types, "Accepted as in ROS 2; the type is always shown");
      },
      show_action);
  add_verb<ActionEchoOptions>(
      group, "echo",
      "Print the goals, cancellations, results, feedback and status of an action as they come; those of "
      "services if its node publishes their events",
      "doppel action echo /omarm_arm_controller/follow_joint_trajectory -i 'FEEDBACK_TOPIC|STATUS_TOPIC'\n"
      "  doppel param set /gazebo service_introspection contents\n"
      "  doppel action echo /omarm_arm_controller/follow_joint_trajectory",
      exit_code,
      [](CLI::App& verb, ActionEchoOptions& options) {
        verb.add_option("action", options.name, "Action name")->required();
        verb.add_option("type", options.type, "Action type (optional)");
        verb.add_option("-i,--interfaces", options.interfaces,
                        "Print only these, separated by |: GOAL_SERVICE, CANCEL_SERVICE, RESULT_SERVICE, "
                        "FEEDBACK_TOPIC, STATUS_TOPIC");
        add_echo_options(verb, options.echo);
      },
      echo_action);
  add_verb<ActionOptions>(
      group, "send_goal", "Send a goal and wait for its result; Ctrl-C cancels it",
      R"(doppel action send_goal --feedback /omarm_arm_controller/follow_joint_trajectory \
    control_msgs/action/FollowJointTrajectory \
    '{trajectory: {joint_names: ["Revolute 1"], points: [{positions: [1.2], time_from_start: {sec: 3}}]}}')",
      exit_code,
      [](CLI::App& verb, ActionOptions& options) {
        verb.add_option("action", options.name, "Action name")->required();
        verb.add_option("type", options.type, "Action type")->required();
        verb.add_option("goal", options.yaml, "Goal as YAML")->required();
        verb.add_flag("-f,--feedback", options.feedback, "Print feedback messages");
      },
      send_goal);
}

}  // namespace doppel::app
