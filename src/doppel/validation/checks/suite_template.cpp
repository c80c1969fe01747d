#include "doppel/validation/checks/suite_template.h"

#include <fmt/format.h>

#include <cmath>

#include "doppel/base/yaml/yaml_text.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/validation/checks/suite.h"

namespace doppel {
namespace {

// The largest cube within the reach of the arm, in the root link, m.
std::string workspace_line(const Subject& subject) {
  if (subject.arms.empty())
    return "# workspace: {box: [[-0.3, -0.3, 0.0], [0.3, 0.3, 0.4]], step: 50 mm, directions: 26}\n";
  const Chain& chain = subject.arms.front().chain;
  Data data(*subject.model);
  forward_kinematics(*subject.model, data, subject.model->neutral());
  const Eigen::Vector3d centre =
      data.X_WL[static_cast<std::size_t>(chain.base_link)] * chain.joints.front().X_PZ.translation();
  const double half = chain.length / std::sqrt(3.0);
  const Eigen::Vector3d low = centre - Eigen::Vector3d::Constant(half);
  const Eigen::Vector3d high = centre + Eigen::Vector3d::Constant(half);
  constexpr int kCells = 8;
  return fmt::format(
      "# workspace: {{box: [[{:.3f}, {:.3f}, {:.3f}], [{:.3f}, {:.3f}, {:.3f}]], step: {:.0f} mm, "
      "directions: 26}}\n",
      low.x(), low.y(), low.z(), high.x(), high.y(), high.z(), std::ceil(1e3 * 2 * half / kCells));
}

std::string tool_line(const Subject& subject) {
  const std::string link =
      subject.arms.empty()
          ? subject.model->links.back().name
          : subject.model->links[static_cast<std::size_t>(subject.arms.front().chain.tip_link)].name;
  return fmt::format("# tool: {{link: {}, payload: {{mass: 0.2 kg, at: [0, 0, 0.06]}}}}\n", yaml_text(link));
}

std::string pose_line(const Subject& subject) {
  std::string joints;
  for (const std::string& name : subject.model->driven_joint_names()) {
    const bool slides =
        subject.model->joints[static_cast<std::size_t>(subject.model->find_joint(name))].type ==
        JointType::prismatic;
    joints += fmt::format("{}{}: 0 {}", joints.empty() ? "" : ", ", yaml_text(name), slides ? "mm" : "deg");
  }
  return fmt::format("# poses: {{home: {{{}}}}}\n", joints);
}

}  // namespace

std::string suite_template(const Subject& subject) {
  const Suite suite;
  std::string out = fmt::format(
      "# The suite of doppel validate for {}: what the machine is for, and by which limits it is judged.\n"
      "# Every key is optional; doppel man validate.md describes them.\n\n"
      "# The places that the tool has to reach and that sensors have to see. Without it a cube within the "
      "reach counts.\n",
      subject.name);
  out += workspace_line(subject);
  out += "\n# The load at the tool: steps are judged without and with it.\n" + tool_line(subject);
  out += "\n# Configurations that must be free of collisions.\n" + pose_line(subject);
  out += fmt::format(
      "\nstep_response: {{size: {:g} rad, overshoot: {:g} %, settling: {:g} s, error: {:g} rad}}\n"
      "#  \"one joint\": {{size: 0.3 rad}}   # beside them: limits of one joint\n"
      "reachability: {{max_missed: {:g} %}}\n"
      "# self_collision: {{max_share: 30 %}}   # of the configurations in which one pair touches\n"
      "# coverage: {{min_seen: 80 %}}          # of the workspace, by each sensor\n"
      "drop: {{settling: {:g} s, penetration: {:g} mm, deepest: {:g} mm, energy: {:g} %, rebound: {:g} %, "
      "spread: {:g} mm}}\n"
      "# datasheet: mg996r                  # a bundled one, or a file\n"
      "# waive: [{{gate: G05, link: base_link, why: \"scan of the real base\", until: 2027-06-01}}]\n",
      suite.step.size, 100 * suite.step.overshoot, suite.step.settling, suite.step.error,
      100 * suite.max_missed, suite.drop.settling, 1e3 * suite.drop.penetration, 1e3 * suite.drop.deepest,
      100 * suite.drop.energy, 100 * suite.drop.rebound, 1e3 * suite.drop.spread);
  return out;
}

}  // namespace doppel
