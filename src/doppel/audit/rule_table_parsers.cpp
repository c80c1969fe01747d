// The rules that hold while a description is read. Those that end the reading stand here too: what doppel
// says then carries the same ids.
#include <array>

#include "doppel/audit/rules_detail.h"

namespace doppel::audit_rules {
namespace {

constexpr Severity E = Severity::error, W = Severity::warning, N = Severity::note;

constexpr std::array kRules{
    RuleInfo{"file.unreadable", E, "the file cannot be read", "nothing can be judged",
             "give a readable file of at most 64 MB"},
    RuleInfo{"mesh.missing", W, "a mesh is not found",
             "the part is invisible in RViz and has no collision shape; Gazebo and MoveIt refuse the robot",
             "correct the name, or put the file there; install the meshes folder"},
    RuleInfo{"model.limits_crossed", E, "the lower limit is above the upper one",
             "no position is allowed: planners find no start state, controllers refuse every goal",
             "exchange the two, or correct the sign of one"},
    RuleInfo{"model.mimic_loop", E, "joints mimic each other in a ring", "no joint of the ring can be moved",
             "let one joint of the ring lead"},
    RuleInfo{"model.mimic_not_scalar", E, "a mimic of a joint that has no single position",
             "the follower has nothing to follow: robot_state_publisher and MoveIt drop it",
             "mimic a revolute, continuous or prismatic joint"},
    RuleInfo{"model.mimic_unknown", E, "a mimic of a joint that does not exist", "the robot does not load",
             "correct the name of the leader"},
    RuleInfo{"model.not_a_tree", E, "the links are no tree", "the robot does not load",
             "join every link to exactly one parent, but the root"},
    RuleInfo{"model.world_is_fixed", E, "a link 'world' on a robot that floats",
             "the robot cannot be both fixed to the world and free", "rename the link, or fix the base"},
    RuleInfo{"model.zero_axis", E, "a joint axis of length zero", "the joint can turn about nothing",
             "write a direction"},
    RuleInfo{"overlay.already_there", N, "a correction that the description already holds",
             "none: it is not applied a second time", "remove it from the overlay"},
    RuleInfo{"overlay.changed", W, "a correction whose target is no longer what it was made for",
             "the correction is not applied, and the export's value stands",
             "look at the new export, then renew or remove the operation"},
    RuleInfo{"overlay.no_target", W, "a correction of something that is not there any more",
             "the correction is not applied", "rename the operation's target, or remove the operation"},
    RuleInfo{"urdf.axis_not_unit", N, "an axis that is no unit vector",
             "tools that do not normalise scale the joint's motion by its length", "write it with length 1"},
    RuleInfo{"urdf.axis_zero", E, "an axis of length zero",
             "every tool divides by its length: transforms become NaN and the robot vanishes",
             "write a direction, as 0 0 1"},
    RuleInfo{"urdf.duplicate_name", E, "two links or joints of one name",
             "the parsers of ROS refuse the robot; others keep one of them and lose the other",
             "rename one of them"},
    RuleInfo{"urdf.geometry", E, "a shape that is none",
             "the link has no such shape; ROS' parser refuses the link",
             "write <geometry> with one box, cylinder, sphere, capsule or mesh of positive size"},
    RuleInfo{"urdf.inertial", E, "an <inertial> without mass or tensor", "ROS' parser refuses the link",
             "write both <mass> and <inertia>, or no <inertial>"},
    RuleInfo{"urdf.joint_end", E, "a joint without parent or child", "the robot does not load",
             "write <parent link=.../> and <child link=.../>"},
    RuleInfo{"urdf.joint_type", E, "an unknown type of joint", "the robot does not load",
             "use fixed, revolute, continuous, prismatic, floating or planar"},
    RuleInfo{"urdf.limits_crossed", E, "the lower limit is above the upper one",
             "no position is allowed: planners find no start state, controllers refuse every goal",
             "exchange the two, or correct the sign of one"},
    RuleInfo{"urdf.loop", E, "joints that make a loop", "a URDF is a tree: the robot does not load",
             "turn one joint around, or remove it"},
    RuleInfo{"urdf.mimic_loop", E, "a joint that mimics itself", "the joint cannot be moved, or readers hang",
             "let one joint of the chain lead"},
    RuleInfo{"urdf.mimic_unknown", E, "a mimic of a joint that does not exist",
             "the follower never moves; MoveIt and robot_state_publisher drop it with a warning",
             "correct the name of the leader"},
    RuleInfo{"urdf.missing_attribute", E, "a required attribute is missing",
             "ROS' parser refuses the element", "write the attribute"},
    RuleInfo{"urdf.no_links", E, "a robot without links", "there is nothing to load",
             "write at least one <link>"},
    RuleInfo{"urdf.no_robot", E, "the root element is not <robot>", "no tool takes the file for a robot",
             "give a URDF or a xacro file that makes one"},
    RuleInfo{"urdf.number", E, "a number that is none",
             "ROS' parser refuses the element; a decimal comma is read as the part before it",
             "write it with a decimal point and no unit"},
    RuleInfo{"urdf.two_parents", E, "a link with two parents", "a URDF is a tree: the robot does not load",
             "remove one of the joints"},
    RuleInfo{"urdf.two_roots", E, "links that nothing joins to the rest",
             "the robot does not load: two root links",
             "join them with a fixed joint, or remove what is left over"},
    RuleInfo{"urdf.unknown_link", E, "a joint between links that do not exist", "the robot does not load",
             "correct the name of the link"},
    RuleInfo{"urdf.unknown_material", N, "a material without a colour",
             "the part is drawn in a default colour", "define the material once with <color>"},
    RuleInfo{"urdf.vector", E, "a list of numbers that is none, or of the wrong length",
             "ROS' parser refuses the element", "write as many numbers as asked for, with blanks between"},
    RuleInfo{"xacro.message", N, "the description's own message", "as it says", "as it says"},
    RuleInfo{"xacro.unknown_argument", W, "an argument that nothing asks for",
             "the value has no effect, and the default stands silently", "correct the argument's name"},
    RuleInfo{"xacro.unused_block", W, "a block that a macro does not take", "what the block says is lost",
             "give the macro a block parameter, or leave the block out"},
    RuleInfo{"xml.not_well_formed", E, "the XML is not well-formed", "no tool can read the file",
             "close what is open, and escape & and < in text"},
    RuleInfo{"xml.too_deep", E, "elements nested beyond reason", "readers run out of stack",
             "flatten the file"}};

}  // namespace

std::span<const RuleInfo> parser_rules() {
  return kRules;
}

}  // namespace doppel::audit_rules
