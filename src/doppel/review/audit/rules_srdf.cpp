// The semantic descriptions (SRDF) that planners read with the robot: names, groups, states, and the pairs of
// links that they leave out of collision checking.
#include <algorithm>
#include <map>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/robot/semantics/self_collision.h"
#include "doppel/robot/semantics/srdf_groups.h"
#include "doppel/scenario/resolve/srdf_search.h"

namespace doppel::audit_rules {
namespace {

constexpr std::size_t kMaxTriangles = 30000;  // of the links of one SRDF whose hulls touch
constexpr int kPairChecks = 4000;             // in one SRDF: an audit takes milliseconds
constexpr std::size_t kMaxShownPairs = 10;
constexpr std::size_t kMaxUnknown = 50;   // names reported for one SRDF
constexpr double kLimitTolerance = 1e-4;  // rad or m, as MoveIt's start state check

class SrdfCheck {
 public:
  SrdfCheck(const AuditInput& input, const SrdfDescription& srdf, Findings& out)
      : input_(input),
        model_(*input.model),
        srdf_(srdf),
        out_(out),
        links_(link_names(input.robot)),
        joints_(joint_names(input.robot)) {
    for (const SrdfGroup& group : srdf.groups) groups_.push_back(group.name);
  }

  void check() {
    check_names();
    for (const SrdfGroup& group : srdf_.groups) check_group(group);
    for (const SrdfGroupState& state : srdf_.states) check_state(state);
    for (const SrdfEndEffector& effector : srdf_.end_effectors) check_end_effector(effector);
    check_pairs();
  }

 private:
  // Each name once: a link that a variant of the robot does not have is in dozens of pairs.
  void name(const char* kind, const std::string& name, const Names& names, const std::string& subject,
            const SourceLocation& where) {
    if (contains(names, name) || unknown_.size() == kMaxUnknown || !unknown_.insert(name).second) return;
    out_.add("srdf.unknown_name", subject, where,
             fmt::format("'{}' is not a {} of this robot{}", name, kind, did_you_mean(name, names)),
             "correct the name, or remove the element");
  }
  void link(const std::string& name, const std::string& subject, const SourceLocation& where) {
    this->name("link", name, links_, subject, where);
  }
  void joint(const std::string& name, const std::string& subject, const SourceLocation& where) {
    this->name("joint", name, joints_, subject, where);
  }

  static std::string subject(const SrdfGroup& group) { return fmt::format("group '{}'", group.name); }
  static std::string subject(const SrdfGroupState& state) {
    return fmt::format("state '{}' of group '{}'", state.name, state.group);
  }
  static std::string subject(const SrdfEndEffector& effector) {
    return fmt::format("end effector '{}'", effector.name);
  }

  void check_names() {
    for (const SrdfVirtualJoint& one : srdf_.virtual_joints) {
      joints_.push_back(one.name);  // groups and states may name it
      link(one.child_link, fmt::format("virtual joint '{}'", one.name), one.source);
    }
    for (const SrdfReference& one : srdf_.passive_joints) joint(one.name, "a passive joint", one.source);
    for (const SrdfJointProperty& one : srdf_.properties) joint(one.joint, "a joint property", one.source);
    for (const SrdfReference& one : srdf_.unchecked_links) link(one.name, "an unchecked link", one.source);
    for (const SrdfSpheres& one : srdf_.spheres) link(one.link, "a cover of spheres", one.source);
    for (const auto* pairs : {&srdf_.disabled, &srdf_.enabled}) {
      for (const SrdfLinkPair& one : *pairs) {
        link(one.link1, "a pair of links", one.source);
        link(one.link2, "a pair of links", one.source);
      }
    }
  }

  void check_group(const SrdfGroup& group) {
    for (const SrdfReference& one : group.links) link(one.name, subject(group), one.source);
    for (const SrdfReference& one : group.joints) joint(one.name, subject(group), one.source);
    for (const SrdfReference& one : group.groups)
      name("group", one.name, groups_, subject(group), one.source);
    for (const SrdfChain& chain : group.chains) check_chain(chain, group);
    if (std::ranges::count(groups_, group.name) > 1 && &group != srdf_.find_group(group.name)) {
      out_.add("srdf.duplicate_group", subject(group), group.source, "another group has this name",
               "rename one of them, or join them");
    }
    if (contains_itself(group, srdf_)) {
      out_.add("srdf.group_loop", subject(group), group.source, "the group contains itself",
               "remove one of the groups in it");
    } else if (joints_of(group, srdf_, model_).empty() && !names_virtual_joint(group)) {
      out_.add("srdf.empty_group", subject(group), group.source, "no joint of the group moves",
               "name its joints, or a chain from its base to its tip");
    }
  }

