#include "doppel/scenario/launch/launch_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>

#include "doppel/base/packages/package_folder.h"
#include "doppel/base/xml/xml.h"
#include "doppel/base/yaml/placed_yaml.h"
#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/scenario/launch/detail/launch_roles.h"
#include "doppel/scenario/launch/detail/launched_robots.h"
#include "doppel/scenario/launch/detail/own_programs.h"
#include "doppel/scenario/launch/detail/spawn_arguments.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class Planner {
 public:
  Planner(const LaunchDescription& description, PackageResolver& resolver, fs::path folder)
      : resolver_(resolver),
        folder_(folder),
        description_(description),
        robots_(description, resolver, std::move(folder)) {}

  LaunchPlan plan() {
    visit(description_.records, 0);
    robots_.finish(plan_);
    plan_.scenario.wall_stamps = !robots_.has_simulator() && !sim_time_;
    plan_.scenario.ros = ros_arguments();
    return std::move(plan_);
  }

 private:
  void outcome(const LaunchRecord& record, LaunchFate fate, std::string text) {
    plan_.outcomes[record.id] = {fate, std::move(text)};
  }

  // `after`: the program whose end these records wait for.
  void visit(const std::vector<LaunchRecord>& records, int after) {
    for (const LaunchRecord& record : records) visit(record, after);
  }

  void visit(const LaunchRecord& record, int after) {
    switch (record.kind) {
      case LaunchKind::node:
        return visit_node(record, after);
      case LaunchKind::process:
        return visit_process(record, after);
      case LaunchKind::include:
        return visit_include(record, after);
      case LaunchKind::timer:
        outcome(record, LaunchFate::structure, "when the twin is ready, instead of a time");
        return visit(record.children, after);
      case LaunchKind::event:
        return visit_event(record, after);
      case LaunchKind::parameter:
        return visit_parameter(record);
      case LaunchKind::environment:
        return visit_environment(record);
      case LaunchKind::components:
        return visit_components(record);
      case LaunchKind::gz_server:
        robots_.use_simulator(record.source, world_in(record.arguments));
        return outcome(record, LaunchFate::taken, "doppel is the simulator");
      case LaunchKind::gz_spawn_model:
        return take_spawn(record, model_spawn(record.arguments));
      case LaunchKind::unknown:
        return outcome(record, LaunchFate::unknown, "not known; it is not started");
      case LaunchKind::skipped:
        return outcome(record, LaunchFate::structure, "skipped: " + record.text);
      case LaunchKind::log:
      case LaunchKind::emit:
      case LaunchKind::shutdown:
        return outcome(record, LaunchFate::structure, record.text);
    }
  }

  void visit_event(const LaunchRecord& record, int after) {
    const auto is_own = [&](int id) {
      return std::any_of(plan_.programs.begin(), plan_.programs.end(),
                         [id](const LaunchedProgram& one) { return one.record == id; });
    };
    const auto program = std::find_if(record.after.begin(), record.after.end(), is_own);
    const bool waits = program != record.after.end();
    outcome(record, LaunchFate::structure,
            waits ? "when that program has ended"
                  : "when the twin is ready, instead of the end of another program");
    visit(record.children, waits ? *program : after);
  }

  void visit_parameter(const LaunchRecord& record) {
    const std::string full = bare_namespace(record.name);
    for (const auto& [name, robot] : record.descriptions) {
      robots_.add_description(namespace_of_name(full), robot, record.source, full);
      return outcome(record, LaunchFate::taken, "the robot's description");
    }
    if (!record.path.empty()) {
      robots_.add_ros1_file(full, record.path);
      return outcome(record, LaunchFate::taken, "parameters");
    }
    if (record.name == "/use_sim_time" && record.text == "true") sim_time_ = true;
    outcome(record, LaunchFate::taken, "a parameter");
  }

  // The search paths for models concern the twin itself, all other variables the programs.
  void visit_environment(const LaunchRecord& record) {
    constexpr std::array kSearchPaths = {"GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH",
                                         "GAZEBO_MODEL_PATH", "GAZEBO_RESOURCE_PATH", "SDF_PATH"};
    const bool searched =
        std::find(kSearchPaths.begin(), kSearchPaths.end(), record.name) != kSearchPaths.end();
    if (searched) ::setenv(record.name.c_str(), record.text.c_str(), 1);
    outcome(record, LaunchFate::taken, searched ? "a search path for models" : "for the programs after it");
  }

  void visit_components(const LaunchRecord& record) {
    for (const LaunchRecord& component : record.children) visit_component(component);
    outcome(record, LaunchFate::structure, "");
  }

  void visit_component(const LaunchRecord& record) {
    if (record.executable.find("RobotStatePublisher") != std::string::npos) return take_robot_state(record);
    const LaunchMeaning meaning = launch_meaning(record.package, record.executable);
    if (meaning.role == LaunchRole::bridge) return take_bridge(record);
    const bool done = meaning.role != LaunchRole::other && meaning.role != LaunchRole::absent;
    outcome(record, done ? LaunchFate::taken : LaunchFate::absent,
            meaning.text.empty() ? "not here: components of a container are not loaded"
                                 : std::string(meaning.text));
  }

  void visit_include(const LaunchRecord& record, int after) {
    const std::string file = fs::path(record.path).filename().string();
    const std::string package = record.package.empty() ? package_of(record.path) : record.package;
    const LaunchMeaning meaning = include_meaning(package, file);
    if (meaning.role == LaunchRole::simulator) {
      robots_.use_simulator(record.source, world_in(record.arguments));
      return outcome(record, LaunchFate::taken, std::string(meaning.text));
    }
    if (meaning.role == LaunchRole::spawn) return take_spawn(record, model_spawn(record.arguments));
    if (meaning.role == LaunchRole::absent)
      return outcome(record, LaunchFate::absent, std::string(meaning.text));
    if (meaning.role != LaunchRole::other)
      return outcome(record, LaunchFate::taken, std::string(meaning.text));
    if (record.missing) {
      const bool no_package = !record.package.empty();
      outcome(record, LaunchFate::not_found,
              no_package ? fmt::format("the package '{}' is not on this machine", record.package)
                         : "there is no such file");
      plan_.diagnostics.warning(
          "launch.include", record.source,
          no_package
              ? fmt::format("the launch file '{}' is not read: the package '{}' is not on this machine", file,
                            record.package)
              : fmt::format("the launch file '{}' does not exist", record.path),
          no_package ? "put the package beside this one, if it describes the robot or its controllers" : "");
      return;
    }
    outcome(record, LaunchFate::structure, "");
    visit(record.children, after);
  }

  static std::string package_of(const std::string& path) {
    const fs::path folder = package_around(path);
    return folder.empty() ? "" : package_name(folder);
  }

  void visit_node(const LaunchRecord& record, int after) {
    for (const LaunchRecord& component : record.children) {
      if (record.ros1) {
        for (const auto& [name, robot] : component.descriptions)
          robots_.add_description(record.name_space, robot, record.source);
      } else {
        visit_component(component);
      }
    }
    if (record.parameter("use_sim_time") == "true") sim_time_ = true;
    LaunchMeaning meaning = launch_meaning(record.package, record.executable);
    // Drivers have managers of their own, with the same parameters.
    if (meaning.role == LaunchRole::other && record.executable.find("control_node") != std::string::npos)
      meaning = launch_meaning("controller_manager", "ros2_control_node");
    const std::string text(meaning.text);
    switch (meaning.role) {
      case LaunchRole::robot_state:
        return take_robot_state(record);
      case LaunchRole::manager:
        return take_manager(record);
      case LaunchRole::spawner:
        return take_spawner(record, record.words, record.name_space);
      case LaunchRole::simulator:
        robots_.use_simulator(record.source, world_of_command(record.words));
        return outcome(record, LaunchFate::taken, text);
      case LaunchRole::spawn:
        return spawn_node(record);
      case LaunchRole::bridge:
        return take_bridge(record);
      case LaunchRole::frame:
        return take_frame(record);
      case LaunchRole::joint_sliders:
        for (const auto& [name, robot] : record.descriptions)
          robots_.add_description(record.name_space, robot, record.source);
        return outcome(record, LaunchFate::taken, text);
      case LaunchRole::absent:
        return outcome(record, LaunchFate::absent, text);
      case LaunchRole::page:
      case LaunchRole::drive:
      case LaunchRole::covered:
        return outcome(record, LaunchFate::taken, text);
      case LaunchRole::other:
        break;
    }
    if (!record.children.empty() && !record.ros1) return outcome(record, LaunchFate::structure, "");
    take_program(own_program(record, resolver_, folder_), record, after);
  }

  void take_program(OwnProgram program, const LaunchRecord& record, int after) {
    if (!program.problem.empty()) {
      plan_.diagnostics.note("launch.program", record.source, program.problem, program.fix);
      return outcome(record, LaunchFate::not_found, program.problem);
    }
    outcome(record, LaunchFate::started, "started beside the twin");
    program.start.record = record.id;
    program.start.after = after;
    program.start.required = record.required;
    program.start.source = record.source;
    plan_.programs.push_back(std::move(program.start));
  }

  void visit_process(const LaunchRecord& record, int after) {
    std::vector<std::string> words = record.words;
    if (words.size() == 1 && words.front().find(' ') != std::string::npos) words = split_words(words.front());
    if (words.empty()) return outcome(record, LaunchFate::structure, "an empty command");
    const std::string program = fs::path(words.front()).filename().string();
    if (program == "ros2" || program == "rosrun") return visit_ros2(record, words, after);
    const LaunchMeaning meaning = launch_meaning("", program);
    if (meaning.role == LaunchRole::simulator) {
      robots_.use_simulator(record.source, world_of_command({words.begin() + 1, words.end()}));
      return outcome(record, LaunchFate::taken, std::string(meaning.text));
    }
    if (meaning.role != LaunchRole::other)
      return outcome(record, LaunchFate::taken, std::string(meaning.text));
    for (const char* name : {"rviz2", "rviz", "rqt"}) {
      if (program == name) return outcome(record, LaunchFate::taken, "the page shows it");
    }
    take_program(own_command(record, words), record, after);
  }

  // ros2 control load_controller, ros2 run, and the verbs that doppel has under the same names.
  void visit_ros2(const LaunchRecord& record, const std::vector<std::string>& words, int after) {
    const std::string verb = words.size() > 1 ? words[1] : "";
    const bool run = words.front().ends_with("rosrun");
    if ((run && words.size() > 2) || (verb == "run" && words.size() > 3)) {
      LaunchRecord node = record;
      const std::size_t first = run ? 1 : 2;
      node.kind = LaunchKind::node;
      node.package = words[first];
      node.executable = words[first + 1];
      node.words.assign(words.begin() + static_cast<std::ptrdiff_t>(first) + 2, words.end());
      return visit_node(node, after);
    }
    if (verb == "control") {
      const bool loads =
          words.size() > 2 && (words[2] == "load_controller" || words[2] == "load_start_controller" ||
                               words[2] == "set_controller_state");
      if (loads) return take_loaded_controller(record, words);
    }
    for (const char* same : {"topic", "service", "action", "param", "control", "bag", "lifecycle"}) {
      if (verb != same) continue;
      std::vector<std::string> words_of_doppel = {"doppel"};
      words_of_doppel.insert(words_of_doppel.end(), words.begin() + 1, words.end());
      OwnProgram program;
      program.start = {.label = "doppel " + verb,
                       .words = words_of_doppel,
                       .folder = record.folder,
                       .environment = record.environment};
      return take_program(std::move(program), record, after);
    }
    outcome(record, LaunchFate::absent, fmt::format("not here: ros2 {}", verb));
  }

  void take_loaded_controller(const LaunchRecord& record, const std::vector<std::string>& words) {
    bool active = words[2] != "load_controller";
    std::string manager, controller;
    for (std::size_t i = 3; i < words.size(); ++i) {
      if (words[i] == "--set-state" || words[i] == "-c" || words[i] == "--controller-manager") {
        const std::string value = i + 1 < words.size() ? words[++i] : "";
        if (words[i - 1] == "--set-state") {
          active = value == "active" || value == "start";
        } else {
          manager = value;
        }
      } else if (words[i] == "active" || words[i] == "inactive" || words[i] == "start") {
        active = words[i] != "inactive";
      } else if (!words[i].starts_with('-') && controller.empty()) {
        controller = words[i];
      }
    }
    ControllerSpawn spawn;
    if (!controller.empty()) spawn.names.push_back(controller);
    spawn.manager = manager;
    spawn.active = active;
    take_controllers(record, spawn, "");
  }

  void take_robot_state(const LaunchRecord& record) {
    robots_.need_description();
    std::optional<LaunchedRobotText> robot;
    for (const auto& [name, one] : record.descriptions) robot = one;
    // The publisher of Foxy and before takes a file as its argument.
    if (!robot && !record.words.empty() && fs::is_regular_file(record.words.front())) {
      robot.emplace();
      robot->source = record.words.front();
    }
    outcome(record, LaunchFate::taken, "the robot");
    if (!robot) return;  // of ROS 1: the parameter is elsewhere
    LaunchedDescription& described = robots_.add_description(record.name_space, *robot, record.source);
    described.frame_prefix = record.parameter("frame_prefix").value_or("");
    described.separate_tf =
        std::any_of(record.remappings.begin(), record.remappings.end(),
                    [](const auto& rule) { return rule.first == "/tf" && !rule.second.starts_with('/'); });
  }

  void take_manager(const LaunchRecord& record) {
    robots_.need_description();
    for (const auto& [name, robot] : record.descriptions)
      robots_.add_description(record.name_space, robot, record.source);
    std::vector<fs::path> files;
    for (const LaunchParameters& set : record.parameters) {
      if (!set.file.empty()) files.push_back(set.file);
      if (!set.values.empty())
        files.push_back(robots_.written("controller_manager.yaml", parameters_text(record, set)));
    }
    robots_.add_manager(record.name_space, std::move(files));
    for (const auto& [name, replacement] : record.remappings) add_remapping(name, replacement);
    outcome(record, LaunchFate::taken, "the controller manager");
  }

  // Values for the node of the controller manager, as a parameter file has them.
  static std::string parameters_text(const LaunchRecord& record, const LaunchParameters& set) {
    std::string out =
        fmt::format("{}:\n  ros__parameters:\n", record.name.empty() ? "controller_manager" : record.name);
    for (const auto& [name, value] : set.values) out += fmt::format("    {}: {}\n", name, value);
    return out;
  }

  void take_spawner(const LaunchRecord& record, const std::vector<std::string>& words,
                    const std::string& name_space) {
    ControllerSpawn spawn = controller_spawn(words);
    if (record.executable.starts_with("unspawner")) return outcome(record, LaunchFate::taken, "");
    // spawner of ROS 1 and spawner.py of Foxy have the same words.
    take_controllers(record, spawn, name_space);
  }

  void take_controllers(const LaunchRecord& record, const ControllerSpawn& spawn,
                        const std::string& name_space) {
    robots_.add_spawned(spawn, name_space);
    outcome(record, LaunchFate::taken,
            fmt::format("{}{}", fmt::join(spawn.names, ", "), spawn.active ? "" : " (inactive)"));
  }

  void take_spawn(const LaunchRecord& record, ModelSpawn model) {
    outcome(record, LaunchFate::taken, "in the world");
    robots_.spawn(std::move(model), record.name_space, record.source);
  }

  void spawn_node(const LaunchRecord& record) {
    ModelSpawn words = model_spawn(record.words);
    // create takes parameters as well.
    NamedTexts values;
    for (const char* name : {"topic", "file", "string", "name", "x", "y", "z", "R", "P", "Y"}) {
      if (const auto value = record.parameter(name)) values.emplace_back(name, *value);
    }
    const ModelSpawn parameters = model_spawn(values);
    if (words.topic.empty()) words.topic = parameters.topic;
    if (words.file.empty()) words.file = parameters.file;
    if (words.text.empty()) words.text = parameters.text;
    if (words.name.empty()) words.name = parameters.name;
    if (!words.X_WR) words.X_WR = parameters.X_WR;
    for (const auto& [name, replacement] : record.remappings) {
      if (name == words.topic || name == "/" + words.topic) words.topic = replacement;
    }
    take_spawn(record, words);
  }

  void take_bridge(const LaunchRecord& record) {
    for (const auto& [name, replacement] : record.remappings) add_remapping(name, replacement);
    if (const auto file = record.parameter("config_file")) add_bridge_file(*file);
    outcome(record, LaunchFate::taken, "doppel's topics have their ROS names");
  }

  // The topics of a bridge that have another name in ROS than in Gazebo.
  void add_bridge_file(const std::string& file) {
    if (!fs::is_regular_file(file)) return;
    static const YamlRules kRules{"launch.bridge", "launch.bridge", "launch.bridge", "launch.bridge",
                                  "launch.bridge"};
    try {
      const PlacedYaml root = load_yaml(file, kRules, "bridge's file");
      for (const PlacedYaml& item : root.items) {
        const std::string ros = item["ros_topic_name"].text, gazebo = item["gz_topic_name"].text;
        const std::string older = item["ign_topic_name"].text;
        const std::string& name = gazebo.empty() ? older : gazebo;
        // Gazebo's own names of a world are those of no topic of doppel.
        if (!ros.empty() && !name.empty() && !name.starts_with("/world/") && !name.starts_with("/model/"))
          add_remapping(name, ros);
      }
    } catch (const InputError& error) {
      for (Diagnostic one : error.diagnostics()) {
        one.severity = Severity::warning;
        plan_.diagnostics.add(std::move(one));
      }
    }
  }

  void take_frame(const LaunchRecord& record) {
    std::vector<std::string> words = record.words;
    for (const char* name : {"x", "y", "z", "roll", "pitch", "yaw", "frame_id", "child_frame_id"}) {
      if (const auto value = record.parameter(name)) {
        std::string option = name;
        std::replace(option.begin(), option.end(), '_', '-');
        words.insert(words.end(), {"--" + option, *value});
      }
    }
    const std::optional<StaticTransform> transform = static_transform(words);
    if (!transform) {
      plan_.diagnostics.warning(
          "launch.transform", record.source,
          fmt::format("a static transform has the arguments '{}'", fmt::join(record.words, " ")),
          "write --x 0 --y 0 --z 0 --yaw 0 --pitch 0 --roll 0 --frame-id A --child-frame-id B");
      return outcome(record, LaunchFate::unknown, "its arguments are not those of a transform");
    }
    outcome(record, LaunchFate::taken, fmt::format("{} to {}", transform->parent, transform->child));
    plan_.scenario.transforms.push_back(*transform);
  }

  void add_remapping(const std::string& name, const std::string& replacement) {
    if (name == replacement || name.empty() || replacement.empty() || name.starts_with("~/robot_description"))
      return;
    // The tree of transforms is in one place by the robot's own choice (WorldRobot::tf).
    if (name == "/tf" || name == "/tf_static" || name == "tf" || name == "tf_static" ||
        name == "robot_description")
      return;
    const std::string rule = name + ":=" + replacement;
    if (std::find(remappings_.begin(), remappings_.end(), rule) == remappings_.end())
      remappings_.push_back(rule);
  }

  static std::string world_in(const NamedTexts& arguments) {
    for (const char* name :
         {"gz_args", "ign_args", "world", "world_sdf_file", "world_name", "world_file", "gz_sim_args"}) {
      for (const auto& [key, value] : arguments) {
        if (key == name && !value.empty()) return world_of_command(split_words(value));
      }
    }
    return "";
  }

  [[nodiscard]] RosArguments ros_arguments() {
    std::vector<std::string> words = {"--ros-args"};
    for (const std::string& rule : remappings_) words.insert(words.end(), {"-r", rule});
    try {
      return take_ros_arguments(words);
    } catch (const InputError& error) {
      for (Diagnostic one : error.diagnostics()) {
        one.severity = Severity::warning;
        plan_.diagnostics.add(std::move(one));
      }
    }
    return {};
  }

  PackageResolver& resolver_;
  fs::path folder_;
  const LaunchDescription& description_;
  LaunchPlan plan_;
  std::vector<std::string> remappings_;
  LaunchedRobots robots_;
  bool sim_time_ = false;
};

}  // namespace

LaunchPlan plan_launch(const LaunchDescription& description, PackageResolver& resolver,
                       const fs::path& folder) {
  return Planner(description, resolver, folder).plan();
}

}  // namespace doppel
