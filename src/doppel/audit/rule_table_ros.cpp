// The rules about what surrounds a description: ros2_control, controllers, Gazebo, the package, the world,
// contact, datasheets. Sorted by id.
#include <array>

#include "doppel/audit/detail/ros_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr Severity kError = Severity::error, kWarning = Severity::warning, kNote = Severity::note;

constexpr unsigned bit(Profile profile) {
  return static_cast<unsigned>(profile);
}
constexpr unsigned kControl = bit(Profile::ros2_control);
constexpr unsigned kGazebo = bit(Profile::gazebo);
constexpr unsigned kGazeboControl = kControl | kGazebo;
constexpr unsigned kPhysics = kGazebo | bit(Profile::mujoco);
constexpr unsigned kMoving = kControl | bit(Profile::moveit);

constexpr std::array kRules{
    // -- the audit itself
    RuleInfo{"audit.skipped", kNote, "something beside the description was not read",
             "what it says of the robot is not judged: a slow, huge or strange file never holds up the audit",
             "nothing, if it does not matter; else make it a regular file of usual size"},
    // -- collision
    RuleInfo{"collision.missing", kNote, "a link that can be seen has no collision shape",
             "planners move through it and simulators let things pass through it", "add a <collision>",
             kPhysics | bit(Profile::moveit)},
    RuleInfo{"collision.neighbours", kNote, "two links of one joint overlap deeply",
             "a shape may stand in the wrong place; MoveIt reports the start state in collision unless the "
             "pair is "
             "excluded",
             "move the shape to its place, or exclude the pair", kPhysics | bit(Profile::moveit)},
    RuleInfo{"collision.overlap", kWarning, "links that share no joint overlap where the robot starts",
             "physics pushes them apart and the robot jumps at the start; every plan starts in collision",
             "correct the shapes or the zero pose, or exclude the pair", kPhysics | bit(Profile::moveit)},

    // -- controllers
    RuleInfo{"controllers.command_interface", kError,
             "a controller commands an interface that the hardware lacks",
             "the controller loads and cannot be activated", "offer the interface, or command another one",
             kControl},
    RuleInfo{"controllers.file_missing", kError, "the controllers' parameter file does not exist",
             "the controller manager does not come up, and no joint holds its place", "correct the path",
             kGazeboControl},
    RuleInfo{"controllers.fixed_joint", kError, "a controller commands a fixed joint",
             "the controller cannot be activated: a fixed joint has no interface", "remove it from the list",
             kControl},
    RuleInfo{"controllers.idle_gains", kWarning, "gains that have no effect",
             "evenings of tuning change nothing: with position commands no PID runs",
             "remove them, or command velocity or effort alone", kControl},
    RuleInfo{"controllers.joint_twice", kError, "a controller lists a joint twice",
             "the controller refuses its parameters", "remove one", kControl},
    RuleInfo{"controllers.mimic_joint", kWarning, "a controller commands a joint that mimics another",
             "ros2_control has no command interface for it, and the controller cannot be activated; doppel "
             "leaves it out",
             "remove it from the list", kControl},
    RuleInfo{"controllers.no_section", kWarning, "a controller is declared without parameters",
             "it does not know its joints and cannot be configured", "write its section", kControl},
    RuleInfo{"controllers.no_type", kWarning, "a controller is declared without a type",
             "the controller manager cannot load it", "write its type", kControl},
    RuleInfo{"controllers.parameter", kError, "a controller refuses a parameter",
             "it cannot be loaded or configured", "correct the value", kControl},
    RuleInfo{"controllers.rate_above_manager", kWarning, "a controller's rate is above the manager's",
             "it runs at the manager's rate, and time-dependent settings are wrong",
             "lower it, or raise the manager's", kControl},
    RuleInfo{"controllers.rate_above_physics", kWarning, "the manager's rate is above the physics rate",
             "in simulation it runs once for each physics step, slower than it says", "choose a lower rate",
             kGazeboControl},
    RuleInfo{"controllers.rate_uneven", kNote, "the manager's rate does not divide the physics rate",
             "in simulation the period is rounded to whole steps", "choose a rate that divides 1000 Hz",
             kGazeboControl},
    RuleInfo{"controllers.section_of_nobody", kWarning, "a section's name is nearly a controller's",
             "its parameters reach nobody, and the controller has none", "give both the same name", kControl},
    RuleInfo{"controllers.shared_claim", kNote, "two controllers want the same interface",
             "the second one cannot be activated while the first is active", "start only one of them",
             kControl},
    RuleInfo{"controllers.state_interface", kError, "a controller reads an interface that the hardware lacks",
             "the controller loads and cannot be activated", "offer the interface, or do without", kControl},
    RuleInfo{"controllers.uncontrolled_joint", kNote, "a joint that can be commanded is in no controller",
             "nothing holds it; it sinks under its load in simulation", "add it to a controller", kControl},
    RuleInfo{"controllers.unknown_joint", kError, "a controller names a joint that the robot lacks",
             "the controller cannot be activated, at the first start of the robot", "correct the name",
             kControl},
    RuleInfo{"controllers.unknown_parameter", kWarning, "a parameter that its controller does not have",
             "it is ignored without a word, and the default acts", "correct the name", kControl},
    RuleInfo{"controllers.unknown_type", kError, "a controller type that does not exist",
             "the controller manager cannot load it", "correct the type", kControl},
    RuleInfo{"controllers.unreadable", kError, "the controllers' parameter file cannot be read",
             "the controller manager stops at the start", "correct the YAML", kControl},
    RuleInfo{"controllers.whole_number", kError, "a whole number where ROS 2 takes only a decimal",
             "rclcpp refuses the parameter's type and the controller cannot be loaded (doppel takes it)",
             "write 1.0 for 1", kControl},

    // -- datasheet
    RuleInfo{"datasheet.above", kError, "a limit above what the actuator can do",
             "planners hand out motions that the machine cannot follow or hold", "write the sheet's value",
             kAllProfiles},
    RuleInfo{"datasheet.far_below", kNote, "a limit far below what the actuator can do",
             "the robot is slower or weaker in the model than on the bench", "raise it, if it is no margin",
             kAllProfiles},
    RuleInfo{"datasheet.invalid", kWarning, "the package's config/actuators.yaml cannot be used",
             "limits are not held against the actuators", "correct the file", kAllProfiles},
    RuleInfo{"datasheet.travel", kError, "limits wider than the actuator's travel",
             "the servo stands at its stop while the model moves on", "narrow the limits", kAllProfiles},
    RuleInfo{"datasheet.unknown_joint", kWarning, "the sheet names a joint that the robot lacks",
             "that joint's limits are not checked", "correct the name", kAllProfiles},

    // -- gazebo
    RuleInfo{"gazebo.material", kNote, "a material script of Gazebo Classic", "the link is grey in Gazebo",
             "give the <visual> a colour", kGazebo},
    RuleInfo{"gazebo.no_control_plugin", kWarning, "simulated hardware without Gazebo's ros2_control plugin",
             "no controller manager starts; spawners wait for ever and the joints are passive",
             "add the plugin", kGazeboControl},
    RuleInfo{"gazebo.no_simulated_hardware", kWarning,
             "Gazebo's ros2_control plugin without simulated hardware",
             "the plugin finds no component of its own, or loads a driver that looks for a serial port",
             "choose the simulated plugin when simulating", kGazeboControl},
    RuleInfo{"gazebo.old_plugin", kWarning, "a plugin of an earlier Gazebo",
             "Gazebo says that it cannot find the library, and goes on without it", "write the present name",
             kGazebo},
    RuleInfo{"gazebo.plugin_class", kWarning, "a plugin's file or class name is wrong",
             "Gazebo says that it cannot load the plugin, and goes on without it", "correct the name",
             kGazebo},
    RuleInfo{"gazebo.reference", kWarning, "<gazebo reference> names nothing",
             "friction, sensors and the rest below it are dropped without a word", "correct the name",
             kGazebo},

    // -- package
    RuleInfo{"package.build_type", kWarning, "package.xml's build_type does not fit the build files",
             "colcon takes the wrong way to build, or none", "write the build_type that fits", kAllProfiles},
    RuleInfo{"package.dependency", kWarning, "a package that the description uses is no dependency",
             "it works where the package happens to be, and not on a fresh machine", "add an exec_depend",
             kAllProfiles},
    RuleInfo{"package.incomplete", kWarning, "package.xml lacks a required element",
             "colcon and rosdep refuse the package", "add it", kAllProfiles},
    RuleInfo{"package.installed_elsewhere", kWarning, "files are installed where nobody looks",
             "it works from the source folder, and after installation the files are not found",
             "install the folder under its own name", kAllProfiles},
    RuleInfo{"package.invalid", kWarning, "package.xml cannot be read", "colcon does not see the package",
             "correct it", kAllProfiles},
    RuleInfo{"package.launch_dependency", kNote, "a launch file uses a package that is no dependency",
             "it works where the package happens to be, and not on a fresh machine", "add an exec_depend",
             kAllProfiles},
    RuleInfo{"package.launch_mapping", kWarning, "a simulator's launch file does not switch the description",
             "Gazebo comes up with the real hardware's driver, which looks for a serial port that is not "
             "there; nothing "
             "complains",
             "give the argument to xacro", kGazeboControl},
    RuleInfo{"package.name_mismatch", kWarning, "the description names its own package wrongly",
             "meshes and includes are not found", "write the name that package.xml has", kAllProfiles},
    RuleInfo{"package.no_manifest", kWarning, "a package without package.xml",
             "neither colcon nor package:// finds it", "write one", kAllProfiles},
    RuleInfo{"package.not_installed", kWarning, "files that the description needs are not installed",
             "it works from the source folder; after colcon build, meshes or includes are not found",
             "add the folder to the install rules", kAllProfiles},
    RuleInfo{"package.project_name", kWarning, "CMake's project has another name than the package",
             "ament refuses to build the package", "give both the same name", kAllProfiles},
    RuleInfo{"package.spawn_height", kWarning, "a robot fixed to the world is spawned in the air",
             "it is bolted to the world where it was spawned and stays up there", "spawn at 0", kGazebo},

    // -- ros2_control
    RuleInfo{"ros2_control.duplicate_component", kError, "two components of one name",
             "the resource manager refuses the description and the controller manager ends", "rename one",
             kControl},
    RuleInfo{"ros2_control.duplicate_interface", kError, "an interface is offered twice",
             "the resource manager refuses the description and the controller manager ends", "keep one",
             kControl},
    RuleInfo{"ros2_control.fixed_joint", kWarning, "a fixed joint in <ros2_control>",
             "the simulator has no such joint and skips it; controllers that want it cannot be activated",
             "remove it", kGazeboControl},
    RuleInfo{"ros2_control.initial_value", kWarning, "a joint starts outside its limits",
             "the joint jumps to its limit at the start, or the planner refuses the start state",
             "choose a value inside the limits", kMoving | kGazebo},
    RuleInfo{"ros2_control.interface_name", kWarning, "an interface name that is nearly a usual one",
             "no controller finds the interface that it asks for", "write the usual name", kControl},
    RuleInfo{"ros2_control.limits_crossed", kWarning, "an interface's min is above its max",
             "every command is out of range", "swap them", kControl},
    RuleInfo{"ros2_control.mimic_commanded", kError, "a mimic joint has a command interface",
             "ros2_control refuses the description: a joint that mimics cannot be commanded",
             "remove the command interface", kControl},
    RuleInfo{"ros2_control.missing", kNote, "no <ros2_control> takes effect",
             "no controller can move the robot", "write a <ros2_control> block", kControl},
    RuleInfo{"ros2_control.no_interface", kNote, "a joint without any interface", "the entry has no effect",
             "give it interfaces, or remove it", kControl},
    RuleInfo{"ros2_control.no_limits", kNote, "a command without bounds",
             "nothing stops a wild command; limits cannot be enforced", "write the joint's <limit>",
             kControl},
    RuleInfo{"ros2_control.no_plugin", kWarning, "a component without a plugin",
             "ros2_control refuses the description", "name the plugin", kControl},
    RuleInfo{"ros2_control.no_state", kWarning, "a joint can be commanded and not read",
             "it is missing from /joint_states, so its link has no transform, and trajectories cannot start",
             "add a state interface", kControl},
    RuleInfo{"ros2_control.old_plugin", kWarning, "a hardware plugin of an earlier release",
             "pluginlib does not find the class, and the controller manager ends", "write the present name",
             kGazeboControl},
    RuleInfo{"ros2_control.plugin_name", kWarning, "a hardware plugin's name is nearly a known one",
             "pluginlib does not find the class, and the controller manager ends", "correct the name",
             kControl},
    RuleInfo{"ros2_control.sensor_frame", kWarning, "a sensor's frame is no link",
             "its messages cannot be transformed", "name a link", kControl},
    RuleInfo{"ros2_control.sensor_unknown", kWarning, "a simulated sensor that the simulator does not have",
             "its state stays at NaN or zero", "give both the same name", kGazeboControl},
    RuleInfo{"ros2_control.type", kError, "a component of no known type",
             "the resource manager leaves it out without a word", "write system, actuator or sensor",
             kControl},
    RuleInfo{"ros2_control.undriven_joint", kNote, "a joint that can move is in no component",
             "nothing publishes its state, so its links have no transform; in simulation it swings freely",
             "add it to a component", kControl},
    RuleInfo{"ros2_control.unknown_joint", kError, "<ros2_control> names a joint that the URDF lacks",
             "ros2_control refuses the description", "correct the name", kControl},

    // -- transmission
    RuleInfo{"transmission.unknown_joint", kWarning, "a transmission's joint does not exist",
             "the transmission drives nothing", "correct the name", kControl},

    // -- world
    RuleInfo{"world.above_ground", kNote, "the base hangs over the ground of 'world'",
             "the robot floats in the simulator's picture", "lower the joint to 'world'", kPhysics},
    RuleInfo{"world.below_ground", kNote, "the base reaches into the ground of 'world'",
             "links that come near the base are pushed up by the ground", "raise the joint to 'world'",
             kPhysics},
    RuleInfo{"world.no_world_link", kNote, "nothing fixes the robot to the world",
             "in Gazebo the arm falls over or through the floor", "add a link 'world' with a fixed joint",
             kGazebo},
    RuleInfo{"world.root_inertia", kNote, "the root link has an inertia",
             "KDL warns and leaves the inertia out of its dynamics", "put a link without inertia above it",
             bit(Profile::moveit) | kControl},

    // -- xacro
    RuleInfo{"xacro.argument_late", kWarning, "an argument is read before it is declared",
             "expansion fails unless the caller gives the argument: the launch file that does not is the one "
             "that breaks",
             "move the declaration up", kAllProfiles},
    RuleInfo{"xacro.argument_undeclared", kWarning, "an argument is read and not declared",
             "expansion fails unless the caller gives the argument: the launch file that does not is the one "
             "that breaks",
             "declare it with a default", kAllProfiles},
    RuleInfo{"xacro.argument_unused", kNote, "an argument is declared and not read",
             "giving it changes nothing, and nothing says so", "read it, or remove it", kAllProfiles},
    RuleInfo{"xacro.switch_idle", kWarning, "the switch between simulator and hardware switches nothing",
             "the simulator gets the real hardware's driver, or the robot the simulator's",
             "choose the plugin by it", kGazeboControl},
};

}  // namespace

std::span<const RuleInfo> ros_rules() {
  return kRules;
}

}  // namespace doppel::audit_rules
