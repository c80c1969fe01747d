#pragma once
// ROS 2's rules for names (design.ros2.org/articles/topic_and_service_names.html) and for remapping
// from the command line (static_remapping.html): valid names, the expansion of relative and private
// ones, and `-r from:=to`.

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/status.h"
#include "doppel/export.h"

namespace doppel {

// "/left/arm": the namespace "/left" ("/" for a node without one) and the name "arm".
DOPPEL_API std::string node_namespace(std::string_view full_name);
DOPPEL_API std::string node_base_name(std::string_view full_name);
// "left.arm": the node's name in the log, as in rcl.
DOPPEL_API std::string logger_name(std::string_view full_name);

// Refuse an invalid name with the reason. A topic's or service's name may be relative or private ("~/x").
DOPPEL_API Status check_node_name(std::string_view name);
DOPPEL_API Status check_namespace(std::string_view name);
DOPPEL_API Status check_topic_name(std::string_view name);

// The absolute name of `name` in the node "/left/arm": "x" is "/left/x", "~/x" is "/left/arm/x", "/x" itself.
DOPPEL_API std::string expand_name(std::string_view name, std::string_view node);

enum class NameKind { topic, service };

// The rules of one process, in order; the first matching one is used. For one thread.
class DOPPEL_API NameRules {
 public:
  NameRules() = default;
  // one_node: of a program with a single node, which "__node:=name" may rename.
  explicit NameRules(bool one_node) : one_node_(one_node) {}

  // "from:=to", "node:from:=to", "__ns:=/left", "node:__node:=name" and so on. Throws InputError, also for a
  // rule that would give several nodes the same name.
  void add(std::string_view rule) { add(rule, Owner{}); }
  // Rules of a part of the process, after the existing ones, until they are removed.
  struct Owner {
    const void* whose = nullptr;
    std::string part;
    std::string node =
        {};  // the full name before the rules of the only node to which they apply; empty: all nodes
    bool operator==(const Owner&) const = default;
  };
  void add(std::string_view rule, const Owner& owner);
  void remove(const Owner& owner);
  void remove_all_of(const void* whose);
  [[nodiscard]] bool empty() const { return rules_.empty(); }
  // As they were given, in order, without those of owners.
  [[nodiscard]] std::vector<std::string> texts() const;

  // The name of a node by the rules; `full_name`: its absolute name before.
  std::string node(std::string_view full_name);
  // The absolute name by the rules of `name` in the node `node` (whose name is by the rules).
  std::string resolve(NameKind kind, std::string_view name, std::string_view node);

  // A warning for each rule that has not matched so far, with the nearest existing name.
  void report_unused(Diagnostics& diagnostics) const;

 private:
  enum class Target { node_name, node_namespace, topic, service, topic_and_service };
  struct Rule {
    std::string text, node;  // node: the only one to which it applies; empty: all
    Target target = Target::topic_and_service;
    std::string from, to;
    Owner owner;
    std::string owners_node;  // the name by the rules of owner.node
    bool used = false;
  };
  static bool fits(const Rule& rule, NameKind kind);
  static bool fits_node(const Rule& rule, std::string_view node);

  bool one_node_ = false;
  std::vector<Rule> rules_;
  std::set<std::string> nodes_, names_;  // names so far that could have matched
};

}  // namespace doppel
