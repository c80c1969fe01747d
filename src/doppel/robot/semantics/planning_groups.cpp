#include "doppel/robot/semantics/planning_groups.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <set>

#include "doppel/base/core/text.h"
#include "doppel/base/core/unique_name.h"

namespace doppel {
namespace {

constexpr const char* kGripperWords[] = {"grip", "finger", "hand", "jaw", "knuckle", "thumb", "claw"};
// A link with one of these names may be the body of a gripper, which the last joint of the arm moves.
constexpr const char* kPalmWords[] = {"grip", "hand"};
constexpr const char* kFingerWords[] = {"finger", "jaw", "knuckle", "thumb", "claw"};
constexpr std::size_t kMinFinger = 3;  // driven joints one after another, in a hand without an arm
constexpr const char* kTipWords[] = {"tcp", "tool0", "tool", "flange", "ee", "end_effector", "grasp", "tip"};

// The parts of a body, by words of which each joint of a group has one.
struct BodyPart {
  const char* name;
  std::vector<std::string> words;
};
const BodyPart kBodyParts[] = {
    {"arm", {"arm", "shoulder", "elbow", "wrist"}},
    {"leg", {"leg", "hip", "knee", "ankle", "thigh", "calf", "haa", "hfe", "kfe"}},
    {"head", {"head", "neck"}},
    {"torso", {"torso", "waist", "trunk", "spine"}},
    {"caster", {"caster"}},
    {"wheel", {"wheel", "suspension"}},
};
// The sides of a name: whole words of it, of legs also those of four-legged robots.
struct SideWord {
  const char *word, *side;
  bool of_legs;
};
constexpr SideWord kSideWords[] = {
    {"l", "left", false},        {"r", "right", false},       {"lh", "rear_left", true},
    {"rh", "rear_right", true},  {"fl", "front_left", true},  {"lf", "front_left", true},
    {"fr", "front_right", true}, {"rf", "front_right", true}, {"rl", "rear_left", true},
    {"rr", "rear_right", true},  {"lh", "left", false},       {"rh", "right", false},
};

// The words of a name in lower case: "LShoulder_pitch" has l, shoulder and pitch.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> out(1);
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto is = [&name](std::size_t k, int (*kind)(int)) {
      return k < name.size() && kind(static_cast<unsigned char>(name[k])) != 0;
    };
    const bool begins = is(i, std::isupper) && i > 0 && (is(i - 1, std::islower) || is(i + 1, std::islower));
    if (!is(i, std::isalnum) || begins) out.emplace_back();
    if (is(i, std::isalnum)) out.back() += lowered(name.substr(i, 1));
  }
  std::erase(out, "");
  return out;
}

// "r", or the same before a part of the body: "rarm".
bool is_side(const std::string& word, const std::string& side) {
  if (!word.starts_with(side)) return false;
  const std::string rest = word.substr(side.size());
  return rest.empty() || std::ranges::any_of(kBodyParts, [&rest](const BodyPart& part) {
           return std::ranges::find(part.words, rest) != part.words.end();
         });
}

template <std::size_t count>
bool has_word(const std::string& text, const char* const (&words)[count]) {
  const std::string small = lowered(text);
  return std::any_of(std::begin(words), std::end(words),
                     [&small](const char* word) { return small.find(word) != std::string::npos; });
}

class Finder {
 public:
  explicit Finder(const Model& model) : model_(model), below_(model.links.size()) {
    for (std::size_t i = 0; i < model.joints.size(); ++i)
      below_[model.joints[i].parent_link].push_back(static_cast<int>(i));
  }

  std::vector<PlanningGroup> run(const std::vector<JointGroup>& controllers) {
    for (const JointGroup& controller : controllers) take_controller(controller);
    if (groups_.empty()) take_tree();
    for (PlanningGroup& group : groups_) finish(group);
    name_groups();
    join_grippers();
    return std::move(groups_);
  }

 private:
  [[nodiscard]] bool driven(int joint) const {
    return model_.joints[joint].scalar() && !model_.joints[joint].mimics();
  }
  [[nodiscard]] int parent_joint(int joint) const {
    return model_.links[model_.joints[joint].parent_link].joint;
  }

