#include "doppel/review/audit/detail/vocabulary.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "doppel/base/core/names.h"

namespace doppel::audit_rules {
namespace {

constexpr Content kText = Content::text, kOpen = Content::open;

// The longest matching path applies: "ros2_control/joint" before "joint".
constexpr std::array kKinds{
    ElementKind{"robot", "name version",
                "link joint material gazebo ros2_control transmission sensor plugin mujoco "
                "group group_state disable_collisions end_effector virtual_joint passive_joint",
                ""},
    // -- links
    ElementKind{"link", "name type", "inertial visual collision collision_checking self_collide contact",
                "inertial"},
    ElementKind{"inertial", "", "origin mass inertia", "origin mass inertia"},
    ElementKind{"mass", "value", "", ""}, ElementKind{"inertia", "ixx ixy ixz iyy iyz izz", "", ""},
    ElementKind{"origin", "xyz rpy quat_xyzw", "", ""},
    ElementKind{"visual", "name", "origin geometry material", "origin geometry material"},
    ElementKind{"collision", "name group concave", "origin geometry verbose contact_coefficients surface",
                "origin geometry"},
    ElementKind{"verbose", "value", "", ""}, ElementKind{"contact_coefficients", "mu kd kp", "", ""},
    ElementKind{"surface", "", "", "", kOpen}, ElementKind{"collision_checking", "", "", "", kOpen},
    ElementKind{"contact", "", "", "", kOpen}, ElementKind{"self_collide", "", "", "", kText},
    ElementKind{"geometry", "", "box cylinder capsule sphere mesh", ""}, ElementKind{"box", "size", "", ""},
    ElementKind{"cylinder", "radius length", "", ""}, ElementKind{"capsule", "radius length", "", ""},
    ElementKind{"sphere", "radius", "", ""}, ElementKind{"mesh", "filename scale", "", ""},
    ElementKind{"material", "name", "color texture", "color texture"}, ElementKind{"color", "rgba", "", ""},
    ElementKind{"texture", "filename", "", ""},
    // -- joints
    ElementKind{"joint", "name type",
                "origin parent child axis calibration dynamics limit mimic safety_controller "
                "joint_properties physics",
                "origin parent child axis calibration dynamics limit mimic safety_controller"},
    ElementKind{"parent", "link", "", ""}, ElementKind{"child", "link", "", ""},
    ElementKind{"axis", "xyz", "", ""},
    ElementKind{"calibration", "rising falling reference_position", "", ""},
    ElementKind{"dynamics", "damping friction", "", ""},
    ElementKind{"limit", "lower upper effort velocity acceleration deceleration jerk", "", ""},
    ElementKind{"mimic", "joint multiplier offset", "", ""},
    ElementKind{"safety_controller", "soft_lower_limit soft_upper_limit k_position k_velocity", "", ""},
    ElementKind{"joint_properties", "damping friction", "", ""}, ElementKind{"physics", "", "", "", kOpen},
    // -- ros2_control
    ElementKind{"ros2_control", "name type rw_rate is_async thread_priority",
                "hardware joint sensor gpio transmission properties", "hardware"},
    ElementKind{"hardware", "", "plugin param group properties", "plugin group"},
    ElementKind{"properties", "", "", "", kOpen}, ElementKind{"hardware/plugin", "", "", "", kText},
    ElementKind{"hardware/group", "", "", "", kText}, ElementKind{"param", "name", "", "", kText},
    ElementKind{"ros2_control/joint", "name role",
                "command_interface state_interface param limits properties", ""},
    ElementKind{"ros2_control/sensor", "name role", "command_interface state_interface param properties", ""},
    ElementKind{"ros2_control/gpio", "name role", "command_interface state_interface param limits properties",
                ""},
    ElementKind{"limits", "enable", "", "", kOpen},
    ElementKind{"command_interface", "name prefix data_type size", "param limits", ""},
    ElementKind{"state_interface", "name prefix data_type size", "param limits", ""},
    // -- transmissions
    ElementKind{"ros2_control/transmission", "name", "plugin joint actuator param", "plugin"},
    ElementKind{"transmission/plugin", "", "", "", kText},
    ElementKind{"transmission", "name type",
                "type joint actuator leftActuator rightActuator flexJoint rollJoint gap_joint passive_joint "
                "simulated_reduction mechanicalReduction motorTorqueConstant compensator plugin param",
                "type"},
    ElementKind{"transmission/type", "", "", "", kText},
    ElementKind{"transmission/joint", "name role",
                "hardwareInterface mechanicalReduction mechanical_reduction offset role param", ""},
    ElementKind{
        "transmission/actuator", "name role",
        "hardwareInterface mechanicalReduction mechanical_reduction motorTorqueConstant offset role param",
        ""},
    ElementKind{"hardwareInterface", "", "", "", kText},
    ElementKind{"mechanicalReduction", "", "", "", kText},
    ElementKind{"mechanical_reduction", "", "", "", kText},
    ElementKind{"motorTorqueConstant", "", "", "", kText}, ElementKind{"offset", "", "", "", kText},
    ElementKind{"role", "", "", "", kText},
    // -- elements of other tools, with any content
    ElementKind{"gazebo", "reference", "", "", kOpen}, ElementKind{"sensor", "", "", "", kOpen},
    ElementKind{"plugin", "", "", "", kOpen}, ElementKind{"mujoco", "", "", "", kOpen}};

template <class Take>
void each_word(std::string_view list, const Take& take) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(' '), list.size());
    if (end > 0) take(list.substr(0, end));
    list.remove_prefix(std::min(end + 1, list.size()));
  }
}

bool fits(std::string_view kind, const std::vector<std::string_view>& path) {
  std::size_t at = path.size();
  while (true) {
    const std::size_t slash = kind.rfind('/');
    const std::string_view last = slash == std::string_view::npos ? kind : kind.substr(slash + 1);
    if (at == 0 || path[--at] != last) return false;
    if (slash == std::string_view::npos) return true;
    kind = kind.substr(0, slash);
  }
}

}  // namespace

const ElementKind* find_kind(const std::vector<std::string_view>& path) {
  const ElementKind* best = nullptr;
  for (const ElementKind& kind : kKinds) {
    if (fits(kind.path, path) && (best == nullptr || kind.path.size() > best->path.size())) best = &kind;
  }
  return best;
}

bool is_near_certain_match(std::string_view written, std::string_view meant) {
  const std::size_t apart = edit_distance(written, meant);
  return apart <= 2 && 2 * apart < written.size();
}

std::vector<std::string> words(std::string_view list) {
  std::vector<std::string> out;
  each_word(list, [&](std::string_view word) { out.emplace_back(word); });
  return out;
}

bool has_word(std::string_view list, std::string_view word) {
  bool found = false;
  each_word(list, [&](std::string_view w) { found = found || w == word; });
  return found;
}

std::vector<std::string> homes_of(std::string_view element) {
  std::vector<std::string> out;
  for (const ElementKind& kind : kKinds) {
    if (has_word(kind.children, element)) out.push_back(fmt::format("<{}>", kind.path));
  }
  return out;
}

}  // namespace doppel::audit_rules
