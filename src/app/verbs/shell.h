#pragma once
// Shared by all verbs: the connection to the twin, output that is flushed line by line, Ctrl-C, and checked
// names. Data goes to stdout, messages to stderr.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/client/client.h"

namespace doppel {
struct RunningTwin;
}

namespace doppel::app {

// stdout was closed by its reader (| head): the verb ends without an error.
struct OutputClosed {};

void print_out(std::string_view text);   // flushed; throws OutputClosed
void print_note(std::string_view text);  // to stderr, with a line's end

template <class... Args>
void print_line(fmt::format_string<Args...> format, Args&&... args) {
  print_out(fmt::format(format, std::forward<Args>(args)...));
}

[[noreturn]] void throw_usage_error(std::string message, std::string fix = "");  // exit code 2

inline constexpr auto kForever = std::chrono::hours(24 * 365);  // for waits that something else ends

// The connection that a verb uses.
struct Connection {
  int port = 0;                 // of the twin; 0: of DOPPEL_PORT, else of the newest running one
  bool remote = false;          // the ROS 2 graph instead of a twin's server
  double spin_time = 0;         // s of discovery; 0: until no new participants appear
  std::string name_space = {};  // "left": the selected robot; empty: none
};

class Shell {
 public:
  explicit Shell(const Connection& connection) : connection_(connection) {}

  // The twin, or with --remote the ROS 2 graph; connected to on first use.
  Client& twin();
  [[nodiscard]] bool is_remote() const { return connection_.remote; }  // a ROS 2 graph
  // The address of the twin's page. Throws ClientError if no twin is running, InputError with --remote.
  [[nodiscard]] std::string page_url() const;
  // The running twins of this user, newest first, without emulated arms; empty with --port, DOPPEL_PORT or
  // --remote, which select one.
  [[nodiscard]] std::vector<RunningTwin> unselected_twins() const;
  static std::unique_ptr<Client> connect(const RunningTwin& twin);
  // From now on Ctrl-C ends waits with Interrupted instead of ending the program.
  static void catch_interrupts();
  static bool interrupted();
  static void clear_interrupt();

 private:
  Connection connection_;
  std::unique_ptr<Client> client_;
};

// A verb with its own options: `declare` adds them to the command line, `run` returns the exit code.
template <class Options>
CLI::App* add_verb(CLI::App& group, const std::string& name, const std::string& help,
                   const std::string& example, int& exit_code,
                   const std::function<void(CLI::App&, Options&)>& declare,
                   std::function<int(Shell&, const Options&)> run);
struct NoOptions {};

// The verbs of one group; without one of them the group's help is shown.
// examples: command lines, separated by "\n  ".
CLI::App& add_group(CLI::App& app, const std::string& name, const std::string& help,
                    const std::string& examples);

// -- names
// The robot of --ns: "/left", or empty. Relative names are below it.
const std::string& robot_namespace();
std::string absolute(std::string_view name);             // with its leading slash
bool is_hidden(std::string_view name);                   // a part of it begins with an underscore
const TypeSupport& known_type(const std::string& name);  // throws InputError with the nearest
// Throws InputError with the type of ROS 2 that has replaced a type of ROS 1, or with the nearest one. kind:
// "message type".
[[noreturn]] void throw_unknown_type(const std::string& name, const char* kind,
                                     const std::vector<std::string>& names);
std::string find_node_name(Client& twin, const std::string& name);
std::vector<std::string> node_names(Client& twin, bool hidden);
Bytes to_request(const TypeSupport& type, std::string_view yaml);  // throws InputError

// Saves the next message of a topic; `file` empty: named by the topic. A file that cannot be written is
// refused before the twin is asked for the topic. Returns the exit code.
using TopicFinder = std::function<std::string(Client&)>;
int save_topic(Shell& shell, const TopicFinder& find_topic, const std::string& file);

// -- calls
Bytes call_raw(Client& twin, const std::string& service, std::span<const std::byte> request,
               std::chrono::milliseconds at_most = std::chrono::seconds(10));

template <Message M>
M decode(std::span<const std::byte> cdr) {
  M message;
  if (const Status status = from_cdr(cdr, message); !status) throw ClientError(status.why());
  return message;
}

template <Service S>
typename S::Response call(Client& twin, const std::string& service, const typename S::Request& request = {}) {
  return decode<typename S::Response>(call_raw(twin, service, to_cdr(request)));
}

// --port, --remote, --spin-time and, where the verb has no such option, --ns.
void add_connection_options(CLI::App& verb, Connection& connection);
// Throws InputError where the options contradict each other.
int run_verb(const CLI::App& verb, Connection connection, const std::function<int(Shell&)>& run);

template <class Options>
CLI::App* add_verb(CLI::App& group, const std::string& name, const std::string& help,
                   const std::string& example, int& exit_code,
                   const std::function<void(CLI::App&, Options&)>& declare,
                   std::function<int(Shell&, const Options&)> run) {
  CLI::App* verb = group.add_subcommand(name, help);
  verb->footer("Example:\n  " + example);
  auto options = std::make_shared<Options>();
  auto connection = std::make_shared<Connection>();
  declare(*verb, *options);
  add_connection_options(*verb, *connection);
  verb->callback([&exit_code, verb, options, connection, run = std::move(run)] {
    exit_code = run_verb(*verb, *connection, [&](Shell& shell) { return run(shell, *options); });
  });
  return verb;
}

}  // namespace doppel::app
