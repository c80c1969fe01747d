// The drawing of a tree. Siblings' subtrees are pushed together until their outlines, taken level by level,
// just keep apart; a parent stands over the middle of its children. Source: Reingold and Tilford, "Tidier
// Drawings of Trees", 1981, for nodes of any size as in van der Ploeg, "Drawing Non-layered Tidy Trees", 2014
// (here in layers).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/review/conversion/tree.h"
#include "doppel/review/conversion/tree_labels.h"

namespace doppel {
namespace {

constexpr double kMargin = 28, kHeading = 30;
constexpr double kTitleSize = 10, kLineSize = 8, kLineHeight = 10.5, kPadding = 9;
constexpr double kSiblingGap = 14, kCousinGap = 26;
constexpr double kEdge = 20;  // of line visible before and behind a joint

const std::string kBetween = " \u00B7 ";

struct Line {
  std::string text;
  bool title = false;
};

// A link with the joint that leads to it.
struct Label {
  std::vector<Line> link, joint;
  Tone tone = Tone::fixed;  // of the joint
  bool dashed = false;
  int parent = -1;
};

struct Size {
  double width = 0, height = 0;
};

Size size_of(const std::vector<Line>& lines) {
  if (lines.empty()) return {};
  Size size;
  for (const Line& line : lines)
    size.width = std::max(size.width, text_width(line.text, line.title ? kTitleSize : kLineSize, line.title));
  // Viewers without Helvetica use a slightly wider font.
  size.width = 1.1 * size.width + 2 * kPadding;
  size.height = static_cast<double>(lines.size()) * kLineHeight + 10;
  return size;
}

// Breadth is along the siblings, depth along the generations.
class Layout {
 public:
  Layout(const std::vector<Label>& labels, bool across)
      : labels_(labels), across_(across), nodes_(labels.size()) {
    for (std::size_t i = 0; i < labels.size(); ++i) {
      Node& node = nodes_[i];
      node.link = size_of(labels[i].link);
      node.joint = size_of(labels[i].joint);
      node.breadth = std::max(breadth(node.link), breadth(node.joint));
      node.level = labels[i].parent < 0 ? 0 : nodes_[labels[i].parent].level + 1;
      if (labels[i].parent >= 0) nodes_[labels[i].parent].children.push_back(static_cast<int>(i));
    }
    place_levels();
    // Children are behind their parents, so backwards every subtree is complete before it is needed.
    for (std::size_t i = nodes_.size(); i-- > 0;) arrange(nodes_[i]);
    spread();
  }

  [[nodiscard]] double width() const { return across_ ? total_depth_ : total_breadth_; }
  [[nodiscard]] double height() const { return across_ ? total_breadth_ : total_depth_; }

  void draw(double left, double top, Drawing& drawing) const {
    for (std::size_t i = 0; i < nodes_.size(); ++i) draw_edges(static_cast<int>(i), left, top, drawing);
    for (std::size_t i = 0; i < nodes_.size(); ++i) draw_node(static_cast<int>(i), left, top, drawing);
  }

 private:
  struct Extent {
    double low = 0, high = 0;
  };
  struct Node {
    Size link, joint;
    double breadth = 0, middle = 0;  // middle: in its parent's subtree, at the end on the page
    int level = 0;
    std::vector<int> children;
    std::vector<Extent> outline;  // of the subtree, level by level, around its own middle
  };
  struct Level {
    double joint = 0, link = 0;        // the largest depth of each
    double joint_at = 0, link_at = 0;  // where they begin
  };

  [[nodiscard]] double breadth(const Size& size) const { return across_ ? size.height : size.width; }
  [[nodiscard]] double depth(const Size& size) const { return across_ ? size.width : size.height; }

  void place_levels() {
    for (const Node& node : nodes_) {
      if (levels_.size() <= static_cast<std::size_t>(node.level)) levels_.resize(node.level + 1);
      Level& level = levels_[node.level];
      level.joint = std::max(level.joint, depth(node.joint));
      level.link = std::max(level.link, depth(node.link));
    }
    double at = 0;
    for (Level& level : levels_) {
      const bool root = &level == &levels_.front();
      level.joint_at = at + (root ? 0 : kEdge);
      level.link_at = level.joint_at + level.joint + (root || level.joint == 0 ? 0 : kEdge);
      at = level.link_at + level.link;
    }
    total_depth_ = at;
  }

