#include "doppel/scenario/launch/detail/launched_robots.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/output_file.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/xml/xml.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDescription = "robot_description";

std::string joined_name(const std::string& name_space, const std::string& name) {
  if (name.starts_with('/')) return bare_namespace(name);
  const std::string bare = bare_namespace(name_space);
  return bare.empty() ? name : bare + "/" + name;
}

std::string last_word(const std::string& path) {
  return fs::path(path).filename().string();
}

bool is_sdf_text(const std::string& text) {
  return text.find("<sdf") != std::string::npos;
}

}  // namespace

std::string namespace_of_name(const std::string& full_name) {
  const std::size_t slash = full_name.find_last_of('/');
  return slash == std::string::npos ? "" : full_name.substr(0, slash);
}

void LaunchedRobots::add_manager(const std::string& name_space, std::vector<fs::path> files) {
  uses_description_ = true;
  managers_.push_back({bare_namespace(name_space), std::move(files)});
}

void LaunchedRobots::finish(LaunchPlan& plan) {
  match_spawns();
  take_sdf_descriptions();
  choose_physics(plan);
  for (const LaunchedDescription& one : described_) add_robot(one, plan);
  if (!plan.physics) return;
  choose_world(plan);
  add_controllers(plan);
}

LaunchedDescription& LaunchedRobots::add_description(const std::string& name_space,
                                                     const LaunchedRobotText& robot,
                                                     const SourceLocation& source, std::string parameter) {
  const std::string bare = bare_namespace(name_space);
  if (parameter.empty()) parameter = joined_name(bare, kDescription);
  const auto same = std::find_if(described_.begin(), described_.end(),
                                 [&](const LaunchedDescription& one) { return one.parameter == parameter; });
  if (same != described_.end()) return *same;
  described_.push_back({.parameter = parameter, .name_space = bare, .robot = robot, .source = source});
  return described_.back();
}

void LaunchedRobots::add_spawned(const ControllerSpawn& spawn, const std::string& name_space) {
  uses_description_ = true;
  const std::string manager = spawn.manager.empty() ? name_space + "/controller_manager" : spawn.manager;
  const std::string owner = spawn.manager.empty() || spawn.manager.starts_with('/')
                                ? namespace_of_name(bare_namespace(manager))
                                : namespace_of_name(joined_name(name_space, spawn.manager));
  const auto same = std::find_if(spawned_.begin(), spawned_.end(),
                                 [&](const Spawned& one) { return one.name_space == owner; });
  Spawned& out = same == spawned_.end() ? spawned_.emplace_back() : *same;
  out.name_space = owner;
  // Those that are not active are loaded with the others of the files.
  for (const std::string& name : spawn.names) {
    const bool is_new = std::find(out.active.begin(), out.active.end(), name) == out.active.end();
    if (spawn.active && is_new) out.active.push_back(name);
  }
  for (const std::string& file : spawn.files) out.files.emplace_back(file);
}

void LaunchedRobots::spawn(ModelSpawn model, const std::string& name_space, const SourceLocation& source) {
  simulator_ = true;
  uses_description_ = true;
  // A model of an SDF file stays a file; a URDF file or text is a robot.
  if (model.file.empty() && model.text.empty() && model.database.empty()) {
    spawns_.push_back(
        {joined_name(name_space, model.topic.empty() ? kDescription : model.topic), model.name, model.X_WR});
    return;
  }
  const std::string uri = model.database.empty() ? model.file : "model://" + model.database;
  if (!model.database.empty() || is_sdf(model.file) || is_sdf_text(model.text)) {
    if (!model.text.empty()) model.file = written("model.sdf", model.text).string();
    files_.push_back({.uri = model.database.empty() ? "file://" + fs::absolute(model.file).string() : uri,
                      .name = model.name,
                      .X_WM = model.X_WR.value_or(Pose::Identity())});
    return;
  }
  LaunchedRobotText robot = text_with_source(model);
  LaunchedDescription& described =
      add_description(model.name_space.empty() ? name_space : model.name_space, robot, source);
  described.spawned = true;
  described.X_WR = model.X_WR;
}