  // The nearest joint above that moves; -1: none.
  [[nodiscard]] int moving_above(int joint) const {
    int at = parent_joint(joint);
    while (at >= 0 && model_.joints[at].type == JointType::fixed) at = parent_joint(at);
    return at;
  }

  // The nearest joint above that moves by itself; mimic joints between them move with another one. -1: none.
  [[nodiscard]] int driven_above(int joint) const {
    int above = moving_above(joint);
    while (above >= 0 && model_.joints[above].mimics()) above = moving_above(above);
    return above;
  }

  // True if a driven joint besides `joints` is below this one.
  [[nodiscard]] bool carries_more(int joint, const std::vector<int>& joints) const {
    for (int other = joint + 1; other < static_cast<int>(model_.joints.size()); ++other) {
      if (driven(other) && is_above(joint, other) &&
          std::find(joints.begin(), joints.end(), other) == joints.end())
        return true;
    }
    return false;
  }

  void take_controller(const JointGroup& controller) {
    PlanningGroup group;
    for (const std::string& name : controller.joints) {
      const int joint = model_.find_joint(name);
      if (joint >= 0 && model_.joints[joint].scalar()) group.joints.push_back(joint);
    }
    std::sort(group.joints.begin(), group.joints.end());
    if (group.joints.empty()) return;
    const bool same = std::any_of(groups_.begin(), groups_.end(), [&group](const PlanningGroup& other) {
      return other.joints == group.joints;
    });
    if (same) return;
    group.name = controller.name;
    group.gripper = has_word(controller.name, kGripperWords) || looks_like_gripper(group.joints);
    PlanningGroup fingers = group.gripper ? PlanningGroup{} : split_gripper(group);
    groups_.push_back(std::move(group));
    if (!fingers.joints.empty()) groups_.push_back(std::move(fingers));
  }

  // True if a joint beside this one mimics it, as one finger does the other.
  [[nodiscard]] bool leads_sibling(int leader) const {
    return std::any_of(model_.joints.begin(), model_.joints.end(), [this, leader](const ModelJoint& j) {
      return j.mimic_leader == leader && j.parent_link == model_.joints[leader].parent_link;
    });
  }

  // One controller for an arm and its gripper: the last joints that lead a mimic joint are the gripper.
  [[nodiscard]] PlanningGroup split_gripper(PlanningGroup& arm) const {
    PlanningGroup out;
    out.gripper = true;
    while (arm.joints.size() > 2 && leads_sibling(arm.joints.back())) {
      out.joints.insert(out.joints.begin(), arm.joints.back());
      arm.joints.pop_back();
    }
    return out;
  }

  [[nodiscard]] bool is_named_gripper(int joint, const std::vector<int>& joints) const {
    const std::string& child = model_.links[model_.joints[joint].child_link].name;
    if (has_word(model_.joints[joint].name, kGripperWords) || has_word(child, kFingerWords)) return true;
    return has_word(child, kPalmWords) && !carries_more(joint, joints);
  }

  // All names are those of grippers, or there are at most two joints and one of them leads a mimic joint, and
  // they move nothing but the gripper.
  [[nodiscard]] bool looks_like_gripper(const std::vector<int>& joints) const {
    const bool named =
        std::all_of(joints.begin(), joints.end(), [&](int joint) { return is_named_gripper(joint, joints); });
    if (named || joints.size() > 2) return named;
    const bool leads =
        std::any_of(model_.joints.begin(), model_.joints.end(), [&joints](const ModelJoint& j) {
          return j.mimics() && std::find(joints.begin(), joints.end(), j.mimic_leader) != joints.end();
        });
    return leads &&
           std::none_of(joints.begin(), joints.end(), [&](int joint) { return carries_more(joint, joints); });
  }

