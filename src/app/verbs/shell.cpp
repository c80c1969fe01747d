#include "app/verbs/shell.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <system_error>

#include "app/number_checks.h"
#include "app/print_stderr.h"
#include "app/synonyms.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/near_names.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/client/graph_client.h"
#include "doppel/ros/client/websocket_client.h"
#include "doppel/ros/network/environment.h"
#include "doppel/ros/server/announcement.h"

namespace doppel::app {
namespace {

constexpr int kInterruptedExit = 130;  // 128 + SIGINT, as shells count

std::atomic<bool> interrupt_caught = false;
std::string chosen_namespace;  // of the one verb that runs: "/left"

std::uint16_t parse_port(const char* text) {
  const std::string_view view(text);
  std::uint16_t port = 0;
  const auto [end, problem] = std::from_chars(view.data(), view.data() + view.size(), port);
  if (problem != std::errc() || end != view.data() + view.size() || port == 0) {
    throw_usage_error(fmt::format("DOPPEL_PORT is '{}', which is not a port number", text),
                      "unset it, or set a number from 1 to 65535");
  }
  return port;
}

// If the twin is announced, also its token if it requires one.
RunningTwin twin_at(std::uint16_t port) {
  for (const RunningTwin& twin : find_running()) {
    if (twin.port == port) return twin;
  }
  RunningTwin unannounced;
  unannounced.port = port;
  return unannounced;
}

// Without emulated arms, which are commanded by their drivers.
std::vector<RunningTwin> find_twins() {
  std::vector<RunningTwin> twins = find_running();
  std::erase_if(twins, &RunningTwin::emulated);
  return twins;
}

[[noreturn]] void refuse_without_twin() {
  const std::vector<RunningTwin> emulated = find_running();
  if (!emulated.empty())
    throw ClientError(
        fmt::format("no twin is running, only the arm behind a port: {}; start its driver (doppel up TARGET "
                    "use_sim:=false), or select the emulation itself with --port {}",
                    emulated.front().label(), emulated.front().port));
  throw ClientError(
      "no twin is running; start one with: doppel up omarm_one, or connect to a ROS 2 graph with --remote");
}

RunningTwin choose_twin(int port) {
  if (port != 0) return twin_at(static_cast<std::uint16_t>(port));
  if (const char* chosen = std::getenv("DOPPEL_PORT"); chosen != nullptr && *chosen != '\0')
    return twin_at(parse_port(chosen));
  const std::vector<RunningTwin> twins = find_twins();
  if (twins.empty()) refuse_without_twin();
  if (twins.size() > 1) {
    std::string others;
    for (const RunningTwin& twin : twins) others += fmt::format(" {} (--port {})", twin.robot, twin.port);
    print_note(fmt::format("note: {} twins are running:{}; using the newest", twins.size(), others));
  }
  return twins.front();
}

void print_warning(const std::string& text) {
  print_note("warning: " + text);
}

std::unique_ptr<Client> join_graph(const Connection& connection) {
  ros2::GraphClientOptions options;
  Diagnostics diagnostics;
  options.network = ros2::from_environment([](const char* name) { return std::getenv(name); }, diagnostics);
  for (const Diagnostic& diagnostic : diagnostics.all()) print_note(diagnostic.str());
  if (connection.spin_time > 0)
    options.spin_time = std::chrono::milliseconds(std::llround(connection.spin_time * 1000));
  options.interrupted = Shell::interrupted;
  options.on_status = print_warning;
  return std::make_unique<ros2::GraphClient>(std::move(options));
}

// --remote is an option of the verb, or stands before it.
bool asks_for_graph(const CLI::App* app) {
  for (; app != nullptr; app = app->get_parent()) {
    const CLI::Option* remote = app->get_option_no_throw("--remote");
    if (remote != nullptr && remote->count() > 0) return true;
  }
  return false;
}

// --ns is an option of the verb, or stands before it.
std::string asked_namespace(const CLI::App* app) {
  for (; app != nullptr; app = app->get_parent()) {
    const CLI::Option* const ns = app->get_option_no_throw("--ns");
    if (ns != nullptr && ns->count() > 0) return ns->as<std::string>();
  }
  return "";
}

std::string checked_namespace(std::string asked) {
  if (asked.empty()) return asked;
  if (!asked.starts_with('/')) asked.insert(0, 1, '/');
  if (const Status fine = check_namespace(asked); !fine)
    throw_usage_error(fmt::format("--ns: {}", fine.why()), "give a robot's namespace, for example --ns left");
  return asked;
}

bool is_remote_by_default() {
  const char* value = std::getenv("DOPPEL_REMOTE");
  const std::string_view text = value == nullptr ? "" : value;
  if (!text.empty() && text != "0" && text != "1")
    throw_usage_error(fmt::format("DOPPEL_REMOTE is '{}'", text), "set it to 1 or 0, or unset it");
  return text == "1";
}

}  // namespace

void print_out(std::string_view text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0) return;
  const int reason = errno;
  if (reason != EPIPE) throw std::system_error(reason, std::generic_category(), "stdout");
  std::clearerr(stdout);  // a reader that closes early is not a failure
  throw OutputClosed();
}

void print_note(std::string_view text) {
  print_stderr("{}\n", text);
}

void throw_usage_error(std::string message, std::string fix) {
  throw InputError("cli.use", {}, std::move(message), std::move(fix));
}