// A text that a launch file has expanded is given to the spawner, too.
LaunchedRobotText LaunchedRobots::text_with_source(const ModelSpawn& model) const {
  LaunchedRobotText robot;
  if (!model.text.empty()) {
    const auto same = std::find_if(described_.begin(), described_.end(), [&](const LaunchedDescription& one) {
      return one.robot.text == model.text;
    });
    if (same != described_.end()) return same->robot;
    robot.text = model.text;
    return robot;
  }
  robot.source = model.file;
  return robot;
}

void LaunchedRobots::use_simulator(const SourceLocation& source, const std::string& world) {
  simulator_ = true;
  if (world.empty() || !world_.empty()) return;
  world_ = world;
  world_source_ = source;
}

void LaunchedRobots::match_spawns() {
  for (const Spawn& spawn : spawns_) {
    auto found = std::find_if(described_.begin(), described_.end(), [&](const LaunchedDescription& one) {
      return one.parameter == spawn.parameter;
    });
    if (found == described_.end() && described_.size() == 1) found = described_.begin();
    if (found == described_.end()) continue;
    found->spawned = true;
    if (spawn.X_WR) found->X_WR = spawn.X_WR;
    // A second model in a namespace, such as a table beside a robot, has the name of its spawner.
    const bool is_robot = found->parameter == joined_name(found->name_space, kDescription);
    if (!is_robot) found->name_space = spawn.name.empty() ? last_word(found->parameter) : spawn.name;
  }
}

// robot_state_publisher reads SDF, too; such a robot is a model of the world.
void LaunchedRobots::take_sdf_descriptions() {
  std::erase_if(described_, [this](const LaunchedDescription& one) {
    const bool is_file = !one.robot.source.empty() && is_sdf(one.robot.source);
    if (!is_file && !is_sdf_text(one.robot.text)) return false;
    // A model that nothing spawns is in the world already.
    if (!one.spawned && !world_.empty()) return true;
    const fs::path file = is_file ? one.robot.source : written("model.sdf", one.robot.text);
    files_.push_back({.uri = "file://" + fs::absolute(file).string(),
                      .name = one.name_space,
                      .X_WM = one.X_WR.value_or(Pose::Identity())});
    return true;
  });
}

void LaunchedRobots::choose_physics(LaunchPlan& plan) {
  plan.needs_description = described_.empty() && files_.empty() && uses_description_;
  plan.physics = simulator_ || !managers_.empty() || !spawned_.empty() || !files_.empty();
  // A description that is published for transforms only, beside a model of an SDF file.
  if (!files_.empty()) std::erase_if(described_, [](const LaunchedDescription& one) { return !one.spawned; });
}

fs::path LaunchedRobots::written(const std::string& name, const std::string& text) const {
  fs::path file = folder_ / name;
  for (int i = 2; fs::exists(file); ++i) file = folder_ / fmt::format("{}_{}", i, name);
  write_whole(file, text);
  return file;
}

void LaunchedRobots::add_robot(const LaunchedDescription& one, LaunchPlan& plan) const {
  WorldRobot& robot = plan.scenario.robots.emplace_back();
  robot.target =
      one.robot.source.empty() ? written("robot.urdf", one.robot.text).string() : one.robot.source.string();
  robot.arguments = one.robot.arguments;
  robot.name_space = one.name_space;
  robot.X_WR = one.X_WR;
  robot.source = one.source;
  if (one.separate_tf) robot.tf = TfTopics::separate;
  if (!one.frame_prefix.empty() && !one.name_space.empty()) robot.tf = TfTopics::prefixed;
}

