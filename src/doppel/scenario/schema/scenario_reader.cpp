// A scenario file to a Scenario.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "doppel/base/core/read_file.h"
#include "doppel/base/yaml/yaml_fields.h"
#include "doppel/physics/contract/world.h"
#include "doppel/scenario/schema/detail/scenario_paths.h"
#include "doppel/scenario/schema/scenario_file.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using schema_detail::read_path;
using schema_detail::read_word;

const YamlRules kRules{"scenario.syntax", "scenario.unreadable", "scenario.too_large", "scenario.invalid",
                       "scenario.unknown_key"};
constexpr int kVersion = 1;
constexpr std::size_t kMaxHeadBytes = 4096;  // in which the key doppel_scenario is

class ScenarioReader : YamlFields {
 public:
  ScenarioReader(const fs::path& file, const std::vector<std::string>& plugins)
      : YamlFields(kRules), file_(file), folder_(fs::absolute(file).parent_path()), plugins_(plugins) {}

  ScenarioFile read() {
    const PlacedYaml root = load_yaml(file_, kRules, "scenario file");
    ScenarioFile out;
    if (fields(root, "a scenario",
               {"doppel_scenario",   "complete",   "robots",       "world",     "engine", "step",
                "start_controllers", "plugins",    "hardware",     "emulation", "mirror", "ideal",
                "enforce_limits",    "guard",      "strict",       "stamp",     "distro", "ros_args",
                "sensors",           "transforms", "content_hash", "files"})) {
      read_version(root);
      read_run(root, out.scenario);
      read_ros(root["ros_args"], out.scenario);
      if (root["sensors"]) read_sensors(root["sensors"], out.scenario.sensors);
      if (root["transforms"]) read_transforms(root["transforms"], out.scenario);
      if (root["robots"]) read_robots(root["robots"], out.scenario);
      if (root["content_hash"]) out.content_hash = text(root["content_hash"], "content_hash");
      if (root["files"]) read_files(root["files"], out.files);
    }
    errors().throw_if_errors();
    return out;
  }

 private:
  void read_version(const PlacedYaml& root) {
    const PlacedYaml& version = root["doppel_scenario"];
    if (!version) return error(root, "a scenario needs the key doppel_scenario", "write doppel_scenario: 1");
    if (number(version, "doppel_scenario") != kVersion)
      error(version, fmt::format("this is version {} of a scenario, but {} is known", version.text, kVersion),
            "write doppel_scenario: 1, or use a newer doppel");
  }

  void read_run(const PlacedYaml& root, Scenario& out) {
    if (root["complete"]) out.complete = flag(root["complete"], "complete");
    if (root["world"]) out.world = read_word(text(root["world"], "world"), folder_);
    if (root["engine"]) out.engine = text(root["engine"], "engine");
    if (root["step"]) {
      const double step = number(root["step"], "step");
      if (!(step >= kMinStep && step <= kMaxStep))
        error(root["step"],
              fmt::format("step is {} s, but must be from {} to {} s", step, kMinStep, kMaxStep));
      out.step = from_seconds(step);
    }
    if (root["start_controllers"])
      out.start_controllers = flag(root["start_controllers"], "start_controllers");
    read_plugins(root, out);
    if (root["hardware"])
      out.hardware = static_cast<HardwareUse>(
          choice(root["hardware"], "hardware", {"simulated", "emulated", "ports", "real"}));
    if (root["mirror"])
      out.mirror =
          static_cast<MirrorMode>(choice(root["mirror"], "mirror", {"shadow", "follow", "off", "rehearse"}));
    if (root["emulation"]) read_emulation(root["emulation"], out.emulation);
    if (root["ideal"]) out.ideal = flag(root["ideal"], "ideal");
    if (root["enforce_limits"]) out.enforce_limits = flag(root["enforce_limits"], "enforce_limits");
    if (root["guard"]) out.guard = flag(root["guard"], "guard");
    if (root["strict"]) out.strict = flag(root["strict"], "strict");
    if (root["distro"]) {
      out.distro = static_cast<Distro>(choice(root["distro"], "distro", distro_names()));
    } else if (out.complete) {
      out.distro = Distro::jazzy;
    }
    if (root["stamp"]) out.wall_stamps = choice(root["stamp"], "stamp", {"sim", "wall"}) == 1;
  }

  // Finds the libraries of the file in those of the user.
  void read_plugins(const PlacedYaml& root, Scenario& out) {
    const auto name_of = [](const std::string& library) { return fs::path(library).filename(); };
    const PlacedYaml& value = root["plugins"];
    std::vector<std::string> unused = plugins_;
    for (const std::string& written : value ? texts(value, "plugins") : std::vector<std::string>{}) {
      const auto named = std::ranges::find(unused, name_of(written), name_of);
      if (named == unused.end()) {
        error(value,
              fmt::format("the run needs the library '{}', and a file alone does not load code", written),
              fmt::format("if you trust it, name it: --plugin FOLDER/{}", name_of(written).string()));
        continue;
      }
      out.plugins.push_back(std::move(*named));
      unused.erase(named);
    }
    for (const std::string& library : unused)
      error(value ? value : root, fmt::format("the run does not need the library '{}'", library),
            "leave out its --plugin, or add it to 'plugins'");
  }