Client& Shell::twin() {
  if (client_ == nullptr)
    client_ = connection_.remote ? join_graph(connection_) : connect(choose_twin(connection_.port));
  return *client_;
}

std::unique_ptr<Client> Shell::connect(const RunningTwin& twin) {
  ClientOptions options;
  options.host = twin.address;
  options.port = twin.port;
  options.token = twin.token;
  options.interrupted = Shell::interrupted;
  options.on_status = print_warning;
  return std::make_unique<WebSocketClient>(std::move(options));
}

std::vector<RunningTwin> Shell::unselected_twins() const {
  const char* chosen = std::getenv("DOPPEL_PORT");
  const bool is_selected =
      connection_.remote || connection_.port != 0 || (chosen != nullptr && *chosen != '\0');
  return is_selected ? std::vector<RunningTwin>{} : find_twins();
}

std::string Shell::page_url() const {
  if (connection_.remote) throw_usage_error("the page is that of a twin, and --remote selects a ROS 2 graph");
  const RunningTwin chosen = choose_twin(connection_.port);
  return fmt::format("http://{}:{}/{}", chosen.address, chosen.port,
                     chosen.token.empty() ? "" : fmt::format("?token={}", chosen.token));
}

void Shell::catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupt_caught = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool Shell::interrupted() {
  return interrupt_caught;
}
void Shell::clear_interrupt() {
  interrupt_caught = false;
}

void add_connection_options(CLI::App& verb, Connection& connection) {
  verb.add_option("--port", connection.port,
                  "Port of the twin (default: DOPPEL_PORT, or the newest running twin)")
      ->check(CLI::Range(1, 65535));
  verb.add_flag("--remote", connection.remote,
                "Connect to the ROS 2 graph of ROS_DOMAIN_ID instead of a twin (DOPPEL_REMOTE=1)");
  verb.add_option("--spin-time", connection.spin_time,
                  "With --remote: seconds to wait for discovery (default: until no participant is new)")
      ->check(positive_number());
  if (verb.get_option_no_throw("--ns") == nullptr) {
    verb.add_option("--ns", connection.name_space,
                    "Namespace of the robot; relative names are resolved in it");
  }
}

int run_verb(const CLI::App& verb, Connection connection, const std::function<int(Shell&)>& run) {
  connection.remote = asks_for_graph(&verb);
  chosen_namespace = checked_namespace(asked_namespace(&verb));
  if (connection.remote && connection.port != 0)
    throw_usage_error("--port selects a twin, --remote the ROS 2 graph", "use only one of them");
  if (connection.port == 0) connection.remote = connection.remote || is_remote_by_default();
  if (connection.spin_time > 0 && !connection.remote)
    throw_usage_error("--spin-time applies only to the ROS 2 graph",
                      "a twin needs no discovery; add --remote, or omit the option");
  Shell shell(connection);
  try {
    return run(shell);
  } catch (const Interrupted&) {
    return kInterruptedExit;
  } catch (const OutputClosed&) {
    return 0;
  }
}

CLI::App& add_group(CLI::App& app, const std::string& name, const std::string& help,
                    const std::string& examples) {
  CLI::App* group = app.add_subcommand(name, help);
  group->footer("Examples:\n  " + examples);
  group->require_subcommand(1);
  return *group;
}

const std::string& robot_namespace() {
  return chosen_namespace;
}

std::string absolute(std::string_view name) {
  return name.starts_with('/') ? std::string(name) : fmt::format("{}/{}", chosen_namespace, name);
}

bool is_hidden(std::string_view name) {
  return name.find("/_") != std::string_view::npos;
}

const TypeSupport& known_type(const std::string& name) {
  if (const TypeSupport* type = find_type(name)) return *type;
  throw_unknown_type(name, "message type", type_names());
}

void throw_unknown_type(const std::string& name, const char* kind, const std::vector<std::string>& names) {
  if (const std::string replacement = replacement_of_ros1_type(name); !replacement.empty()) {
    throw_usage_error(fmt::format("'{}' is a type of ROS 1", name), replacement);
  }
  throw_usage_error(fmt::format("'{}' is not a known {}{}", name, kind, names_near(name, names)),
                    "'doppel interface list' prints all of them");
}

std::vector<std::string> node_names(Client& twin, bool hidden) {
  std::vector<std::string> names = twin.nodes();
  if (!hidden) std::erase_if(names, is_hidden);
  return names;
}

std::string find_node_name(Client& twin, const std::string& name) {
  const std::string full = absolute(name);
  const std::vector<std::string> names = node_names(twin, true);
  if (std::ranges::find(names, full) != names.end()) return full;
  throw ClientError(fmt::format("there is no node {}{}", full, did_you_mean(full, names)));
}

Bytes to_request(const TypeSupport& type, std::string_view yaml) {
  Bytes cdr;
  if (const Status status = type.yaml_to_cdr(yaml, cdr); !status) {
    throw_usage_error(fmt::format("the text is not a valid {}: {}", type.name, status.why()),
                      fmt::format("'doppel interface show {}' lists its fields", type.name));
  }
  return cdr;
}

Bytes call_raw(Client& twin, const std::string& service, std::span<const std::byte> request,
               std::chrono::milliseconds at_most) {
  Client::Answer answer = twin.call(service, request, at_most);
  if (!answer.ok) throw ClientError(answer.why);
  return std::move(answer.response);
}

}  // namespace doppel::app
