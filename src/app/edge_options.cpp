#include "app/edge_options.h"

#include "app/process.h"
#include "app/verbs/description_target.h"
#include "doppel/server/admission.h"

namespace doppel::app {

void add_edge_options(CLI::App& verb, EdgeOptions& options) {
  verb.add_option("--port", options.server.port, "The server's port (else 8700 or the next that is free)")
      ->check(CLI::Range(1, 65535));
  verb.add_option("--host", options.server.host,
                  "The address to listen on; beyond 127.0.0.1 everybody who connects needs the token that "
                  "stands in the printed address");
  verb.add_option("--token", options.server.token,
                  "A token of your own, 16 characters or more, to be asked for (else one is made where "
                  "--host needs it)")
      ->check([](const std::string& token) {
        const Status usable = check_token(token);
        return usable ? std::string() : usable.why();
      });
  verb.add_flag("--no-open", options.no_open, "Do not open the page in the desktop's browser");
  CLI::Option* none = verb.add_flag("--no-ros", options.ros.none, "Do not join ROS 2's network");
  verb.add_option("--domain", options.ros.domain, "ROS 2's domain (else ROS_DOMAIN_ID, else 0)")
      ->check(CLI::Range(std::uint32_t{0}, ros2::kLastDomain))
      ->excludes(none);
}

SessionOptions session_options(const EdgeOptions& options, const RosArguments& ros) {
  Diagnostics diagnostics;
  SessionOptions out;
  out.server = options.server;
  out.server.page_folder = page_folder();
  out.network = ros_network(options.ros, ros, diagnostics);
  out.bundled = bundled_folders();
  print_diagnostics(diagnostics, true);
  return out;
}

std::filesystem::path page_folder() {
  return root_folder() / "web" / "dist";
}

BundledFolders bundled_folders() {
  return {root_folder() / "robots", root_folder() / "datasheets"};
}

}  // namespace doppel::app