  void read_ros(const PlacedYaml& value, Scenario& out) {
    if (!value) return;
    std::vector<std::string> words = texts(value, "ros_args");
    for (std::size_t i = 1; i < words.size(); ++i)
      if (words[i - 1] == "--params-file") words[i] = read_path(words[i], folder_).string();
    words.insert(words.begin(), "--ros-args");
    try {
      out.ros = take_ros_arguments(words);
    } catch (const InputError& refused) {
      for (const Diagnostic& diagnostic : refused.diagnostics())
        error(value, diagnostic.message, diagnostic.fix);
    }
  }

  void read_emulation(const PlacedYaml& value, EmulationOptions& out) {
    if (!fields(value, "emulation", {"faults", "seed", "hand", "servos"})) return;
    if (value["faults"]) out.faults = read_path(text(value["faults"], "faults"), folder_);
    if (value["seed"]) out.seed = whole<std::uint64_t>(value["seed"], "seed");
    if (value["hand"])
      out.hand = static_cast<HandMotion>(choice(value["hand"], "hand", {"none", "guide", "sweep"}));
    if (value["servos"])
      out.servos = static_cast<ServoProtocol>(
          choice(value["servos"], "servos", {"servo_line", "feetech", "dynamixel"}));
  }

  void read_sensors(const PlacedYaml& value, RigOptions& out) {
    if (!fields(value, "sensors", {"seed", "lockstep", "threads"})) return;
    if (value["seed"]) out.seed = whole<std::uint64_t>(value["seed"], "seed");
    if (value["lockstep"]) out.lockstep = flag(value["lockstep"], "lockstep");
    if (value["threads"]) out.threads = whole<int>(value["threads"], "threads");
  }

  template <class Number>
  Number whole(const PlacedYaml& value, const std::string& what) {
    Number out = 0;
    const char* const end = value.text.data() + value.text.size();
    const auto [rest, problem] = std::from_chars(value.text.data(), end, out);
    if (!value.is_scalar() || problem != std::errc() || rest != end || out < 0) {
      error(value, fmt::format("{} must be a whole number, 0 or more", what));
      return 0;
    }
    return out;
  }

  void read_transforms(const PlacedYaml& value, Scenario& out) {
    if (!value.is_list()) return error(value, "transforms must be a list");
    for (const PlacedYaml& item : value.items) {
      if (!fields(item, "a transform", {"parent", "child", "xyz", "rpy", "rotation"})) continue;
      for (const char* key : {"parent", "child"})
        if (!item[key])
          error(item, fmt::format("a transform needs the key '{}'", key), "give the name of a frame");
      if (item["parent"] && item["child"])
        out.transforms.push_back(
            {text(item["parent"], "parent"), text(item["child"], "child"), read_pose(item)});
    }
  }

  void read_robots(const PlacedYaml& value, Scenario& out) {
    if (!value.is_list()) return error(value, "robots must be a list");
    for (const PlacedYaml& item : value.items) {
      if (!fields(item, "a robot",
                  {"robot", "namespace", "xyz", "rpy", "rotation", "arguments", "controllers", "activate",
                   "base", "tf", "tolerant", "choices"}))
        continue;
      out.robots.push_back(read_robot(item));
      if (item["choices"]) read_choices(item["choices"], out.choices[out.robots.back().name_space]);
      if (out.complete && !item["choices"])
        error(item, "the scenario is complete, but this robot has no choices",
              "write choices: {}, or complete: false");
    }
  }

  WorldRobot read_robot(const PlacedYaml& value) {
    WorldRobot robot;
    robot.source = value.where;
    if (value["robot"]) {
      robot.target = read_word(text(value["robot"], "robot"), folder_);
    } else {
      error(value, "a robot needs the key 'robot'", "give a bundled robot, a file or a package folder");
    }
    if (value["namespace"]) robot.name_space = text(value["namespace"], "namespace");
    if (value["xyz"] || value["rpy"] || value["rotation"]) robot.X_WR = read_pose(value);
    if (value["arguments"]) read_arguments(value["arguments"], robot);
    if (value["controllers"].is_list()) {
      for (const std::string& file : texts(value["controllers"], "controllers"))
        robot.controllers.emplace_back(read_word(file, folder_));
    } else if (value["controllers"]) {
      robot.controllers = {read_word(text(value["controllers"], "controllers"), folder_)};
    }
    if (value["tolerant"]) robot.tolerant = flag(value["tolerant"], "tolerant");
    if (value["activate"]) robot.activate = texts(value["activate"], "activate");
    if (value["base"])
      robot.base =
          choice(value["base"], "base", {"fixed", "floating"}) == 1 ? BaseKind::floating : BaseKind::fixed;
    if (value["tf"]) {
      const std::vector<std::string> kinds(std::begin(kTfTopicsNames), std::end(kTfTopicsNames));
      robot.tf = static_cast<TfTopics>(choice(value["tf"], "tf", kinds));
    }
    return robot;
  }

