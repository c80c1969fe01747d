#include "doppel/robot/kinematics/model.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "doppel/base/core/names.h"
#include "doppel/robot/kinematics/detail/assumed_masses.h"
#include "doppel/robot/kinematics/link_inertia.h"
#include "doppel/robot/kinematics/link_masses.h"

namespace doppel {
namespace {

struct Counts {
  int nq, nv;
};

Counts counts(JointType type) {
  switch (type) {
    case JointType::fixed:
      return {0, 0};
    case JointType::floating:
      return {7, 6};
    case JointType::planar:
      return {3, 3};
    case JointType::revolute:
    case JointType::continuous:
    case JointType::prismatic:
      return {1, 1};
  }
  return {0, 0};
}

// One compilation: the description, the model under construction, and the lookups between them.
class Compiler {
 public:
  Compiler(const RobotDescription& robot, const LinkMasses& masses, Diagnostics& diagnostics)
      : robot_(robot), masses_(masses), diagnostics_(diagnostics) {
    model_.name = robot.name;
    for (const Link& link : robot.links) links_.emplace(link.name, &link);
    for (const Joint& joint : robot.joints) children_[joint.parent].push_back(&joint);
  }

  Model compile(BaseKind base) {
    const Link& root = find_root();
    // A floating base gets a link 'world' above the root and a joint of six degrees of freedom, so that no
    // algorithm needs a special case for it.
    if (base == BaseKind::floating) {
      if (links_.contains("world")) {
        throw InputError(
            "model.world_is_fixed", root.source,
            fmt::format("robot '{}' has a link 'world', which does not move, so its base cannot float",
                        robot_.name),
            "remove the link 'world' and the joint from it, or keep the base fixed");
      }
      model_.links.push_back({"world", -1, std::nullopt, false});
      sources_.push_back(nullptr);
      Joint floating;
      floating.name = root.name + "_floating";
      floating.type = JointType::floating;
      add_joint(floating, 0, root);
    } else {
      add_link(root, -1);
      add_subtree(root, 0);
    }
    if (static_cast<int>(sources_.size()) != link_count(base)) {
      throw InputError("model.not_a_tree", robot_.source,
                       fmt::format("only {} of robot '{}''s {} links are connected to '{}'", sources_.size(),
                                   robot_.name, robot_.links.size(), root.name));
    }
    resolve_mimics();
    check_masses();
    weigh();
    return std::move(model_);
  }

 private:
  [[nodiscard]] int link_count(BaseKind base) const {
    return static_cast<int>(robot_.links.size()) + (base == BaseKind::floating ? 1 : 0);
  }

  const Link& find_root() const {
    for (const Link& link : robot_.links) {
      const bool is_child = std::any_of(robot_.joints.begin(), robot_.joints.end(),
                                        [&](const Joint& joint) { return joint.child == link.name; });
      if (!is_child) return link;
    }
    throw InputError("model.not_a_tree", robot_.source,
                     fmt::format("robot '{}' has no root: every link is the child of a joint", robot_.name));
  }

  void add_link(const Link& link, int joint) {
    const bool weightless = std::any_of(
        robot_.gazebo.begin(), robot_.gazebo.end(),
        [&](const GazeboExtension& e) { return e.reference == link.name && e.gravity && !*e.gravity; });
    const auto mass = masses_.find(link.name);
    const auto inertia = mass != masses_.end() ? mass->second : link_inertia(link, diagnostics_);
    model_.links.push_back({link.name, joint, inertia, weightless});
    sources_.push_back(&link);
  }

  // Depth first, so that a subtree is one range of indices; MuJoCo orders bodies in the same way.
  void add_subtree(const Link& link, int index) {
    const auto found = children_.find(link.name);
    if (found == children_.end()) return;
    for (const Joint* joint : found->second) {
      const auto child = links_.find(joint->child);
      // More links than the description has means that a joint closes a loop, which this recursion would
      // follow without end.
      if (child == links_.end() || model_.links.size() > robot_.links.size()) {
        throw InputError("model.not_a_tree", joint->source,
                         fmt::format("joint '{}' does not have a child link of its own ('{}')", joint->name,
                                     joint->child));
      }
      add_joint(*joint, index, *child->second);
    }
  }

  void add_joint(const Joint& joint, int parent, const Link& child) {
    ModelJoint out;
    out.name = joint.name;
    const bool has_axis = joint.type != JointType::fixed && joint.type != JointType::floating;
    // A joint without an axis cannot move; the parser has warned of it.
    out.type = has_axis && !has_direction(joint) ? JointType::fixed : joint.type;
    out.parent_link = parent;
    out.child_link = static_cast<int>(model_.links.size());
    out.X_PJ = joint.origin.pose();
    if (has_axis && has_direction(joint)) out.axis = joint.axis.normalized();
    const Counts n = counts(out.type);
    out.q = model_.nq;
    out.nq = n.nq;
    out.v = model_.nv;
    out.nv = n.nv;
    model_.nq += n.nq;
    model_.nv += n.nv;
    if (out.type != JointType::fixed) set_limits(joint, out);
    set_stop(joint, out);
    joint_sources_.push_back(
        sources_.back() == nullptr ? nullptr : &joint);  // the added floating joint is not the user's
    const int index = static_cast<int>(model_.joints.size());
    model_.joints.push_back(std::move(out));
    add_link(child, index);
    add_subtree(child, model_.joints[index].child_link);
  }

