#include "doppel/description/urdf/legs.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "doppel/base/core/text.h"

namespace doppel {
namespace {

// Names of parts that only legs have: anywhere in a name, and as whole words.
constexpr std::array<std::string_view, 11> kLegParts{"knee",      "ankle",    "thigh",   "shank",
                                                     "tibia",     "femur",    "foot",    "upper_leg",
                                                     "lower_leg", "upperleg", "lowerleg"};
constexpr std::array<std::string_view, 8> kLegWords{"calf", "shin",   "haa", "hfe",
                                                    "kfe",  "tarsus", "leg", "legs"};
constexpr std::string_view kNoFoot = "footprint";

bool moves(const Joint& joint) {
  return joint.type == JointType::revolute || joint.type == JointType::continuous ||
         joint.type == JointType::prismatic;
}

bool is_leg_part(const std::string& name) {
  const std::string text = lowered(name);
  const bool part = std::any_of(kLegParts.begin(), kLegParts.end(),
                                [&](std::string_view one) { return text.find(one) != std::string::npos; });
  const std::vector<std::string> words = words_of_name(name);
  const bool word = std::any_of(words.begin(), words.end(), [](const std::string& one) {
    return std::find(kLegWords.begin(), kLegWords.end(), one) != kLegWords.end();
  });
  return (part || word) && text.find(kNoFoot) == std::string::npos;
}

bool has_word(const std::string& name, std::string_view word) {
  const std::vector<std::string> words = words_of_name(name);
  return std::find(words.begin(), words.end(), word) != words.end();
}

// "lower" is part of a leg behind a hip, and of an arm behind a shoulder.
bool is_lower_leg(const Joint& joint, const std::vector<const Joint*>& way) {
  const auto any = [](const Joint& of, std::string_view word) {
    return has_word(of.name, word) || has_word(of.child, word);
  };
  return any(joint, "lower") &&
         std::any_of(way.begin(), way.end(), [&](const Joint* at) { return any(*at, "hip"); });
}

}  // namespace

JointPaths::JointPaths(const RobotDescription& robot) {
  for (const Joint& joint : robot.joints) above_.emplace(joint.child, &joint);
}

std::vector<const Joint*> JointPaths::to_root(const Joint& joint) const {
  std::vector<const Joint*> out{&joint};
  while (out.size() <= above_.size()) {
    const auto up = above_.find(out.back()->parent);
    if (up == above_.end()) break;
    out.push_back(up->second);
  }
  return out;
}

// Links named as parts of a leg, behind two or more moving joints, which excludes the feet of a stand.
std::vector<std::string> legs_of(const RobotDescription& robot) {
  const JointPaths paths(robot);
  std::vector<std::string> out;
  for (const Joint& joint : robot.joints) {
    const bool named = is_leg_part(joint.name);
    const auto way = paths.to_root(joint);
    if (!named && !is_leg_part(joint.child) && !is_lower_leg(joint, way)) continue;
    const auto moving = std::count_if(way.begin(), way.end(), [](const Joint* at) { return moves(*at); });
    if (moving >= 2) out.push_back(named ? joint.name : joint.child);
  }
  return out;
}

std::vector<std::string> words_of_name(const std::string& name) {
  std::vector<std::string> out;
  std::string word;
  const auto end = [&] {
    if (!word.empty()) out.push_back(lowered(word));
    word.clear();
  };
  const auto upper = [&](std::size_t i) {
    return i < name.size() && std::isupper(static_cast<unsigned char>(name[i])) != 0;
  };
  const auto lower = [&](std::size_t i) {
    return i < name.size() && std::islower(static_cast<unsigned char>(name[i])) != 0;
  };
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!upper(i) && !lower(i)) {
      end();
      continue;
    }
    const bool begins = upper(i) && i > 0 && (lower(i - 1) || (upper(i - 1) && lower(i + 1)));
    if (begins) end();
    word += name[i];
  }
  end();
  return out;
}

}  // namespace doppel
