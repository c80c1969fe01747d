#pragma once
// The content of a launch file of ROS 2 or ROS 1 as a tree of records in its order. Nothing has been started.

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"

namespace doppel {

enum class LaunchKind {
  node,            // of a package; a container has components
  process,         // a command
  include,         // of a launch file, with its records as children
  timer,           // its children begin after `period`
  event,           // its children begin after an event of other records
  skipped,         // its condition is not met
  unknown,         // an action that doppel does not have
  parameter,       // on the parameter server of ROS 1
  environment,     // a variable of what follows
  components,      // nodes for a container
  gz_server,       // an action of ros_gz_sim: a simulator
  gz_spawn_model,  // an action of ros_gz_sim: a model in it
  log,
  emit,
  shutdown,
};

// The text of a robot's description and where it comes from.
struct LaunchedRobotText {
  std::filesystem::path source;  // the expanded or read file; empty: the launch file has made the text
  XacroArguments arguments;
  std::string text;
};

// A parameter file, or values: each of them as JSON (which is YAML).
struct LaunchParameters {
  std::filesystem::path file;
  std::vector<std::pair<std::string, std::string>> values;
};

using NamedTexts = std::vector<std::pair<std::string, std::string>>;

struct DOPPEL_API LaunchRecord {
  LaunchKind kind = LaunchKind::unknown;
  SourceLocation source;
  int id = 0;
  std::string package, executable, name, name_space;
  std::string text;                // of a log; why it is skipped; the value of a variable
  std::string path;                // of an include, of a parameter's file
  std::vector<std::string> words;  // a command, or the arguments of a node
  std::vector<LaunchParameters> parameters;
  NamedTexts remappings, environment, arguments;
  std::vector<std::pair<std::string, LaunchedRobotText>> descriptions;  // parameters that are robots, by name
  std::vector<int> after;  // of an event: the records that it waits for
  double period = 0;       // s, of a timer
  bool missing = false;    // an include whose file does not exist
  bool required = false;   // the launch ends with it
  bool ros1 = false;
  std::filesystem::path folder;        // where a process starts
  std::vector<LaunchRecord> children;  // also the components of a container

  // A value among its parameters, as text without quotes; nullptr: there is none. The last one counts.
  [[nodiscard]] std::optional<std::string> parameter(std::string_view parameter_name) const;
};

struct LaunchArgument {
  std::string name, default_value, description, value;
  std::vector<std::string> choices;
  bool is_given = false;
  SourceLocation source;
};

// A package whose folder is looked up.
struct NamedPackage {
  std::string name;
  SourceLocation source;
};

// A xacro file that is expanded.
struct LaunchExpansion {
  std::filesystem::path file;
  XacroArguments arguments;
  bool by_command = false;  // Command('xacro ...') instead of xacro.process_file(...)
  SourceLocation source;
};

struct LaunchDescription {
  std::vector<std::filesystem::path> files;  // in the order of their reading
  std::vector<LaunchArgument> arguments;
  std::vector<LaunchRecord> records;
  std::vector<NamedPackage> packages;
  std::vector<LaunchExpansion> expansions;
  // Files that were made while reading, such as parameter files with performed substitutions, and their
  // sources.
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> made_files;
  Diagnostics diagnostics;  // what is not known, with its line
};

// "left" of "/left/".
DOPPEL_API std::string bare_namespace(const std::string& name_space);

}  // namespace doppel
