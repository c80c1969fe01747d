#include "doppel/review/conversion/tree.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "doppel/review/conversion/detail/table.h"
#include "doppel/review/conversion/tree_labels.h"

namespace doppel {
namespace {

// The lines that lead to each node, like those of `tree`.
std::vector<std::string> branches(const std::vector<LinkTreeNode>& nodes, bool unicode) {
  const char* through = unicode ? "│  " : "|  ";
  const char* tee = unicode ? "├─ " : "|- ";
  const char* corner = unicode ? "└─ " : "`- ";
  std::vector<std::string> lead(nodes.size()), below(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].parent < 0) continue;
    const bool last = nodes[nodes[i].parent].children.back() == static_cast<int>(i);
    lead[i] = below[nodes[i].parent] + (last ? corner : tee);
    below[i] = below[nodes[i].parent] + (last ? "   " : through);
  }
  return lead;
}

// Text order: a node is followed by its whole subtree.
std::vector<int> depth_first(const std::vector<LinkTreeNode>& nodes) {
  std::vector<int> order, open;
  for (int i = static_cast<int>(nodes.size()) - 1; i >= 0; --i) {
    if (nodes[i].parent < 0) open.push_back(i);
  }
  while (!open.empty()) {
    const int at = open.back();
    open.pop_back();
    order.push_back(at);
    open.insert(open.end(), nodes[at].children.rbegin(), nodes[at].children.rend());
  }
  return order;
}

// Terminals that have no box-drawing characters have no degree sign either.
std::string plain(std::string text, bool unicode) {
  const std::size_t at = unicode ? std::string::npos : text.find("\u00B0");
  return at == std::string::npos ? text : text.replace(at, 2, " deg");
}

std::string dot_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string topic_of(const Joint& joint) {
  return joint.type == JointType::fixed ? "/tf_static" : "/tf";
}

std::string dot_document(const std::string& name, const std::string& body) {
  return fmt::format(
      "digraph {} {{\n  node [shape=box, style=\"rounded\", fontname=\"Helvetica\"];\n"
      "  edge [fontname=\"Helvetica\", fontsize=10];\n{}}}\n",
      dot_string(name), body);
}

}  // namespace

std::vector<LinkTreeNode> link_tree(const RobotDescription& robot) {
  std::map<std::string_view, std::vector<const Joint*>> below;
  std::map<std::string_view, int> is_child;
  for (const Joint& joint : robot.joints) {
    below[joint.parent].push_back(&joint);
    ++is_child[joint.child];
  }
  std::vector<LinkTreeNode> nodes;
  for (const Link& link : robot.links) {
    if (!is_child.contains(link.name)) nodes.push_back({&link, nullptr, -1, {}});
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const Joint* joint : below[nodes[i].link->name]) {
      const Link* child = robot.find_link(joint->child);
      if (child == nullptr) continue;
      nodes[i].children.push_back(static_cast<int>(nodes.size()));
      nodes.push_back({child, joint, static_cast<int>(i), {}});
    }
  }
  return nodes;
}

std::string tree_text(const RobotDescription& robot, bool unicode) {
  const std::vector<LinkTreeNode> nodes = link_tree(robot);
  const std::vector<std::string> lead = branches(nodes, unicode);
  std::vector<TableRow> rows = {{"link", "mass", "joint", "type", "axis", "limits", "xyz [m]", "rpy [deg]"}};
  for (const int i : depth_first(nodes)) {
    TableRow row = {lead[i] + nodes[i].link->name, mass_word(*nodes[i].link)};
    if (const Joint* joint = nodes[i].joint) {
      const bool moves = joint->type != JointType::fixed && joint->type != JointType::floating;
      std::string limits = plain(limits_word(*joint), unicode);
      if (joint->mimic) limits = fmt::format("{:g} x {}", joint->mimic->multiplier, joint->mimic->joint);
      row.insert(row.end(), {joint->name, type_word(joint->type), moves ? axis_word(joint->axis) : "", limits,
                             short_numbers(joint->origin.xyz), degrees_word(joint->origin.rpy)});
    }
    rows.push_back(std::move(row));
  }
  return headline(robot) + "\n\n" + text_table(rows, {1});
}

std::string frames_text(const RobotDescription& robot, bool unicode) {
  const std::vector<LinkTreeNode> nodes = link_tree(robot);
  const std::vector<std::string> lead = branches(nodes, unicode);
  std::vector<TableRow> rows = {{"frame", "comes on", "from joint"}};
  for (const int i : depth_first(nodes)) {
    TableRow row = {lead[i] + nodes[i].link->name};
    if (nodes[i].joint != nullptr) row.insert(row.end(), {topic_of(*nodes[i].joint), nodes[i].joint->name});
    rows.push_back(std::move(row));
  }
  return text_table(rows);
}

std::string tree_dot(const RobotDescription& robot) {
  std::string body;
  for (const LinkTreeNode& node : link_tree(robot)) {
    const std::string mass = mass_word(*node.link);
    body += fmt::format("  {} [label={}];\n", dot_string(node.link->name),
                        dot_string(node.link->name + (mass.empty() ? "" : "\n" + mass)));
    if (node.joint == nullptr) continue;
    const Joint& joint = *node.joint;
    std::string label = joint.name + "\n" + type_word(joint.type);
    if (joint.type != JointType::fixed && joint.type != JointType::floating)
      label += " about " + axis_word(joint.axis);
    label +=
        "\nxyz " + short_numbers(joint.origin.xyz) + "\nrpy " + degrees_word(joint.origin.rpy) + "\u00B0";
    body += fmt::format("  {} -> {} [label={}];\n", dot_string(joint.parent), dot_string(joint.child),
                        dot_string(label));
  }
  return dot_document(robot.name, body);
}

std::string frames_dot(const RobotDescription& robot) {
  std::string body;
  for (const LinkTreeNode& node : link_tree(robot)) {
    if (node.joint == nullptr) continue;
    body +=
        fmt::format("  {} -> {} [label={}];\n", dot_string(node.joint->parent), dot_string(node.joint->child),
                    dot_string("Broadcaster: robot_state_publisher\n" + topic_of(*node.joint)));
  }
  return dot_document(robot.name, body);
}

std::string tree_dot(const std::string& name, const std::vector<TreeCard>& cards) {
  std::string body;
  for (std::size_t i = 0; i < cards.size(); ++i) {
    const TreeCard& card = cards[i];
    body += fmt::format("  n{} [label={}];\n", i, dot_string(fmt::format("{}", fmt::join(card.node, "\n"))));
    if (card.parent < 0) continue;
    body += fmt::format("  n{} -> n{} [label={}];\n", card.parent, i,
                        dot_string(fmt::format("{}", fmt::join(card.edge, "\n"))));
  }
  return dot_document(name, body);
}

}  // namespace doppel
