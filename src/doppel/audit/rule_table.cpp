// What each rule over the description itself is for. The parsers' rules: rule_table_parsers.cpp; those about
// ROS: rule_table_ros.cpp.
#include <algorithm>
#include <array>
#include <string>

#include "doppel/audit/detail/rule_rows.h"

namespace doppel {
namespace audit_rules {
namespace {

constexpr std::array kDescriptionRules{
    // -- inertia
    RuleInfo{
        "inertia.axes", kError, "moments about the wrong axes",
        "the link resists turning about one axis like a far larger body, and about another hardly at all",
        "exchange the moments, or compute the tensor from the link's shape and mass", kPhysics},
    RuleInfo{"inertia.com_outside", kWarning, "a centre of mass outside of the link",
             "gravity pulls at the wrong place: the arm sags, tips or swings as no real one does",
             "correct the <origin> of <inertial>: metres, in the link's frame", kPhysics},
    RuleInfo{"inertia.density", kWarning, "a mass that does not fit the volume",
             "loads, sag and motor torques come out wrong",
             "weigh the part, or set the material in the CAD and export again", kPhysics},
    RuleInfo{"inertia.gyration", kWarning, "a tensor that does not fit the shape",
             "the link resists turning like a far larger or far smaller body: motors seem too weak, or the "
             "simulation shakes",
             "compute the tensor from the link's shape and mass", kPhysics},
    RuleInfo{"inertia.identity", kWarning, "the identity matrix for a tensor",
             "a placeholder of 1 kg m^2: hand-sized links turn like flywheels",
             "compute the tensor from the link's shape and mass", kPhysics},
    RuleInfo{"inertia.mass_negative", kError, "a negative mass",
             "engines refuse the robot, or it falls upwards", "write the mass with its true sign", kPhysics},
    RuleInfo{"inertia.mass_zero", kWarning, "a moving link without mass",
             "Gazebo drops the link and all behind it; MuJoCo refuses the robot",
             "weigh the part and write its mass", kPhysics},
    RuleInfo{"inertia.missing", kWarning, "a moving link without <inertial>",
             "Gazebo drops the link and all behind it; MuJoCo refuses the robot",
             "write an <inertial> with mass, centre and tensor", kPhysics},
    RuleInfo{"inertia.none", kWarning, "no link has an <inertial>",
             "Gazebo and MuJoCo cannot simulate the robot", "export masses and tensors from the CAD",
             kPhysics},
    RuleInfo{"inertia.not_positive", kError, "a tensor that is not positive definite",
             "the body gains energy by turning: engines refuse it or the simulation explodes",
             "compute the tensor from the link's shape and mass, about its centre of mass", kPhysics},
    RuleInfo{
        "inertia.rounded_zero", kError, "moments of inertia rounded to zero",
        "zero inertia about an axis makes the physics engine divide by nothing: jumps, NaN, or a refusal",
        "give each the link's own transverse moment, or export with more digits", kPhysics},
    RuleInfo{"inertia.triangle", kError, "a tensor that breaks the triangle inequality",
             "no body has it: MuJoCo and Drake refuse the robot, others turn it in ways no body can",
             "compute the tensor from the link's shape and mass, about its centre of mass", kPhysics},
    RuleInfo{"inertia.twins", kWarning, "twins that weigh differently",
             "one side was changed and the other forgotten: the robot pulls to one side",
             "give both the same mass and mirrored tensors", kPhysics},
    RuleInfo{"inertia.units", kError, "millimetres for metres, or grams for kilograms",
             "the link is a thousand, a million or a billion times too heavy to turn: nothing moves, or "
             "everything explodes",
             "convert to kg, m and kg m^2", kPhysics},
    RuleInfo{"inertia.zero", kWarning, "a tensor of zeros",
             "the link resists no turning: engines divide by zero or refuse the robot",
             "compute the tensor from the link's shape and mass", kPhysics},
    // -- joints
    RuleInfo{"joint.axis_default", kNote, "a movable joint without <axis>",
             "it turns about x, which is seldom what was meant", "write the axis"},
    RuleInfo{"joint.dynamics_negative", kError, "negative damping or friction",
             "the joint drives itself: the simulation gains energy and explodes", "write it without the sign",
             kPhysics},
    RuleInfo{"joint.effort_absurd", kWarning, "an effort limit beyond any motor",
             "planners and controllers believe it and ask for what no motor holds",
             "write what the drive delivers"},
    RuleInfo{"joint.effort_zero", kWarning, "an effort limit of 0",
             "Gazebo applies no force: the joint stays passive whatever the controller says",
             "write what the drive delivers", kPhysics | kControl},
    RuleInfo{"joint.exporter_effort", kError, "an exporter's default for effort",
             "a planner that believes it hands the motor a trajectory that it cannot hold",
             "write the torque from the motor's datasheet"},
    RuleInfo{"joint.exporter_velocity", kError, "an exporter's default for velocity",
             "MoveIt times its paths by it: motions that the arm cannot follow",
             "write the speed from the motor's datasheet"},
    RuleInfo{"joint.limit_incomplete", kError, "a <limit> without effort or velocity",
             "ROS' parser refuses the joint, and with it the robot", "write both"},
    RuleInfo{"joint.limit_negative", kError, "a negative effort or velocity limit",
             "nothing lies between the bounds: commands are clamped to nonsense",
             "write it without the sign"},
    RuleInfo{"joint.limit_precision", kNote, "a limit rounded to just inside a multiple of pi/2",
             "the angle itself is outside by a millionth: a start state there is out of bounds",
             "round outwards, or leave a margin on purpose"},
    RuleInfo{"joint.limits_degrees", kError, "limits in degrees",
             "the joint turns through dozens of turns: nothing stops it, and cables tear", "write radians"},
    RuleInfo{"joint.no_limits", kError, "a revolute or prismatic joint without <limit>",
             "ROS' parser refuses the joint, and with it the robot",
             "write lower, upper, effort and velocity; or make it continuous"},
    RuleInfo{"joint.not_continuous", kNote, "a revolute joint over many turns",
             "planners search turns that no cable follows; angles are not wrapped",
             "make it continuous, or write the range of the machine"},
    RuleInfo{"joint.origin_degrees", kError, "an origin turned by degrees",
             "90 rad is 14 turns and a bit: the link points anywhere", "write radians"},
    RuleInfo{"joint.origin_units", kError, "an origin in millimetres",
             "the link hangs a thousand times too far away: the robot is torn into pieces",
             "write metres: a thousandth"},
    RuleInfo{"joint.range_absurd", kWarning, "a prismatic joint over a distance beyond reason",
             "millimetres taken for metres: it slides out of the scene", "write metres"},
    RuleInfo{"joint.range_zero", kWarning, "limits that allow no motion",
             "the joint is fixed in all but name: planners fail on a range of nothing",
             "write the range, or make the joint fixed"},
    RuleInfo{"joint.soft_limits", kWarning, "soft limits outside of the limits",
             "the safety controller never acts, or always", "put them inside of lower and upper"},
    RuleInfo{"joint.velocity_absurd", kWarning, "a velocity limit beyond any geared joint",
             "MoveIt times its paths by it: motions that the machine cannot follow",
             "write the speed from the drive's datasheet"},
    RuleInfo{"joint.velocity_zero", kWarning, "a velocity limit of 0",
             "some tools take it for unlimited, others never move the joint",
             "write the speed from the drive's datasheet"},
    // -- meshes
    RuleInfo{"mesh.crossed", kNote, "a mesh whose faces disagree",
             "its volume and inertia cannot be computed; shading is torn",
             "repair the mesh, or export it again"},
    RuleInfo{"mesh.degenerate", kNote, "triangles without area",
             "normals are undefined: black spots, and failing collision checks", "clean the mesh"},
    RuleInfo{"mesh.flat", kNote, "a mesh without volume",
             "no inertia can be computed, and as a collision shape it is a sheet",
             "give it thickness, or use a box"},
    RuleInfo{"mesh.inverted", kWarning, "a mesh turned inside out",
             "it is drawn from within, and engines compute a negative mass", "flip its faces"},
    RuleInfo{"mesh.irregular", kNote, "a mesh that only lenient readers take",
             "RViz, Gazebo and doppel show it; stricter tools refuse it",
             "export it again, or correct the file"},
    RuleInfo{"mesh.not_fetched", kWarning, "a mesh that Git LFS did not fetch",
             "the part is invisible and has no collision shape on this machine",
             "install Git LFS and run: git lfs pull"},
    RuleInfo{"mesh.open", kNote, "a mesh that is not closed", "its volume and inertia cannot be computed",
             "close the holes, or export it again as a solid"},
    RuleInfo{
        "mesh.scale_negative", kWarning, "a mesh that its scale mirrors",
        "left is right: the part does not fit its neighbours; some engines refuse it or turn it inside out",
        "write the scale without the sign, or mirror the file itself"},
    RuleInfo{"mesh.scale_uneven", kNote, "a scale that differs along the axes",
             "some tools take the first number for all three", "scale the file itself"},
    RuleInfo{"mesh.scale_zero", kError, "a scale of zero",
             "the shape has no extent: it is invisible, and engines refuse it", "write the scale"},
    RuleInfo{"mesh.triangles", kNote, "more triangles than a twin needs",
             "collision checks and drawing take the time that control needs",
             "simplify the mesh; use a hull or boxes for collision"},
    RuleInfo{
        "mesh.unit", kError, "a mesh in another unit than its scale assumes",
        "the part is a thousand times too large or small: it fills the scene, or collides with everything",
        "scale it by 0.001 (millimetres) or export metres"},
    RuleInfo{"mesh.unreadable", kError, "a mesh that cannot be read", "the part is missing in every tool",
             "export it again as STL, OBJ or COLLADA"},
    RuleInfo{"mesh.visual_as_collision", kNote, "the visual mesh used for collision",
             "collision checks walk every triangle of the picture: slow planning, contacts that jitter",
             "use a hull, boxes or cylinders"},
    // -- mimics
    RuleInfo{"mimic.chained", kWarning, "a mimic of a mimic",
             "Gazebo and the joint state publishers follow one step only: the last joint stands still",
             "follow the leader directly"},
    RuleInfo{"mimic.fixed", kWarning, "a fixed joint that mimics", "it never moves",
             "remove the <mimic>, or let the joint move"},
    RuleInfo{
        "mimic.limits", kWarning, "a leader that takes its follower out of its limits",
        "planners refuse states that the mechanism reaches; the follower stops first and blocks the leader",
        "make both ranges fit through multiplier and offset"},
    RuleInfo{"mimic.multiplier_zero", kWarning, "a mimic by zero", "the follower stands still",
             "write the ratio of the two"},
    // -- names
    RuleInfo{"name.blank_edge", kWarning, "a name with a blank at its end",
             "it looks like another name and is not found", "remove the blank"},
    RuleInfo{"name.case", kWarning, "names that differ only by case",
             "tools and file systems without case take them for one", "rename one of them"},
    RuleInfo{"name.character", kWarning, "a name with a character that tools rewrite",
             "a '.' splits parameter names, others are escaped or refused: the name is not found",
             "use letters, digits and underscores"},
    RuleInfo{"name.empty", kError, "a link or joint without a name",
             "nothing can refer to it, and readers refuse it", "name it"},
    RuleInfo{"name.link_and_joint", kNote, "a link and a joint of one name",
             "SDF wants the names of siblings to differ: Gazebo renames one of them", "rename the joint",
             kGazebo},
    RuleInfo{"name.reserved", kWarning, "a name that SDF keeps for itself", "Gazebo refuses the robot",
             "rename it", kGazebo},
    RuleInfo{"name.robot", kNote, "a robot name that ROS cannot use",
             "nodes and topics named after it are refused",
             "use letters, digits and underscores, and no digit first"},
    RuleInfo{"name.slash", kWarning, "a name that begins with a slash", "tf2 strips it, or refuses the frame",
             "remove the slash"},
    RuleInfo{"name.space", kNote, "names with spaces",
             "they work where quoted; an unquoted shell or YAML list splits them",
             "quote them everywhere, or use underscores"},
    // -- schema
    RuleInfo{"schema.attribute", kWarning, "an attribute that no consumer reads",
             "its value is ignored, and the default stands silently", "correct its name, or remove it"},
    RuleInfo{"schema.colour", kWarning, "a colour outside of 0 .. 1",
             "the part is white, black, or ROS' parser refuses the material",
             "write red, green, blue and opacity within 0 .. 1"},
    RuleInfo{"schema.element", kError, "an element that no consumer reads", "its content is silently ignored",
             "correct its name, or remove it"},
    RuleInfo{"schema.misplaced", kWarning, "an element in the wrong place", "its content is silently ignored",
             "move it to where it belongs"},
    RuleInfo{"schema.repeated", kWarning, "an element that may stand only once",
             "ROS reads the first one; other tools may take the last", "keep one"},
    RuleInfo{"schema.text", kNote, "stray text", "it is ignored; often a tag was broken there",
             "remove it, or make it a comment"},
    // -- shapes
    RuleInfo{"shape.units", kError, "a shape in millimetres",
             "the part is a thousand times too large: it fills the scene, or collides with everything",
             "write metres: a thousandth"},
    RuleInfo{"shape.zero_size", kWarning, "a shape without extent",
             "it is invisible and touches nothing; MuJoCo refuses it", "write its size in metres"},
    // -- run (doppel check --rest; found in the simulation, not in the text)
    RuleInfo{"run.diverged", kError, "the simulation runs away", "the twin ends within a second of its start",
             "look for tiny masses on strong joints, or choose a smaller step in a world file", kPhysics},
    RuleInfo{"run.oscillation", kError, "a held joint oscillates",
             "measurements at the joint show the oscillation, not the robot",
             "remove the cause that the finding names; doppel verify shows whether it is the step", kPhysics},
    RuleInfo{"run.refused", kError, "a robot that does not come up", "doppel up refuses it",
             "do what the finding says", kPhysics},
    RuleInfo{"run.unrest", kError, "a robot without a command moves",
             "the start is not where the description puts it: a drive is too weak, or parts push each other",
             "remove the cause that the finding names", kPhysics},
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
