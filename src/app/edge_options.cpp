#include "app/edge_options.h"

#include <fmt/format.h>

#include <cstdlib>

#include "app/description_target.h"
#include "app/process.h"
#include "doppel/base/core/installation.h"
#include "doppel/ros/server/admission.h"
#include "doppel/version.h"

namespace doppel::app {

void add_edge_options(CLI::App& verb, EdgeOptions& options) {
  verb.add_option("--port", options.server.port, "Port of the server (default: 8700, or the next free one)")
      ->check(CLI::Range(1, 65535));
  verb.add_option(
      "--host", options.server.host,
      "Address to listen on; on any address other than 127.0.0.1, clients need the token in the printed URL");
  verb.add_option(
          "--token", options.server.token,
          "Token that clients must present, at least 16 characters (default: that of DOPPEL_TOKEN, which "
          "other users of this machine cannot read, or generated where --host needs one)")
      ->check([](const std::string& token) {
        const Status usable = check_token(token);
        return usable ? std::string() : usable.why();
      });
  verb.add_flag(
      "--local-token", options.local_token,
      "Require a token of clients on this machine, too, so that its other users cannot command the twin; "
      "your own commands find it by themselves");
  verb.add_flag("--no-open", options.no_open, "Do not open the web page in the desktop's browser");
  CLI::Option* none = verb.add_flag("--no-ros", options.ros.none, "Do not join the ROS 2 network");
  verb.add_option("--domain", options.ros.domain, "ROS 2 domain (default: ROS_DOMAIN_ID, or 0)")
      ->check(CLI::Range(std::uint32_t{0}, ros2::kLastDomain))
      ->excludes(none);
  verb.add_option_function<std::string>(
          "--move-group",
          [&options](const std::string& text) {
            options.ros.move_group = text == "on"    ? ros2::Yielding::never
                                     : text == "off" ? ros2::Yielding::always
                                                     : ros2::Yielding::to_others;
          },
          "The services of MoveIt's move_group on the ROS 2 network: auto (default): where no other program "
          "serves "
          "them; on: always; off: never. The page and the verbs have them in any case")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->excludes(none);
  verb.add_option("--distro", options.distro,
                  "Distribution of ROS 2 whose messages and defaults the twin has: jazzy, kilted or lyrical "
                  "(default: ROS_DISTRO, or jazzy)")
      ->check(CLI::IsMember(distro_names()));
}

namespace {

// Not an option's variable of CLI11, which would check it for every verb, `stop` included.
std::string token_of_environment() {
  const char* const token = std::getenv("DOPPEL_TOKEN");
  if (token == nullptr) return "";
  if (const Status usable = check_token(token); !usable)
    throw InputError("cli.token", {},
                     fmt::format("the token in DOPPEL_TOKEN cannot be used: {}", usable.why()),
                     "set one of at least 16 characters, or unset the variable");
  return token;
}

}  // namespace

SessionOptions session_options(const EdgeOptions& options, const RosArguments& ros) {
  Diagnostics diagnostics;
  SessionOptions out;
  out.server = options.server;
  if (out.server.token.empty()) out.server.token = token_of_environment();
  if (options.local_token && out.server.token.empty()) out.server.token = make_token();
  out.server.page_folder = page_folder();
  check_address(out.server);
  out.server.metadata = {{"command", own_command_line()}, {"version", std::string(version())}};
  if (options.distro.empty()) {
    static_cast<void>(
        ros2::distro_from_environment(std::getenv, diagnostics));  // its note; main() has set it
  } else {
    set_ros_distro(*distro_of(options.distro));
  }
  out.network = ros_network(options.ros, ros, diagnostics);
  out.move_group = options.ros.move_group;
  out.bundled = bundled_folders();
  if (options.local_token && out.network && out.network->range != ros2::DiscoveryRange::off) {
    diagnostics.note(
        "ros.open", {},
        "--local-token closes the server; on the ROS 2 network, which has no authentication, other "
        "users of this machine still reach the twin",
        "add --no-ros if no ROS 2 program is needed");
  }
  print_diagnostics(diagnostics, true);
  return out;
}

BundledFolders bundled_folders() {
  return {data_folder() / "robots", data_folder() / "datasheets"};
}

}  // namespace doppel::app
