#include "doppel/scenario/sdf/detail/sdf_state.h"

namespace doppel::sdf {
namespace {

void read_model_state(const XmlNode& node, const std::string& scope, Elements& elements, StatePoses& out) {
  const std::string name = scope + Elements::attribute(node, "name");
  if (const WrittenPose pose = elements.pose(node); pose.where.known()) out.models[name] = pose.X;
  const auto scale = elements.vector<3>(node, "scale");
  if (scale && !scale->isOnes(1e-9))
    elements.without_effect(node.first("scale")->where, "<scale> of a <state>");
  for (const XmlNode& child : node.children) {
    if (child.is("model")) read_model_state(child, name + "::", elements, out);
    if (!child.is("link")) continue;
    const WrittenPose pose = elements.pose(child);
    if (pose.where.known()) out.links[name + "::" + Elements::attribute(child, "name")] = pose.X;
  }
}

}  // namespace

StatePoses read_state(const XmlNode* state, Elements& elements) {
  StatePoses out;
  if (state == nullptr) return out;
  elements.check(*state, "state");
  for (const XmlNode& child : state->children) {
    if (child.is("model")) read_model_state(child, "", elements, out);
    if (child.is("insertions")) elements.without_effect(child.where, "<insertions> of a <state>");
  }
  return out;
}

}  // namespace doppel::sdf