  // The joints of grippers, and all that move below them. None if that is the whole robot and it has fingers
  // of several joints: a hand alone, whose fingers are its arms.
  [[nodiscard]] std::set<int> gripper_joints() const {
    std::set<int> out;
    bool any_arm = false;
    std::size_t longest = 0;
    std::vector<std::size_t> depth(model_.joints.size(), 0);
    for (int joint = 0; joint < static_cast<int>(model_.joints.size()); ++joint) {
      if (!driven(joint)) continue;
      const int above = driven_above(joint);
      depth[joint] = above < 0 ? 1 : depth[above] + 1;
      longest = std::max(longest, depth[joint]);
      if (out.contains(above) || looks_like_gripper({joint})) {
        out.insert(joint);
      } else {
        any_arm = true;
      }
    }
    return any_arm || longest < kMinFinger ? out : std::set<int>{};
  }

  // Gripper joints first: for a joint that looks like one, all moving joints below its siblings' parent. The
  // remaining joints form chains between branches.
  void take_tree() {
    const std::set<int> grippers = gripper_joints();
    std::vector<std::vector<int>> hands;
    for (const int joint : grippers) {
      const auto with = std::find_if(hands.begin(), hands.end(), [&](const std::vector<int>& hand) {
        const int above = driven_above(joint);
        return above == driven_above(hand.front()) || std::count(hand.begin(), hand.end(), above) != 0;
      });
      (with == hands.end() ? hands.emplace_back() : *with).push_back(joint);
    }
    std::vector<int> moving_children(model_.joints.size() + 1, 0);  // by the joint above, shifted by one
    const auto in_arm = [&](int joint) { return driven(joint) && !grippers.contains(joint); };
    for (int joint = 0; joint < static_cast<int>(model_.joints.size()); ++joint) {
      if (in_arm(joint)) ++moving_children[driven_above(joint) + 1];
    }
    std::vector<int> chain_of(model_.joints.size(), -1);
    std::vector<std::vector<int>> chains;
    for (int joint = 0; joint < static_cast<int>(model_.joints.size()); ++joint) {
      if (!in_arm(joint)) continue;
      const int above = driven_above(joint);
      const bool continues = above >= 0 && chain_of[above] >= 0 && moving_children[above + 1] == 1;
      if (!continues) chains.emplace_back();
      chain_of[joint] = continues ? chain_of[above] : static_cast<int>(chains.size()) - 1;
      chains[chain_of[joint]].push_back(joint);
    }
    for (std::vector<int>& chain : chains) {
      const bool wheel = chain.size() == 1 && model_.joints[chain[0]].type == JointType::continuous;
      if (!wheel) groups_.push_back({"", false, std::move(chain)});
    }
    for (std::vector<int>& hand : hands) groups_.push_back({"", true, std::move(hand)});
  }

  void finish(PlanningGroup& group) {
    if (group.gripper) {
      for (int joint = 0; joint < static_cast<int>(model_.joints.size()); ++joint) {
        const int leader = model_.joints[joint].mimic_leader;
        if (leader >= 0 && std::count(group.joints.begin(), group.joints.end(), leader) != 0 &&
            std::count(group.joints.begin(), group.joints.end(), joint) == 0) {
          group.joints.push_back(joint);
        }
      }
      std::sort(group.joints.begin(), group.joints.end());
      group.parent_link = seat(group.joints.front());
      return;
    }
    for (std::size_t i = 1; i < group.joints.size(); ++i) {
      if (!is_above(group.joints[i - 1], group.joints[i])) return;  // no chain: a set of joints
    }
    group.base_link = model_.joints[group.joints.front()].parent_link;
    group.tip_link = tip_of(model_.joints[group.joints.back()].child_link);
  }

  [[nodiscard]] bool is_above(int upper, int joint) const {
    for (int at = parent_joint(joint); at >= 0; at = parent_joint(at)) {
      if (at == upper) return true;
    }
    return false;
  }

  // The link that the gripper's body is fixed to: the child of the last joint that moves above it.
  [[nodiscard]] int seat(int joint) const {
    const int above = moving_above(joint);
    return above < 0 ? 0 : model_.joints[above].child_link;
  }

