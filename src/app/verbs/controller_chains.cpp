// doppel control view_controller_chains: which controller commands which, and their interfaces of the
// hardware.

#include <algorithm>
#include <deque>

#include "app/output.h"
#include "app/verbs/controllers.h"
#include "app/verbs/verbs.h"
#include "doppel/review/conversion/tree.h"

namespace doppel::app {
namespace {

using controller_manager_msgs::msg::ControllerState;

struct ChainOptions {
  std::string manager, pdf, svg;
  bool dot = false;
};

// The command interfaces of `controller` that belong to `other`, which takes them as references.
std::vector<std::string> references(const ControllerState& controller, const ControllerState& other) {
  std::vector<std::string> out;
  for (const std::string& interface : command_interfaces_of(controller)) {
    if (interface.starts_with(other.name + "/")) out.push_back(interface);
  }
  return out;
}

std::vector<std::string> hardware_interfaces_of(const ControllerState& controller,
                                                const std::vector<ControllerState>& all) {
  std::vector<std::string> out;
  for (const std::string& interface : command_interfaces_of(controller)) {
    const bool is_reference = std::ranges::any_of(
        all, [&](const ControllerState& other) { return interface.starts_with(other.name + "/"); });
    if (!is_reference) out.push_back(interface);
  }
  return out;
}

// The controllers that command it; most have none.
std::vector<std::string> commanders(const ControllerState& controller,
                                    const std::vector<ControllerState>& all) {
  std::vector<std::string> out;
  for (const ControllerState& other : all) {
    if (&other != &controller && !references(other, controller).empty()) out.push_back(other.name);
  }
  return out;
}

TreeCard controller_card(const ControllerState& controller, const std::vector<std::string>& above,
                         int parent) {
  TreeCard card{.node = {controller.name, controller.type, controller.state},
                .edge = {},
                .tone = controller.state == "active" ? Tone::revolute : Tone::fixed,
                .parent = parent};
  for (const std::string& interface : controller.required_state_interfaces)
    card.node.push_back("reads " + interface);
  for (std::size_t i = 1; i < above.size(); ++i) card.node.push_back("also commanded by " + above[i]);
  return card;
}

// From the controllers that no other one commands down to the hardware.
std::vector<TreeCard> chain_cards(const std::vector<ControllerState>& all) {
  std::vector<TreeCard> cards;
  std::deque<std::pair<const ControllerState*, int>> pending;
  for (const ControllerState& controller : all) {
    if (commanders(controller, all).empty()) pending.emplace_back(&controller, -1);
  }
  for (; !pending.empty(); pending.pop_front()) {
    const auto [controller, parent] = pending.front();
    const int index = static_cast<int>(cards.size());
    const std::vector<std::string> above = commanders(*controller, all);
    cards.push_back(controller_card(*controller, above, parent));
    if (parent >= 0) {
      const auto upper = std::ranges::find(all, above.front(), &ControllerState::name);
      cards.back().edge = references(*upper, *controller);
    }
    for (const ControllerState& lower : all) {
      const std::vector<std::string> uppers = commanders(lower, all);
      if (!uppers.empty() && uppers.front() == controller->name) pending.emplace_back(&lower, index);
    }
    const std::vector<std::string> interfaces = hardware_interfaces_of(*controller, all);
    if (!interfaces.empty())
      cards.push_back({.node = {"hardware"}, .edge = interfaces, .tone = Tone::prismatic, .parent = index});
  }
  return cards;
}

void print_chain(const std::vector<TreeCard>& cards, int parent, const std::string& indent,
                 std::string& out) {
  for (std::size_t i = 0; i < cards.size(); ++i) {
    const TreeCard& card = cards[i];
    if (card.parent != parent) continue;
    if (!card.edge.empty()) out += fmt::format("{}{}\n", indent, fmt::join(card.edge, ", "));
    out += fmt::format("{}{}{}", indent, card.edge.empty() ? "" : "-> ", card.node.front());
    if (card.node.size() > 2) out += fmt::format(" [{}] {}", card.node[1], card.node[2]);
    out += "\n";
    for (std::size_t line = 3; line < card.node.size(); ++line)
      out += fmt::format("{}     {}\n", indent, card.node[line]);
    print_chain(cards, static_cast<int>(i), indent + "  ", out);
  }
}

int view_chains(Shell& shell, const ChainOptions& options) {
  Client& twin = shell.twin();
  const std::vector<TreeCard> cards =
      chain_cards(list_controllers(twin, find_manager(twin, options.manager)));
  if (cards.empty()) throw ClientError("no controller is loaded");
  if (options.dot) {
    deliver(tree_dot("controllers", cards));
  } else if (options.pdf.empty() && options.svg.empty()) {
    std::string text;
    print_chain(cards, -1, "", text);
    deliver(text);
  }
  const Drawing drawing = tree_drawing("Controllers and the interfaces that they command", cards);
  if (!options.svg.empty()) deliver(to_svg(drawing), options.svg);
  if (!options.pdf.empty()) deliver(to_pdf(drawing), options.pdf);
  return 0;
}

}  // namespace

void add_controller_chains(CLI::App& group, int& exit_code) {
  add_verb<ChainOptions>(
      group, "view_controller_chains", "Show which controllers command each other and the hardware",
      "doppel control view_controller_chains\n  doppel control view_controller_chains --pdf chains.pdf\n  "
      "doppel "
      "control view_controller_chains --dot | dot -Tpng > chains.png",
      exit_code,
      [](CLI::App& verb, ChainOptions& options) {
        declare_manager(verb, options.manager);
        verb.add_flag("--dot", options.dot, "Print Graphviz dot to stdout");
        verb.add_option("--pdf", options.pdf, "Write the drawing to this file (-: stdout)")
            ->type_name("FILE");
        verb.add_option("--svg", options.svg, "Write the drawing to this file (-: stdout)")
            ->type_name("FILE");
      },
      view_chains);
}

}  // namespace doppel::app
