// The purpose of each rule over the description itself. The parsers' rules: rule_table_parsers.cpp; those
// about ROS: rule_table_ros.cpp.
#include <algorithm>
#include <array>
#include <string>

#include "doppel/review/audit/detail/rule_rows.h"

namespace doppel {
namespace audit_rules {
namespace {

constexpr std::array kDescriptionRules{
    // -- inertia
    RuleInfo{"inertia.axes", kError, "moments about the wrong axes",
             "the link has the rotational inertia of a far larger body about one axis, and almost none about "
             "another",
             "exchange the moments, or compute the tensor from the link's shape and mass", kPhysics},
    RuleInfo{"inertia.com_outside", kWarning, "a centre of mass outside the link",
             "gravity acts at the wrong point: sag, tipping and swinging are unrealistic",
             "correct the <origin> of <inertial>: metres, in the link's frame", kPhysics},
    RuleInfo{"inertia.density", kWarning, "a mass that does not match the volume",
             "loads, sag and motor torques come out wrong",
             "weigh the part, or set the material in CAD and export again", kPhysics},
    RuleInfo{
        "inertia.estimated_tons", kError, "an estimated mass of more than a ton",
        "the size of a shape is wrong, most likely in millimetres: every torque and load comes out wrong",
        "correct the scale or the size of the shape, or write the link's <inertial>", kPhysics},
    RuleInfo{
        "inertia.gyration", kWarning, "an inertia tensor that does not match the shape",
        "the link rotates like a far larger or smaller body: motors seem too weak, or the simulation jitters",
        "compute the tensor from the link's shape and mass", kPhysics},
    RuleInfo{"inertia.identity", kWarning, "an identity matrix as inertia tensor",
             "a placeholder of 1 kg m^2: small links rotate like flywheels",
             "compute the tensor from the link's shape and mass", kPhysics},
    RuleInfo{"inertia.mass_negative", kError, "a negative mass",
             "engines reject the robot, or it falls upwards", "write a positive mass", kPhysics},
    RuleInfo{"inertia.mass_zero", kWarning, "a moving link without mass",
             "Gazebo drops the link and its subtree; MuJoCo rejects the robot",
             "weigh the part and write its mass", kPhysics},
    RuleInfo{"inertia.missing", kWarning, "a moving link without <inertial>",
             "Gazebo drops the link and its subtree; MuJoCo rejects the robot",
             "write an <inertial> with mass, centre of mass and inertia tensor", kPhysics},
    RuleInfo{"inertia.none", kWarning, "no link has an <inertial>",
             "Gazebo and MuJoCo cannot simulate the robot", "export masses and inertia tensors from CAD",
             kPhysics},
    RuleInfo{"inertia.not_positive", kError, "an inertia tensor that is not positive definite",
             "the body gains energy by rotating: engines reject it or the simulation diverges",
             "compute the tensor from the link's shape and mass, about its centre of mass", kPhysics},
    RuleInfo{"inertia.rounded_zero", kError, "moments of inertia rounded to zero",
             "zero inertia about an axis makes the physics engine divide by zero: jumps, NaN, or an error",
             "set the smallest moment to the link's transverse moment, or export with more digits", kPhysics},
    RuleInfo{
        "inertia.triangle", kError, "an inertia tensor that violates the triangle inequality",
        "physically impossible: MuJoCo and Drake reject the robot, other engines simulate impossible motion",
        "compute the tensor from the link's shape and mass, about its centre of mass", kPhysics},
    RuleInfo{"inertia.twins", kWarning, "mirrored links with different masses",
             "one side was changed and the other was not: the robot is unbalanced",
             "give both the same mass and mirrored inertia tensors", kPhysics},
    RuleInfo{"inertia.units", kError, "millimetres for metres, or grams for kilograms",
             "mass or inertia is wrong by a factor of 10^3, 10^6 or 10^9: nothing moves, or the simulation "
             "diverges",
             "convert to kg, m and kg m^2", kPhysics},
    RuleInfo{"inertia.zero", kWarning, "an inertia tensor of zeros",
             "the link has no rotational inertia: engines divide by zero or reject the robot",
             "compute the tensor from the link's shape and mass", kPhysics},
    // -- joints
    RuleInfo{"joint.axis_default", kNote, "a movable joint without <axis>",
             "it rotates about x, which is seldom intended", "write the axis"},
    RuleInfo{"joint.continuous_limits", kWarning, "a continuous joint with position limits",
             "every tool ignores lower and upper: the joint turns past them, and cables tear",
             "make it revolute, or remove lower and upper"},
    RuleInfo{"joint.dynamics_negative", kError, "negative damping or friction",
             "the joint drives itself: the simulation gains energy and diverges", "write a positive value",
             kPhysics},
    RuleInfo{"joint.effort_absurd", kWarning, "an effort limit beyond any motor",
             "planners and controllers command efforts that no motor delivers",
             "write the effort that the drive delivers"},
    RuleInfo{"joint.effort_zero", kWarning, "an effort limit of 0",
             "Gazebo applies no force: the joint stays passive whatever is commanded",
             "write the effort that the drive delivers", kPhysics | kControl},
    RuleInfo{"joint.exporter_effort", kError, "an exporter's default for effort",
             "planners produce trajectories that the motor cannot follow",
             "write the torque from the motor's datasheet"},
    RuleInfo{"joint.exporter_velocity", kError, "an exporter's default for velocity",
             "MoveIt times trajectories by it: the arm cannot follow them",
             "write the speed from the motor's datasheet"},
    RuleInfo{"joint.limit_incomplete", kError,
             "a <limit> without effort or velocity, in a file before URDF 1.2",
             "urdfdom rejects the joint, and with it the robot", "write both"},
    RuleInfo{"joint.limit_negative", kError, "a negative effort or velocity limit",
             "the allowed range is empty: commands are clamped to wrong values", "write a positive value"},
    RuleInfo{"joint.limit_precision", kNote, "a limit rounded to just inside a multiple of pi/2",
             "the angle itself is out of bounds by a millionth: a start state there is rejected",
             "round outwards, or choose a deliberate margin"},
    RuleInfo{"joint.limits_degrees", kError, "limits in degrees",
             "the joint can make dozens of turns: nothing stops it, and cables tear", "write radians"},
    RuleInfo{"joint.no_limits", kError, "a revolute or prismatic joint without <limit>",
             "urdfdom rejects the joint, and with it the robot",
             "write lower, upper, effort and velocity; or make it continuous"},
    RuleInfo{"joint.not_continuous", kNote, "a revolute joint over many turns",
             "planners search ranges that cables do not allow; angles are not wrapped",
             "make it continuous, or write the range of the real joint"},
    RuleInfo{"joint.origin_degrees", kError, "an origin with rpy in degrees",
             "90 rad is more than 14 turns: the link has an arbitrary orientation", "write radians"},
    RuleInfo{"joint.origin_units", kError, "an origin in millimetres",
             "the link is a thousand times too far away: the robot falls apart", "convert to metres"},
    RuleInfo{"joint.range_absurd", kWarning, "a prismatic joint with an implausible range",
             "millimetres are read as metres: the link slides out of the scene", "write metres"},
    RuleInfo{"joint.range_zero", kWarning, "limits that allow no motion",
             "the joint cannot move: planners fail on an empty range",
             "write the range, or make the joint fixed"},
    RuleInfo{"joint.soft_limits", kWarning, "soft limits outside the limits",
             "the safety controller never acts, or always", "put them between lower and upper"},
    RuleInfo{"joint.velocity_absurd", kWarning, "a velocity limit beyond any geared joint",
             "MoveIt times trajectories by it: the machine cannot follow them",
             "write the speed from the drive's datasheet"},
    RuleInfo{"joint.velocity_zero", kWarning, "a velocity limit of 0",
             "some tools treat it as unlimited, others never move the joint",
             "write the speed from the drive's datasheet"},
    // -- meshes
    RuleInfo{"mesh.crossed", kNote, "a mesh with inconsistently oriented faces",
             "its volume and inertia cannot be computed; shading is wrong",
             "repair the mesh, or export it again"},
    RuleInfo{"mesh.degenerate", kNote, "degenerate triangles",
             "normals are undefined: black spots, and failing collision checks", "clean the mesh"},
    RuleInfo{"mesh.flat", kNote, "a flat mesh",
             "no inertia can be computed, and it has no thickness as a collision shape",
             "give it thickness, or use a box"},
    RuleInfo{"mesh.inverted", kWarning, "a mesh turned inside out",
             "it is rendered inside out, and engines compute a negative mass", "flip its faces"},
    RuleInfo{"mesh.irregular", kNote, "a mesh that only lenient readers accept",
             "RViz, Gazebo and doppel show it; stricter tools reject it",
             "export it again, or correct the file"},
    RuleInfo{"mesh.not_fetched", kWarning, "a mesh that Git LFS did not fetch",
             "the part is invisible and has no collision shape on this machine",
             "install Git LFS and run: git lfs pull"},
    RuleInfo{"mesh.open", kNote, "a mesh that is not closed", "its volume and inertia cannot be computed",
             "close the holes, or export it again as a solid"},
    RuleInfo{"mesh.scale_negative", kWarning, "a mesh that its scale mirrors",
             "left and right are exchanged: the part does not match its neighbours; some engines reject it "
             "or turn it inside out",
             "write a positive scale, or mirror the file itself"},
    RuleInfo{"mesh.scale_uneven", kNote, "a scale that differs along the axes",
             "some tools use the first number for all three axes", "scale the file itself"},
    RuleInfo{"mesh.scale_zero", kError, "a scale of zero",
             "the shape has no extent: it is invisible, and engines reject it", "write a non-zero scale"},
    RuleInfo{"mesh.triangles", kNote, "more triangles than a twin needs",
             "collision checks and rendering take the time that control needs",
             "simplify the mesh; use a hull or boxes for collision"},
    RuleInfo{"mesh.unit", kError, "a mesh in another unit than its scale assumes",
             "the part is a thousand times too large or too small",
             "scale it by 0.001 (millimetres) or export metres"},
    RuleInfo{"mesh.unreadable", kError, "a mesh that cannot be read", "the part is missing in every tool",
             "export it again as STL, OBJ or COLLADA"},
    RuleInfo{"mesh.visual_as_collision", kNote, "the visual mesh used for collision",
             "collision checks test every triangle: slow planning, contacts that jitter",
             "use a hull, boxes or cylinders"},
    // -- mimics
    RuleInfo{"mimic.chained", kWarning, "a mimic of a mimic",
             "Gazebo and joint state publishers resolve one level only: the last joint does not move",
             "mimic the leading joint directly"},
    RuleInfo{"mimic.fixed", kWarning, "a fixed joint with a <mimic>", "it never moves",
             "remove the <mimic>, or let the joint move"},
    RuleInfo{
        "mimic.limits", kWarning, "a mimicked joint that moves its follower beyond its limits",
        "planners reject states that the mechanism reaches; the follower stops first and blocks the leader",
        "make both ranges match through multiplier and offset"},
    RuleInfo{"mimic.missing", kNote, "a mirrored pair of fingers or gears that move independently",
             "one side of the gripper stays behind: objects slip, and the other half hangs under gravity",
             "add a <mimic>, if one drive moves both"},
    RuleInfo{"mimic.multiplier_zero", kWarning, "a mimic with multiplier 0", "the follower does not move",
             "write the ratio of the two joints"},
    // -- names
    RuleInfo{"name.blank_edge", kWarning, "a name with leading or trailing spaces",
             "it looks like another name and is not found", "remove the spaces"},
    RuleInfo{"name.case", kWarning, "names that differ only by case",
             "case-insensitive tools and file systems treat them as one", "rename one of them"},
    RuleInfo{"name.character", kWarning, "a name with a character that tools rewrite",
             "a '.' splits parameter names, other characters are escaped or rejected: the name is not found",
             "use letters, digits and underscores"},
    RuleInfo{"name.empty", kError, "a link or joint without a name",
             "nothing can refer to it, and parsers reject it", "name it"},
    RuleInfo{"name.link_and_joint", kNote, "a link and a joint with the same name",
             "SDF requires distinct names of siblings: Gazebo renames one of them", "rename the joint",
             kGazebo},
    RuleInfo{"name.reserved", kWarning, "a name that SDF reserves", "Gazebo rejects the robot", "rename it",
             kGazebo},
    RuleInfo{"name.robot", kNote, "a robot name that is not a valid ROS name",
             "nodes and topics named after it are rejected",
             "use letters, digits and underscores, not starting with a digit"},
    RuleInfo{"name.slash", kWarning, "a name with a leading slash", "tf2 strips it, or rejects the frame",
             "remove the slash"},
    RuleInfo{"name.space", kNote, "names with spaces",
             "they work where quoted; an unquoted shell argument or YAML list splits them",
             "quote them everywhere, or use underscores"},
    // -- schema
    RuleInfo{"schema.attribute", kWarning, "an unknown attribute",
             "its value is ignored, and the default applies silently", "correct its name, or remove it"},
    RuleInfo{"schema.colour", kWarning, "a colour outside 0 .. 1",
             "the part is white or black, or urdfdom rejects the material",
             "write red, green, blue and opacity within 0 .. 1"},
    RuleInfo{"schema.element", kError, "an unknown element", "its content is silently ignored",
             "correct its name, or remove it"},
    RuleInfo{"schema.misplaced", kWarning, "a misplaced element", "its content is silently ignored",
             "move it to where it belongs"},
    RuleInfo{"schema.repeated", kWarning, "a duplicate of a unique element",
             "ROS reads the first one; other tools may use the last", "keep one"},
    RuleInfo{"schema.text", kNote, "stray text", "it is ignored; often a tag is malformed there",
             "remove it, or turn it into a comment"},
    // -- shapes
    RuleInfo{"shape.units", kError, "a shape in millimetres", "the part is a thousand times too large",
             "convert to metres"},
    RuleInfo{"shape.zero_size", kWarning, "a shape of size zero",
             "it is invisible and collides with nothing; MuJoCo rejects it", "write its size in metres"},
    // -- run (doppel check --rest; found in the simulation, not in the text)
    RuleInfo{"run.diverged", kError, "the simulation diverges",
             "the twin stops within a second after the start",
             "look for small masses on strong joints, or set a smaller step in a world file", kPhysics},
    RuleInfo{"run.oscillation", kError, "a held joint oscillates",
             "measurements at the joint are dominated by the oscillation",
             "remove the cause given by the finding; doppel verify shows whether the step is the cause",
             kPhysics},
    RuleInfo{"run.refused", kError, "a robot that does not start", "doppel up rejects it",
             "apply the fix of the finding", kPhysics},
    RuleInfo{
        "run.unrest", kError, "a robot moves without a command",
        "the start pose differs from the description: a drive is too weak, or links push each other apart",
        "remove the cause given by the finding", kPhysics},
};

}  // namespace

std::span<const RuleInfo> description_rules() {
  return kDescriptionRules;
}

}  // namespace audit_rules

const std::vector<RuleInfo>& rule_table() {
  static const std::vector<RuleInfo> rules = [] {
    std::vector<RuleInfo> all;
    for (const auto part :
         {audit_rules::description_rules(), audit_rules::parser_rules(), audit_rules::ros_rules()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    std::sort(all.begin(), all.end(), [](const RuleInfo& a, const RuleInfo& b) { return a.id < b.id; });
    return all;
  }();
  return rules;
}

const RuleInfo* find_rule(std::string_view id) {
  const std::vector<RuleInfo>& all = rule_table();
  const auto found = std::lower_bound(all.begin(), all.end(), id,
                                      [](const RuleInfo& r, std::string_view x) { return r.id < x; });
  return found == all.end() || found->id != id ? nullptr : &*found;
}

}  // namespace doppel