  [[nodiscard]] bool names_virtual_joint(const SrdfGroup& group) const {
    return std::ranges::any_of(group.joints, [this](const SrdfReference& joint) {
      return std::ranges::find(srdf_.virtual_joints, joint.name, &SrdfVirtualJoint::name) !=
             srdf_.virtual_joints.end();
    });
  }

  void check_chain(const SrdfChain& chain, const SrdfGroup& group) {
    link(chain.base_link, subject(group), chain.source);
    link(chain.tip_link, subject(group), chain.source);
    const int base = model_.find_link(chain.base_link), tip = model_.find_link(chain.tip_link);
    if (base < 0 || tip < 0 || joints_between(model_, base, tip)) return;
    const bool reversed = joints_between(model_, tip, base).has_value();
    out_.add("srdf.chain", subject(group), chain.source,
             fmt::format("'{}' is not below '{}'{}", chain.tip_link, chain.base_link,
                         reversed ? ": the two are exchanged" : ""),
             reversed ? "exchange base_link and tip_link" : "name a base_link above the tip");
  }

  void check_state(const SrdfGroupState& state) {
    name("group", state.group, groups_, subject(state), state.source);
    const SrdfGroup* group = srdf_.find_group(state.group);
    if (group == nullptr) return;
    const std::vector<int> joints = joints_of(*group, srdf_, model_);
    for (const SrdfJointValue& value : state.values) {
      joint(value.joint, subject(state), value.source);
      const int index = model_.find_joint(value.joint);
      if (index >= 0) check_value(value, index, std::ranges::count(joints, index) != 0, state);
    }
  }

  void check_value(const SrdfJointValue& value, int index, bool in_group, const SrdfGroupState& state) {
    const ModelJoint& joint = model_.joints[static_cast<std::size_t>(index)];
    const auto report = [&](const std::string& message, const char* fix) {
      out_.add("srdf.state", subject(state), value.source, message, fix);
    };
    if (!in_group && joint.type != JointType::fixed)
      return report(fmt::format("the joint '{}' is not in the group", joint.name),
                    "remove it, or add it there");
    if (static_cast<int>(value.values.size()) != joint.nq) {
      if (joint.type != JointType::fixed)
        report(fmt::format("'{}' has {} position{}, and {} are written", joint.name, joint.nq,
                           joint.nq == 1 ? "" : "s", value.values.size()),
               "write as many values as the joint has positions");
      return;
    }
    if (!joint.scalar()) return;
    const double q = value.values.front();
    if (q >= joint.lower - kLimitTolerance && q <= joint.upper + kLimitTolerance) return;
    report(fmt::format("{:g} is outside the limits of '{}', {:g} to {:g}", q, joint.name, joint.lower,
                       joint.upper),
           "write a value inside the limits");
  }

  void check_end_effector(const SrdfEndEffector& effector) {
    link(effector.parent_link, subject(effector), effector.source);
    name("group", effector.group, groups_, subject(effector), effector.source);
    if (!effector.parent_group.empty())
      name("group", effector.parent_group, groups_, subject(effector), effector.source);
    const SrdfGroup* const hand = srdf_.find_group(effector.group);
    const SrdfGroup* const arm = srdf_.find_group(effector.parent_group);
    if (hand == nullptr || arm == nullptr) return;
    const std::vector<int> of_hand = joints_of(*hand, srdf_, model_), of_arm = joints_of(*arm, srdf_, model_);
    for (const int joint : of_hand) {
      if (std::ranges::count(of_arm, joint) == 0) continue;
      out_.add("srdf.end_effector", subject(effector), effector.source,
               fmt::format("its group and the parent group share the joint '{}'",
                           model_.joints[static_cast<std::size_t>(joint)].name),
               "remove the joint from one of the two groups");
      return;
    }
  }