  Pose read_pose(const PlacedYaml& value) {
    const Eigen::Vector3d xyz = value["xyz"] ? vector(value["xyz"], "xyz") : Eigen::Vector3d(0, 0, 0);
    const Eigen::Vector3d rpy = value["rpy"] ? vector(value["rpy"], "rpy") : Eigen::Vector3d(0, 0, 0);
    Pose X = make_pose(xyz, rpy);
    if (!value["rotation"]) return X;
    const std::vector<double> R = numbers(value["rotation"], "rotation", 9);
    X.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data());
    if (!X.linear().isUnitary(1e-9) || X.linear().determinant() < 0)
      error(value["rotation"], "rotation must be the nine numbers of a rotation matrix, row by row",
            "write rpy: [roll, pitch, yaw] instead");
    return X;
  }

  Eigen::Vector3d vector(const PlacedYaml& value, const std::string& what) {
    return Eigen::Vector3d(numbers(value, what, 3).data());
  }

  void read_arguments(const PlacedYaml& value, WorldRobot& robot) {
    if (!value.is_map()) return error(value, "arguments must be a map of names and values");
    for (std::size_t i = 0; i < value.keys.size(); ++i) {
      if (value.keys[i].is_scalar() && value.items[i].is_scalar()) {
        robot.arguments.emplace_back(value.keys[i].text, value.items[i].text);
      } else {
        error(value.keys[i], "an argument must be a name and one value");
      }
    }
  }

  void read_choices(const PlacedYaml& value, RobotChoices& out) {
    if (!fields(value, "choices",
                {"controllers", "parameters", "active", "inactive", "generated_hardware", "masses"}))
      return;
    if (value["controllers"])
      for (const std::string& file : texts(value["controllers"], "controllers"))
        out.controllers.push_back(read_path(file, folder_));
    if (value["parameters"]) out.parameters = texts(value["parameters"], "parameters");
    if (value["active"]) out.active = texts(value["active"], "active");
    if (value["inactive"]) out.inactive = texts(value["inactive"], "inactive");
    if (value["generated_hardware"])
      out.generated_hardware = flag(value["generated_hardware"], "generated_hardware");
    if (value["masses"]) read_masses(value["masses"], out.masses);
  }

  void read_masses(const PlacedYaml& value, LinkMasses& out) {
    if (!value.is_map()) return error(value, "masses must be a map of links and their masses");
    for (std::size_t i = 0; i < value.keys.size(); ++i) {
      const PlacedYaml& link = value.items[i];
      if (!fields(link, "the mass of a link", {"mass", "com", "inertia"})) continue;
      MassProperties& mass = out[value.keys[i].text];
      // A key that is missing has no place; its error is at the link's.
      const auto required = [&link](const char* key) -> const PlacedYaml& {
        return link[key] ? link[key] : link;
      };
      mass.mass = number(required("mass"), "mass");
      if (!(mass.mass > 0)) error(link, "mass must be positive");
      if (link["com"]) mass.com = vector(link["com"], "com");
      const std::vector<double> I = numbers(required("inertia"), "inertia", 6);
      mass.I << I[0], I[1], I[2], I[1], I[3], I[4], I[2], I[4], I[5];
    }
  }

  void read_files(const PlacedYaml& value, std::vector<ReadFile>& out) {
    if (!value.is_map()) return error(value, "files must be a map of paths and SHA-256 hashes");
    for (std::size_t i = 0; i < value.keys.size(); ++i)
      out.push_back(
          {read_path(value.keys[i].text, folder_), text(value.items[i], "a hash"), value.keys[i].where});
  }

  fs::path file_, folder_;
  const std::vector<std::string>& plugins_;
};

}  // namespace

bool is_scenario_file(const fs::path& file) {
  const std::string head = beginning_of_file(file, kMaxHeadBytes);
  const std::size_t key = head.find("doppel_scenario");
  if (key == std::string::npos) return false;
  // A key of YAML begins its line; in JSON it is quoted.
  return key == 0 || head[key - 1] == '\n' || head[key - 1] == '"';
}

ScenarioFile load_scenario(const fs::path& file, const fs::path& bundled_robots,
                           const std::vector<std::string>& plugins) {
  ScenarioFile out = ScenarioReader(file, plugins).read();
  out.scenario.bundled_robots = bundled_robots;
  return out;
}

void report_changed_files(const ScenarioFile& file, Diagnostics& diagnostics) {
  for (const ReadFile& before : file.files) {
    const ReadFile now = files_with_hashes({before.file}).front();
    if (now.sha256 == before.sha256) continue;
    const char* const change = before.sha256 == kNoFile ? "exists now, which it did not when"
                               : now.sha256 == kNoFile  ? "no longer exists, which it did when"
                                                        : "has changed since";
    diagnostics.note("scenario.file_changed", before.where,
                     fmt::format("'{}' {} the scenario was written", before.file.string(), change),
                     "write the scenario again with --write-scenario if the change is intended");
  }
}

}  // namespace doppel
