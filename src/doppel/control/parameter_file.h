#pragma once
// ROS 2 parameter files: `node: ros__parameters: ...`, with wildcards, namespaces and nested names, each
// value with its place in the YAML, so that a joint that does not exist is an error at file:line:column.

#include <filesystem>
#include <string>
#include <vector>

#include "doppel/bus/parameters.h"
#include "doppel/core/diagnostic.h"
#include "doppel/core/source_location.h"

namespace doppel {

struct ParameterOverride {
  std::string name;  // "gains.Revolute 1.p"
  ParameterValue value;
  SourceLocation source;                 // of the value
  std::vector<SourceLocation> elements;  // of each element, for lists
  bool used = false;
};

// The overrides of one node. Taking one marks it used; what is left over at the end is a typo.
class ParameterOverrides {
 public:
  explicit ParameterOverrides(std::vector<ParameterOverride> all = {}) : all_(std::move(all)) {}

  [[nodiscard]] ParameterOverride* find(std::string_view name);
  [[nodiscard]] const std::vector<ParameterOverride>& all() const { return all_; }
  // The distinct first parts of names below a prefix: children("gains") -> {"Revolute 1", ...}; marks
  // nothing.
  [[nodiscard]] std::vector<std::string> children(std::string_view prefix) const;

 private:
  std::vector<ParameterOverride> all_;
};

// Declares a parameter on a node with the override's value if there is one, else `initial`. Throws InputError
// at the override's place where the type does not fit (an int is taken for a double) or `check` refuses.
struct DeclareOptions {
  std::string description;
  bool read_only = false;
  Parameters::Check check;
};
ParameterValue declare_parameter(Parameters& parameters, ParameterOverrides* overrides,
                                 const std::string& name, ParameterValue initial,
                                 DeclareOptions options = {});
template <class T>
T declare(Parameters& parameters, ParameterOverrides* overrides, const std::string& name, T initial,
          DeclareOptions options = {}) {
  return std::get<T>(
      declare_parameter(parameters, overrides, name, ParameterValue(std::move(initial)), std::move(options)));
}

// A warning for each override that nobody took: its name is not a parameter; with the nearest valid one.
void report_unused(const ParameterOverrides& overrides, const std::string& node,
                   const std::vector<std::string>& valid_names, Diagnostics& diagnostics);

class ParameterFile {
 public:
  // Throws InputError: unreadable, YAML not well-formed, no ros__parameters anywhere.
  static ParameterFile load(const std::filesystem::path& file);
  static ParameterFile parse(const std::string& yaml, const std::string& name);

  // Everything that applies to the node ("/controller_manager" or "controller_manager"): "/**" first, then
  // exact.
  [[nodiscard]] ParameterOverrides overrides_for(std::string_view node) const;
  [[nodiscard]] std::vector<std::string> nodes() const;  // as written, wildcards left out
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::string& text() const { return text_; }  // as it was read

 private:
  struct Section {
    std::string node;
    std::vector<ParameterOverride> values;
  };
  std::string name_, text_;
  std::vector<Section> sections_;
};

}  // namespace doppel
