#pragma once
// ROS 2 parameter files: `node: ros__parameters: ...`, with wildcards, namespaces and nested names, each
// value with its place in the YAML, so that an unknown joint is an error at file:line:column.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/source_location.h"
#include "doppel/export.h"
#include "doppel/ros/bus/parameters.h"
#include "doppel/ros/bus/ros_arguments.h"

namespace doppel {

struct ParameterOverride {
  std::string name;  // "gains.Revolute 1.p"
  ParameterValue value;
  SourceLocation source;                 // of the value
  std::vector<SourceLocation> elements;  // of each element, for lists
  bool used = false;
};

// The overrides of one node. find() marks one as used; an unused one at the end is a typo.
class DOPPEL_API ParameterOverrides {
 public:
  explicit ParameterOverrides(std::vector<ParameterOverride> all = {}) : all_(std::move(all)) {}

  [[nodiscard]] ParameterOverride* find(std::string_view name);
  [[nodiscard]] const std::vector<ParameterOverride>& all() const { return all_; }
  // The distinct first parts of names below a prefix: children("gains") -> {"Revolute 1", ...}. Does not mark
  // any as used.
  [[nodiscard]] std::vector<std::string> children(std::string_view prefix) const;

 private:
  std::vector<ParameterOverride> all_;
};

// Declares a parameter on a node with the override's value if there is one, else `initial`. Throws InputError
// at the override's place if the type does not match (an int is converted to a double) or `check` refuses.
using DeclareOptions = ParameterOptions;
DOPPEL_API ParameterValue declare_parameter(Parameters& parameters, ParameterOverrides* overrides,
                                            const std::string& name, ParameterValue initial,
                                            DeclareOptions options = {});
template <class T>
T declare(Parameters& parameters, ParameterOverrides* overrides, const std::string& name, T initial,
          DeclareOptions options = {}) {
  return std::get<T>(
      declare_parameter(parameters, overrides, name, ParameterValue(std::move(initial)), std::move(options)));
}

// A warning for each unused override, whose name is not a parameter, with the nearest valid name.
DOPPEL_API void report_unused(const ParameterOverrides& overrides, const std::string& node,
                              const std::vector<std::string>& valid_names, Diagnostics& diagnostics);

// The parameters of a YAML file without nodes, as rosparam of ROS 1 loads it: maps of names and values, the names
// joined by dots. Values that are no parameters in ROS 2, such as lists of maps, are left out. Throws InputError:
// the YAML is not well-formed.
DOPPEL_API ParameterOverrides read_plain_parameters(const std::string& yaml, const std::string& name);

class DOPPEL_API ParameterFile {
 public:
  // Throws InputError: unreadable, YAML not well-formed, no ros__parameters anywhere.
  static ParameterFile load(const std::filesystem::path& file);
  static ParameterFile parse(const std::string& yaml, const std::string& name);
  // Of values that were read from `yaml`, the text of the file `name`, by another reader.
  struct Node {
    std::string name;
    std::vector<ParameterOverride> values;
  };
  static ParameterFile of(std::vector<Node> nodes, const std::string& yaml, const std::string& name);

  // Adds values with priority over the present ones, for example of the command line.
  void add(ParameterFile later);
  // node: empty for all nodes. text: the source, for messages.
  void add(const std::string& node, const std::string& name, ParameterValue value, const std::string& text);

  // The namespace ("left") of its nodes: a section for "controller_manager" then also applies to
  // "/left/controller_manager", so that one file can be used for a robot in any namespace.
  void set_home(const std::string& name_space) { home_ = name_space.empty() ? "" : "/" + name_space; }

  // All overrides of the node ("/left/controller_manager" or "controller_manager"): "/**" first, then exact
  // names. given_name: its name before remapping; sections for that name apply, too, so that a robot's own
  // file can be used in any namespace.
  [[nodiscard]] ParameterOverrides overrides_for(std::string_view node,
                                                 std::string_view given_name = {}) const;
  [[nodiscard]] std::vector<std::string> nodes() const;  // as written, wildcards left out
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::string& text() const { return text_; }  // of all files, as it was read

 private:
  struct Section {
    std::string node;
    std::vector<ParameterOverride> values;
  };
  std::string name_, text_;
  std::vector<std::pair<Section, int>> sections_;  // with their layers: 0 the file, then what was added
  int layers_ = 0;
  std::string home_;  // "/left"
};

// Adds the nodes' parameters of the command line. Throws InputError: a file that cannot be read.
DOPPEL_API void add_ros_parameters(const RosArguments& arguments, ParameterFile& parameters);

}  // namespace doppel
