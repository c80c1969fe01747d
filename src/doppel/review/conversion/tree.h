#pragma once
// The tree of links and joints as text, Graphviz, SVG and PDF; and the tree of frames as
// view_frames draws it.

#include <string>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/review/conversion/drawing.h"

namespace doppel {

struct LinkTreeNode {
  const Link* link = nullptr;
  const Joint* joint = nullptr;  // to the parent; nullptr: a root
  int parent = -1;
  std::vector<int> children;
};

// Every link, parents before their children and siblings in the description's order.
DOPPEL_API std::vector<LinkTreeNode> link_tree(const RobotDescription& robot);

// One line for each link: the tree, then columns for the joint above it and for its mass.
// `unicode`: box-drawing characters, else ASCII.
DOPPEL_API std::string tree_text(const RobotDescription& robot, bool unicode);
DOPPEL_API std::string frames_text(const RobotDescription& robot, bool unicode);

// For `dot -Tpdf`.
DOPPEL_API std::string tree_dot(const RobotDescription& robot);
DOPPEL_API std::string frames_dot(const RobotDescription& robot);

// Laid out top-down or left to right, whichever is nearer to the proportions of a page.
DOPPEL_API Drawing tree_drawing(const RobotDescription& robot);
DOPPEL_API Drawing frames_drawing(const RobotDescription& robot);

// A node of any other tree, with what stands on the line from its parent: frames of a running twin,
// controllers.
struct TreeCard {
  std::vector<std::string> node;  // lines of text, the first one is its title
  std::vector<std::string> edge;  // empty: an unlabelled line
  Tone tone = Tone::fixed;        // of the line
  int parent = -1;                // index of an earlier card; -1: a root
};
DOPPEL_API std::string tree_dot(const std::string& name, const std::vector<TreeCard>& cards);
DOPPEL_API Drawing tree_drawing(const std::string& title, const std::vector<TreeCard>& cards);

}  // namespace doppel