  // A limit of 0, as some exporters write, would make the joint immovable, which is never intended.
  double limit_or_unlimited(const Joint& joint, const std::optional<double>& written, const char* what) {
    if (!written) return kInfinity;
    if (*written > 0) return *written;
    diagnostics_.warning(
        "model.zero_limit", joint.limits->source,
        fmt::format("joint '{}' has the {} limit {}, with which it cannot move; it is treated as unlimited",
                    joint.name, what, *written),
        fmt::format("write the drive's {} limit from its datasheet", what));
    return kInfinity;
  }

  void set_limits(const Joint& joint, ModelJoint& out) {
    if (joint.dynamics) {
      out.damping = not_negative(joint, joint.dynamics->damping, "damping");
      out.friction = not_negative(joint, joint.dynamics->friction, "friction");
    }
    if (joint.limits) {
      out.effort = limit_or_unlimited(joint, joint.limits->effort, "effort");
      out.velocity = limit_or_unlimited(joint, joint.limits->velocity, "velocity");
    }
    if (joint.type != JointType::revolute && joint.type != JointType::prismatic) return;
    if (!joint.limits || !joint.limits->has_position) {
      diagnostics_.warning(
          "model.no_limits", joint.source,
          fmt::format("joint '{}' has no position limits; it is treated as unlimited", joint.name),
          "write <limit lower=\"..\" upper=\"..\"/>, or type=\"continuous\" if it is unlimited");
      return;
    }
    // Crossed limits bound the same range; the parser has warned of them.
    out.lower = std::min(joint.limits->lower, joint.limits->upper);
    out.upper = std::max(joint.limits->lower, joint.limits->upper);
  }

  double not_negative(const Joint& joint, double written, const char* what) {
    if (written >= 0) return written;
    diagnostics_.warning("model.negative_dynamics", joint.source,
                         fmt::format("joint '{}' has the {} {}, which adds energy; it is read as 0",
                                     joint.name, what, written),
                         fmt::format("write the {} as a positive number", what));
    return 0.0;
  }

  // Stiffness and restitution may be written in different <gazebo> blocks of the same joint.
  void set_stop(const Joint& joint, ModelJoint& out) {
    std::optional<double> stiffness, restitution;
    SourceLocation where;
    for (const GazeboExtension& extension : robot_.gazebo) {
      if (extension.reference != joint.name || (!extension.stop_stiffness && !extension.stop_restitution))
        continue;
      if (extension.stop_stiffness) stiffness = extension.stop_stiffness;
      if (extension.stop_restitution) restitution = extension.stop_restitution;
      where = extension.source;
    }
    if (!stiffness && !restitution) return;
    std::string problem;
    if (!std::isfinite(out.lower) && !std::isfinite(out.upper)) {
      problem = fmt::format(
          "joint '{}' has no limits, so its <stopStiffness> and <stopRestitution> have no effect", out.name);
    } else if (!stiffness) {
      problem = fmt::format("joint '{}' has a <stopRestitution> without a <stopStiffness>; it has no effect",
                            out.name);
    } else if (!(*stiffness > 0 && *stiffness <= kStiffestStop)) {
      problem = fmt::format(
          "<stopStiffness> of joint '{}' is {}, but must be above 0 and at most {}; it has no effect",
          out.name, *stiffness, kStiffestStop);
    } else {
      out.stop_stiffness = *stiffness;
      if (restitution && *restitution >= 0 && *restitution <= 1) {
        out.stop_restitution = *restitution;
      } else if (restitution) {
        problem =
            fmt::format("<stopRestitution> of joint '{}' is {}, but must be from 0 to 1; {:.3g} is used",
                        out.name, *restitution, kCriticalRestitution);
      }
    }
    if (!problem.empty())
      diagnostics_.warning("model.limit_stop", where, problem,
                           "'doppel man physics.md' describes limit stops");
  }

  void resolve_mimics() {
    for (std::size_t i = 0; i < model_.joints.size(); ++i) {
      if (joint_sources_[i] == nullptr || !joint_sources_[i]->mimic) continue;
      resolve_mimic(model_.joints[i], *joint_sources_[i]);
    }
  }

  // The joint of a <mimic> without effect moves independently; the parser has warned of it.
  void resolve_mimic(ModelJoint& joint, const Joint& source) {
    // A chain of mimics is one relation to the joint that moves by itself: q = m1 (m2 q' + o2) + o1.
    const Joint* at = &source;
    while (const Joint* const leader = leader_of(robot_, *at)) {
      const Mimic& mimic = *at->mimic;
      joint.mimic_offset += joint.mimic_multiplier * mimic.offset;
      joint.mimic_multiplier *= mimic.multiplier;
      joint.mimic_leader = model_.find_joint(leader->name);
      at = leader;
    }
  }