  // Follows fixed joints to a frame with the name of a tip, if there is one; links of a gripper are excluded.
  [[nodiscard]] int tip_of(int link) const {
    int best = link;
    std::size_t best_word = std::size(kTipWords);
    std::vector<int> open{link};
    for (std::size_t i = 0; i < open.size(); ++i) {
      const std::string name = lowered(model_.links[open[i]].name);
      for (std::size_t w = 0; open[i] != link && w < best_word; ++w) {
        const std::string word = kTipWords[w];
        const bool whole = name == word || name.ends_with("_" + word) ||
                           name.ends_with("_" + word + "_link") || name == word + "_link" ||
                           name.starts_with(word + "_");
        if (whole) {
          best = open[i];
          best_word = w;
        }
      }
      for (const int joint : below_[open[i]]) {
        if (model_.joints[joint].type == JointType::fixed) open.push_back(model_.joints[joint].child_link);
      }
    }
    return best;
  }

  // Joints side by side that turn without limits.
  [[nodiscard]] bool are_wheels(const PlanningGroup& group) const {
    return !group.gripper && group.tip_link < 0 &&
           std::all_of(group.joints.begin(), group.joints.end(),
                       [this](int joint) { return model_.joints[joint].type == JointType::continuous; });
  }

  // "gripper", "wheels", or the part of the body of which most joints have a word in their names or those of
  // their links; "arm" if there is none.
  [[nodiscard]] std::string kind_of(const PlanningGroup& group) const {
    if (group.gripper) return "gripper";
    if (are_wheels(group)) return "wheels";
    std::string out = "arm";
    std::size_t most = group.joints.size() / 2;
    for (const BodyPart& part : kBodyParts) {
      const auto count = static_cast<std::size_t>(std::ranges::count_if(group.joints, [&](int joint) {
        const ModelJoint& moved = model_.joints[joint];
        const std::string names = lowered(moved.name + " " + model_.links[moved.child_link].name);
        return std::ranges::any_of(
            part.words, [&](const std::string& word) { return names.find(word) != std::string::npos; });
      }));
      if (count <= most) continue;
      most = count;
      out = part.name;
    }
    return out;
  }

  // The kind alone where there is one of it; else with the side that all its joints have in their names, or a
  // number.
  void name_groups() {
    std::map<std::string, int> counts;
    for (const PlanningGroup& group : groups_) ++counts[kind_of(group)];
    std::vector<std::string> taken;
    for (PlanningGroup& group : groups_) {
      const std::string kind = kind_of(group);
      const std::string prefix = counts[kind] > 1 ? side_of(group, kind == "leg") : "";
      group.name = unique_name(prefix.empty() ? kind : prefix + "_" + kind, taken);
    }
  }

  [[nodiscard]] std::string side_of(const PlanningGroup& group, bool is_leg) const {
    for (const char* side : {"left", "right", "front", "rear", "back"}) {
      if (lowered(group.name).find(side) != std::string::npos) return side;
      const bool all = std::all_of(group.joints.begin(), group.joints.end(), [&](int joint) {
        return lowered(model_.joints[joint].name).find(side) != std::string::npos;
      });
      if (all) return side;
    }
    for (const SideWord& one : kSideWords) {
      if (one.of_legs && !is_leg) continue;
      const bool all = std::all_of(group.joints.begin(), group.joints.end(), [&](int joint) {
        return std::ranges::any_of(words_of(model_.joints[joint].name),
                                   [&one](const std::string& word) { return is_side(word, one.word); });
      });
      if (all) return one.side;
    }
    return "";
  }

  void join_grippers() {
    for (PlanningGroup& group : groups_) {
      if (!group.gripper) continue;
      for (std::size_t i = 0; i < groups_.size(); ++i) {
        const PlanningGroup& arm = groups_[i];
        if (arm.gripper || arm.tip_link < 0) continue;
        if (model_.joints[arm.joints.back()].child_link == group.parent_link)
          group.parent_group = static_cast<int>(i);
      }
    }
  }

  const Model& model_;
  std::vector<std::vector<int>> below_;  // joints below each link
  std::vector<PlanningGroup> groups_;
};

}  // namespace

std::vector<PlanningGroup> find_planning_groups(const Model& model,
                                                const std::vector<JointGroup>& controllers) {
  return Finder(model).run(controllers);
}

}  // namespace doppel
