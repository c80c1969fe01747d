#pragma once
// The options of `up` and `view` for their edges: the server's, ROS 2's, and the folders that ship
// with the program.

#include <CLI/CLI.hpp>

#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/session/live/audit_result.h"
#include "doppel/session/live/ros_edge.h"
#include "doppel/session/live/server_edge.h"
#include "doppel/session/live/session.h"

namespace doppel::app {

struct EdgeOptions {
  std::string distro;  // of ROS 2; empty: that of ROS_DISTRO
  ServerEdgeOptions server;
  RosEdgeOptions ros;
  bool local_token = false;  // clients of this machine need a token, too
  bool no_open = false;      // do not open the page in the desktop's browser
};

// --port, --host, --token, --local-token, --no-open, --no-ros, --domain and --distro.
void add_edge_options(CLI::App& verb, EdgeOptions& options);

// Notes on ROS 2's environment variables go to stderr. Throws InputError; to be called
// before anything starts.
SessionOptions session_options(const EdgeOptions& options, const RosArguments& ros);

BundledFolders bundled_folders();

}  // namespace doppel::app
