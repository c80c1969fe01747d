#include "doppel/validation/extras/detail/twin_touch.h"

#include <algorithm>

namespace doppel {

TwinTouch::TwinTouch(const CheckContext& context)
    : machine_(context, {.start_controllers = false}), start_(pairs()) {}

bool TwinTouch::is_free(const Model& model, const Eigen::VectorXd& q) {
  Instance robot = machine_.twin().robot().instance();
  std::vector<double> position(robot.q().begin(), robot.q().end());
  const std::vector<double> rest(robot.v().size(), 0.0);
  for (const ModelJoint& joint : model.joints) {
    const int twin = robot.model().find_joint(joint.name);
    if (joint.scalar() && twin >= 0)
      position[static_cast<std::size_t>(robot.model().joints[static_cast<std::size_t>(twin)].q)] = q[joint.q];
  }
  robot.set_state(position, rest);
  return std::ranges::all_of(
      pairs(), [&](const Pair& pair) { return std::ranges::find(start_, pair) != start_.end(); });
}

std::vector<TwinTouch::Pair> TwinTouch::pairs() {
  std::vector<Contact> contacts;
  machine_.twin().engine().contacts(contacts);
  std::vector<Pair> out;
  for (const Contact& contact : contacts) out.emplace_back(contact.a, contact.b);
  return out;
}

}  // namespace doppel