  // -- pairs
  using LinkIndices = std::pair<int, int>;
  [[nodiscard]] LinkIndices indices(const SrdfLinkPair& pair) const {
    return std::minmax({model_.find_link(pair.link1), model_.find_link(pair.link2)});
  }

  void check_pairs() {
    std::map<LinkIndices, const SrdfLinkPair*> never;
    for (const SrdfLinkPair& pair : srdf_.disabled) {
      const LinkIndices links = indices(pair);
      const bool both = has_shape(links.first) && has_shape(links.second) && links.first != links.second;
      if (both && pair.reason == "Never") never.emplace(links, &pair);
    }
    if (never.empty()) return;
    SelfCollisionOptions options;
    options.samples = kPairChecks / static_cast<int>(never.size());
    options.detail = CollisionDetail::hulls;
    std::vector<LinkIndices> pairs;
    for (const auto& [links, written] : never) pairs.push_back(links);
    // The triangles of links whose hulls never touch are not read.
    pairs = affordable(find_touching(input_.robot, model_, pairs, options));
    if (pairs.empty()) return;
    options.detail = CollisionDetail::triangles;
    for (const TouchingPair& pair : find_touching(input_.robot, model_, pairs, options))
      report_hidden(pair, *never.at({pair.link_a, pair.link_b}));
  }

  [[nodiscard]] const Link* described(int link) const {
    return input_.robot.find_link(model_.links[static_cast<std::size_t>(link)].name);
  }
  [[nodiscard]] bool has_shape(int link) const {
    const Link* const found = link < 0 ? nullptr : described(link);
    return found != nullptr && !found->collisions.empty();
  }

  // The first ones whose triangles are read in a few milliseconds.
  [[nodiscard]] std::vector<LinkIndices> affordable(const std::vector<TouchingPair>& touching) const {
    std::set<int> read;
    std::size_t triangles = 0;
    std::vector<LinkIndices> out;
    for (const TouchingPair& pair : touching) {
      for (const int link : {pair.link_a, pair.link_b}) {
        if (read.insert(link).second) triangles += collision_triangles(*described(link));
      }
      if (triangles > kMaxTriangles || out.size() == kMaxShownPairs) break;
      out.emplace_back(pair.link_a, pair.link_b);
    }
    return out;
  }

  void report_hidden(const TouchingPair& pair, const SrdfLinkPair& written) {
    std::string pose;
    for (const ModelJoint& joint : model_.joints) {
      const bool between = joint.scalar() && !joint.mimics() && separates(joint, pair);
      if (between)
        pose += fmt::format("{}{} = {:.3g}", pose.empty() ? "" : ", ", joint.name, pair.q[joint.q]);
    }
    out_.add("srdf.hidden_collision", fmt::format("links '{}' and '{}'", written.link1, written.link2),
             written.source,
             fmt::format("the file states that they never touch, and they touch{}{}",
                         pose.empty() ? "" : " at ", pose),
             "remove the pair, or find the pairs again with: doppel convert FILE --to srdf");
  }

  // True if the joint is between the two links.
  [[nodiscard]] bool separates(const ModelJoint& joint, const TouchingPair& pair) const {
    return joints_between(model_, joint.child_link, pair.link_a).has_value() !=
           joints_between(model_, joint.child_link, pair.link_b).has_value();
  }

  const AuditInput& input_;
  const Model& model_;
  const SrdfDescription& srdf_;
  Findings& out_;
  Names links_, joints_, groups_;
  std::set<std::string> unknown_;  // reported names
};

}  // namespace

void check_srdf(const AuditInput& input, Findings& out) {
  if (input.model == nullptr) return;
  PackageResolver resolver = input.resolver;
  Diagnostics skipped;
  for (const FoundSrdf& found :
       find_srdf(input.robot, {input.expanded.file, input.options.package_folder}, resolver, skipped)) {
    for (const Diagnostic& d : found.diagnostics.all())
      out.add(d.rule, d.severity, found.file.filename().string(), d.where, d.message, d.fix);
    SrdfCheck(input, found.srdf, out).check();
    check_srdf_covers(input, found.srdf, out);
  }
  report_skipped(skipped, out);
}

}  // namespace doppel::audit_rules