  void check_masses() const {
    for (const auto& [name, mass] : masses_) {
      if (links_.contains(name)) continue;
      std::vector<std::string> names;
      for (const Link& link : robot_.links) names.push_back(link.name);
      throw InputError("model.unknown_link", robot_.source,
                       fmt::format("a mass is given for the link '{}', which '{}' does not have{}", name,
                                   robot_.name, did_you_mean(name, names)),
                       "correct the name of the link in the scenario's masses");
    }
  }

  void weigh() {
    assume_masses(model_, sources_, diagnostics_);
    for (const ModelLink& link : model_.links) model_.total_mass += link.inertia ? link.inertia->mass : 0.0;
  }

  const RobotDescription& robot_;
  const LinkMasses& masses_;
  Diagnostics& diagnostics_;
  Model model_;
  std::map<std::string, const Link*> links_;
  std::map<std::string, std::vector<const Joint*>> children_;
  std::vector<const Link*> sources_;         // [links]; null: the added world
  std::vector<const Joint*> joint_sources_;  // [joints]
};

template <typename Named>
int find_by_name(const std::vector<Named>& all, std::string_view name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
  return found == all.end() ? -1 : static_cast<int>(found - all.begin());
}

}  // namespace

int Model::find_joint(std::string_view joint_name) const {
  return find_by_name(joints, joint_name);
}

int Model::find_link(std::string_view link_name) const {
  return find_by_name(links, link_name);
}

std::optional<std::vector<int>> joints_between(const Model& model, int base_link, int tip_link) {
  std::vector<int> out;
  if (base_link < 0) return std::nullopt;
  for (int link = tip_link; link >= 0;) {
    if (link == base_link) {
      std::reverse(out.begin(), out.end());
      return out;
    }
    const int joint = model.links[static_cast<std::size_t>(link)].joint;
    if (joint < 0) break;
    out.push_back(joint);
    link = model.joints[static_cast<std::size_t>(joint)].parent_link;
  }
  return std::nullopt;
}

std::vector<std::string> Model::link_names() const {
  std::vector<std::string> names;
  for (const ModelLink& link : links) names.push_back(link.name);
  return names;
}

std::vector<std::string> Model::scalar_joint_names() const {
  std::vector<std::string> names;
  for (const ModelJoint& joint : joints) {
    if (joint.scalar()) names.push_back(joint.name);
  }
  return names;
}

std::vector<std::string> Model::driven_joint_names() const {
  std::vector<std::string> names;
  for (const ModelJoint& joint : joints) {
    if (joint.scalar() && !joint.mimics()) names.push_back(joint.name);
  }
  return names;
}

Eigen::VectorXd Model::neutral() const {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nq);
  for (const ModelJoint& joint : joints) {
    // Zero may be outside of the limits, as for a gripper that is open at 0.04 to 0.08 m.
    if (joint.scalar()) q[joint.q] = std::clamp(0.0, joint.lower, joint.upper);
    if (joint.type == JointType::floating) q[joint.q + 6] = 1.0;
  }
  apply_mimics(q);
  return q;
}

void Model::apply_mimics(Eigen::Ref<Eigen::VectorXd> q) const {
  for (const ModelJoint& joint : joints) {
    if (joint.mimics())
      q[joint.q] = joint.mimic_multiplier * q[joints[joint.mimic_leader].q] + joint.mimic_offset;
  }
}

Model compile_model(const RobotDescription& robot, BaseKind base, Diagnostics& diagnostics) {
  return compile_model(robot, base, {}, diagnostics);
}

Model compile_model(const RobotDescription& robot, BaseKind base, const LinkMasses& masses,
                    Diagnostics& diagnostics) {
  return Compiler(robot, masses, diagnostics).compile(base);
}

LinkMasses masses_not_written(const RobotDescription& robot, const Model& model) {
  LinkMasses out;
  for (const ModelLink& link : model.links) {
    const Link* const source = robot.find_link(link.name);
    Diagnostics reported;  // when the model was compiled
    if (source != nullptr && link.inertia && !link_inertia(*source, reported))
      out.emplace(link.name, *link.inertia);
  }
  return out;
}

Data::Data(const Model& model)
    : X_WL(model.links.size(), Pose::Identity()),
      V_WL(model.links.size(), Eigen::Matrix<double, 6, 1>::Zero()),
      A_WL(model.links.size(), Eigen::Matrix<double, 6, 1>::Zero()),
      g_L(model.links.size(), Eigen::Vector3d::Zero()),
      F_L(model.links.size(), Eigen::Matrix<double, 6, 1>::Zero()),
      tau(Eigen::VectorXd::Zero(model.nv)),
      zero_v(Eigen::VectorXd::Zero(model.nv)),
      X_PL(model.links.size(), Pose::Identity()),
      composite(model.links.size(), Eigen::Matrix<double, 6, 6>::Zero()),
      M(Eigen::MatrixXd::Zero(model.nv, model.nv)) {}

}  // namespace doppel