  void arrange(Node& node) {
    const Extent own{-0.5 * node.breadth, 0.5 * node.breadth};
    std::vector<Extent> merged;
    for (const int index : node.children) {
      Node& child = nodes_[index];
      double shift = 0;
      for (std::size_t l = 0; l < std::min(merged.size(), child.outline.size()); ++l) {
        const double gap = l == 0 ? kSiblingGap : kCousinGap;
        shift = std::max(shift, merged[l].high + gap - child.outline[l].low);
      }
      child.middle = shift;
      for (std::size_t l = 0; l < child.outline.size(); ++l) {
        const Extent moved{child.outline[l].low + shift, child.outline[l].high + shift};
        if (l < merged.size()) {
          merged[l].high = std::max(merged[l].high, moved.high);
          merged[l].low = std::min(merged[l].low, moved.low);
        } else {
          merged.push_back(moved);
        }
      }
    }
    node.outline = {own};
    if (node.children.empty()) return;
    const double centre = 0.5 * (nodes_[node.children.front()].middle + nodes_[node.children.back()].middle);
    for (const int index : node.children) nodes_[index].middle -= centre;
    for (const Extent& extent : merged) node.outline.push_back({extent.low - centre, extent.high - centre});
  }

  void spread() {
    double low = 0, high = 0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const int parent = labels_[i].parent;
      if (parent >= 0) nodes_[i].middle += nodes_[parent].middle;
      low = std::min(low, nodes_[i].middle - 0.5 * nodes_[i].breadth);
      high = std::max(high, nodes_[i].middle + 0.5 * nodes_[i].breadth);
    }
    for (Node& node : nodes_) node.middle -= low;
    total_breadth_ = high - low;
  }

  void curve(double breadth1, double depth1, double breadth2, double depth2, const Label& label, double left,
             double top, Drawing& drawing) const {
    DrawnCurve drawn{left + breadth1, top + depth1, left + breadth2, top + depth2,
                     across_,         label.dashed, label.tone};
    if (across_)
      drawn = {left + depth1, top + breadth1, left + depth2, top + breadth2, true, label.dashed, label.tone};
    drawing.items.emplace_back(drawn);
  }

  void draw_edges(int index, double left, double top, Drawing& drawing) const {
    const Node& node = nodes_[index];
    const int parent = labels_[index].parent;
    if (parent < 0) return;
    const Level& here = levels_[node.level];
    const double from = levels_[node.level - 1].link_at + depth(nodes_[parent].link);
    curve(nodes_[parent].middle, from, node.middle, here.joint_at, labels_[index], left, top, drawing);
    curve(node.middle, here.joint_at, node.middle, here.link_at, labels_[index], left, top, drawing);
  }

  void draw_node(int index, double left, double top, Drawing& drawing) const {
    const Node& node = nodes_[index];
    const Level& level = levels_[node.level];
    const Label& label = labels_[index];
    if (!label.joint.empty()) {
      const double at = level.joint_at + 0.5 * (level.joint - depth(node.joint));
      draw_card(label.joint, node.joint, node.middle, at, Tone::paper, label.tone, label.tone, 0.5, left, top,
                drawing);
    }
    const bool bare = label.link.size() == 1;
    draw_card(label.link, node.link, node.middle, level.link_at, bare ? Tone::frame : Tone::box,
              Tone::box_edge, Tone::ink, 7, left, top, drawing);
  }

  // radius below 1: a part of the height.
  void draw_card(const std::vector<Line>& lines, const Size& size, double middle, double at, Tone fill,
                 Tone edge, Tone title, double radius, double left, double top, Drawing& drawing) const {
    DrawnBox box{left + middle - 0.5 * size.width, top + at, size.width, size.height, radius, fill, edge};
    if (across_) {
      box.x = left + at;
      box.y = top + middle - 0.5 * size.height;
    }
    if (radius < 1) box.radius = std::min(12.0, radius * size.height);
    drawing.items.emplace_back(box);
    double y = box.y + 5 + 0.76 * kLineHeight;
    for (const Line& line : lines) {
      drawing.items.emplace_back(DrawnText{box.x + 0.5 * box.width, y, line.text,
                                           line.title ? kTitleSize : kLineSize, line.title, true,
                                           line.title ? title : Tone::faint});
      y += kLineHeight;
    }
  }