void LaunchedRobots::choose_world(LaunchPlan& plan) {
  std::optional<fs::path> world;
  const std::string name = last_word(world_);
  if (!world_.empty() && name != "empty.sdf" && name != "empty.world" && name != "empty_world.sdf" &&
      name != "empty_world.world" && name != "empty") {
    try {
      world = find_world(world_, resolver_, true);
    } catch (const InputError& error) {
      plan.diagnostics.warning("launch.world", world_source_,
                               fmt::format("the world '{}' is not found; the ground is empty", world_),
                               "put its folder on GZ_SIM_RESOURCE_PATH");
    }
  }
  plan.scenario.world = files_.empty() ? world : std::optional(world_with_models(world));
}

// A world with the models that spawners put into it.
fs::path LaunchedRobots::world_with_models(const std::optional<fs::path>& world) const {
  std::string models;
  for (const SpawnedFile& file : files_) {
    const Eigen::Vector3d p = file.X_WM.translation(), rpy = rpy_from_rotation(file.X_WM.linear());
    models += fmt::format(
        "<include><uri>{}</uri>{}<pose>{} {} {} {} {} {}</pose></include>\n", escape_xml(file.uri, false),
        file.name.empty() ? "" : fmt::format("<name>{}</name>", escape_xml(file.name, false)), p.x(), p.y(),
        p.z(), rpy.x(), rpy.y(), rpy.z());
  }
  std::string text;
  if (world && is_sdf(*world)) {
    constexpr std::size_t kMaxWorld = 64U << 20;
    text = read_file(world->string(), kMaxWorld);
    const std::size_t end = text.rfind("</world>");
    if (end != std::string::npos) return written(world->filename().string(), text.insert(end, models));
  }
  return written("spawned.sdf",
                 fmt::format("<sdf version=\"1.9\"><world name=\"default\">\n"
                             "<model name=\"ground_plane\"><static>true</static><link name=\"link\">"
                             "<collision name=\"collision\"><geometry><plane><normal>0 0 1</normal>"
                             "<size>100 100</size></plane></geometry></collision></link></model>\n"
                             "{}</world></sdf>\n",
                             models));
}

void LaunchedRobots::add_controllers(LaunchPlan& plan) const {
  for (WorldRobot& robot : plan.scenario.robots) {
    const auto is_of = [&](const auto& one) { return one.name_space == robot.name_space; };
    const auto spawned = std::find_if(spawned_.begin(), spawned_.end(), is_of);
    const auto manager = std::find_if(managers_.begin(), managers_.end(), is_of);
    if (manager != managers_.end()) robot.controllers = manager->files;
    if (spawned != spawned_.end()) {
      for (const fs::path& file : spawned->files) {
        if (!is_substituted(file)) robot.controllers.push_back(file);
      }
      robot.activate = spawned->active;
    }
    if (robot.controllers.empty()) robot.controllers = ros1_controllers(robot.name_space);
    std::erase_if(robot.controllers, [](const fs::path& file) { return !fs::is_regular_file(file); });
    for (fs::path& file : robot.controllers) file = fs::canonical(file);
    robot.tolerant = true;
  }
  // Nothing is started that the launch file does not start; a model of an SDF file brings its plugins.
  if (spawned_.empty() && files_.empty()) plan.scenario.start_controllers = false;
}

// A file that the manager has with performed substitutions, and a spawner as it is written.
bool LaunchedRobots::is_substituted(const fs::path& file) const {
  return std::any_of(made_files_.begin(), made_files_.end(), [&](const auto& pair) {
    return pair.second.lexically_normal() == file.lexically_normal();
  });
}

std::vector<fs::path> LaunchedRobots::ros1_controllers(const std::string& name_space) const {
  std::vector<fs::path> out;
  for (const auto& [name, file] : ros1_files_) {
    if ((name == name_space || name.starts_with(name_space + "/")) &&
        file.filename().string().find("control") != std::string::npos)
      out.push_back(file);
  }
  return out;
}

}  // namespace doppel