  const std::vector<Label>& labels_;
  bool across_;
  std::vector<Node> nodes_;
  std::vector<Level> levels_;
  double total_depth_ = 0, total_breadth_ = 0;
};

// The cost of a layout by its proportions and size: the longer side of the page that it needs.
double page_needed(const Layout& layout) {
  const double longer = std::max(layout.width(), layout.height());
  const double shorter = std::min(layout.width(), layout.height());
  return std::max(longer, std::sqrt(2.0) * shorter);
}

Drawing drawing_of(const std::string& title, const std::vector<Label>& labels) {
  const Layout down(labels, false), across(labels, true);
  const Layout& layout = page_needed(across) < page_needed(down) ? across : down;
  Drawing drawing;
  drawing.title = title;
  const double needed = text_width(title, 12, true) * 1.06;
  drawing.width = std::max(layout.width(), needed) + 2 * kMargin;
  drawing.height = layout.height() + 2 * kMargin + kHeading;
  drawing.items.emplace_back(DrawnText{kMargin, kMargin + 10, title, 12, true, false, Tone::ink});
  layout.draw(0.5 * (drawing.width - layout.width()), kMargin + kHeading, drawing);
  return drawing;
}

std::vector<Line> link_lines(const Link& link) {
  std::vector<Line> lines = {{link.name, true}};
  if (link.inertial) {
    lines.push_back({mass_word(link) + kBetween + "centre " + millimetres_word(link.inertial->origin.xyz)});
  }
  return lines;
}

std::vector<Line> joint_lines(const Joint& joint) {
  std::vector<Line> lines = {{joint.name, true}};
  std::string kind = type_word(joint.type);
  if (joint.type != JointType::fixed && joint.type != JointType::floating)
    kind += (turns(joint.type) ? " about " : " along ") + axis_word(joint.axis);
  const std::string limits = limits_word(joint);
  if (!limits.empty()) kind += kBetween + limits;
  lines.push_back({kind});
  if (joint.mimic)
    lines.push_back({fmt::format("follows {:g} x {}", joint.mimic->multiplier, joint.mimic->joint)});
  std::string place = "xyz " + short_numbers(joint.origin.xyz);
  if (!joint.origin.rpy.isZero()) place += kBetween + ("rpy " + degrees_word(joint.origin.rpy) + "\u00B0");
  if (!joint.origin.xyz.isZero() || !joint.origin.rpy.isZero()) lines.push_back({place});
  return lines;
}

}  // namespace

Drawing tree_drawing(const RobotDescription& robot) {
  std::vector<Label> labels;
  for (const LinkTreeNode& node : link_tree(robot)) {
    Label label{link_lines(*node.link), {}, Tone::fixed, false, node.parent};
    if (node.joint != nullptr) {
      label.joint = joint_lines(*node.joint);
      label.tone = joint_tone(node.joint->type);
      label.dashed = node.joint->mimic.has_value();
    }
    labels.push_back(std::move(label));
  }
  return drawing_of(headline(robot), labels);
}

Drawing frames_drawing(const RobotDescription& robot) {
  std::vector<Label> labels;
  for (const LinkTreeNode& node : link_tree(robot)) {
    Label label{{{node.link->name, true}}, {}, Tone::fixed, false, node.parent};
    if (node.joint != nullptr) {
      const bool fixed = node.joint->type == JointType::fixed;
      label.joint = {{fixed ? "/tf_static" : "/tf, from " + node.joint->name}, {"robot_state_publisher"}};
      label.tone = fixed ? Tone::fixed : Tone::revolute;
    }
    labels.push_back(std::move(label));
  }
  return drawing_of(fmt::format("Frames of {}", robot.name), labels);
}

Drawing tree_drawing(const std::string& title, const std::vector<TreeCard>& cards) {
  const auto lines = [](const std::vector<std::string>& texts) {
    std::vector<Line> out;
    for (const std::string& text : texts) out.push_back({text, out.empty()});
    return out;
  };
  std::vector<Label> labels;
  for (const TreeCard& card : cards)
    labels.push_back({lines(card.node), lines(card.edge), card.tone, false, card.parent});
  return drawing_of(title, labels);
}

}  // namespace doppel
