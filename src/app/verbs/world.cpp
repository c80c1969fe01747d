// doppel world info|check|tree|convert|fetch FILE: SDF worlds and models without simulating them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/description_target.h"
#include "app/output.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/installation.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/base/core/text.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/review/conversion/tree.h"
#include "doppel/review/conversion/world_documents.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

struct WorldOptions {
  std::string file, out, format;
  bool json = false, quiet = false;
};

struct OpenedWorld {
  PackageResolver resolver;
  std::filesystem::path file;
  SdfWorld world;
  Diagnostics found;
};

void open_sdf(const std::string& name, OpenedWorld& out) {
  out.resolver.add_bundled(data_folder() / "robots");
  out.file = find_world(name, out.resolver, true);
  if (!is_sdf(out.file)) {
    throw InputError("world.not_sdf", make_location(out.file.string()),
                     "the verbs of `doppel world` are for SDF files",
                     "a YAML world is checked when it is started: doppel up TARGET --world FILE");
  }
  out.world = load_sdf(out.file, out.resolver, out.found);
}

std::size_t moving_joints(const RobotDescription& robot) {
  return static_cast<std::size_t>(
      std::count_if(robot.joints.begin(), robot.joints.end(),
                    [](const Joint& joint) { return joint.type != JointType::fixed; }));
}

std::string kind_of(const SdfModel& model) {
  if (model.is_static) return "static";
  return model.base == BaseKind::fixed ? "fixed to the world" : "free";
}

double mass_of(const RobotDescription& robot) {
  double out = 0;
  for (const Link& link : robot.links) out += link.inertial ? link.inertial->mass : 0;
  return out;
}

Json xyz_json(const Eigen::Vector3d& v) {
  return Json{v.x(), v.y(), v.z()};
}

Json info_json(const OpenedWorld& opened) {
  const SdfWorld& world = opened.world;
  Json out{{"version", 1}, {"world", world.settings.name}, {"sdf", world.version}, {"files", Json::array()}};
  for (const auto& file : world.files) out["files"].push_back(shown_path(file));
  out["gravity"] = xyz_json(world.settings.gravity);
  out["step"] = to_seconds(world.settings.step);
  out["ground"] = world.settings.ground;
  out["models"] = Json::array();
  for (const SdfModel& model : world.models) {
    Json sensors = Json::array(), plugins = Json::array();
    for (const SdfSensor& sensor : model.sensors)
      sensors.push_back({{"name", sensor.name}, {"type", sensor.type}, {"link", sensor.link}});
    for (const GazeboExtension& extension : model.description->gazebo) {
      for (const GazeboPlugin& plugin : extension.plugins)
        plugins.push_back({{"name", plugin.name}, {"filename", plugin.filename}});
    }
    out["models"].push_back({{"name", model.name},
                             {"kind", kind_of(model)},
                             {"xyz", xyz_json(model.X_WR.translation())},
                             {"rpy", xyz_json(rpy_from_rotation(model.X_WR.linear()))},
                             {"links", model.description->links.size()},
                             {"joints", moving_joints(*model.description)},
                             {"mass", mass_of(*model.description)},
                             {"sensors", sensors},
                             {"plugins", plugins}});
  }
  out["lights"] = Json::array();
  for (const Light& light : world.settings.lights)
    out["lights"].push_back({{"name", light.name}, {"type", name_of(light.kind)}});
  out["missing"] = world.missing;
  return out;
}

std::string info_text(const OpenedWorld& opened) {
  const SdfWorld& world = opened.world;
  std::string out = fmt::format("{} '{}', SDF {}\n", world.is_world ? "world" : "models", world.settings.name,
                                world.version.empty() ? "without a version" : world.version);
  const Eigen::Vector3d& g = world.settings.gravity;
  out +=
      fmt::format("  gravity  {:g} {:g} {:g} m/s^2, step {:g} s, {}\n", g.x(), g.y(), g.z(),
                  to_seconds(world.settings.step), world.settings.ground ? "ground at z = 0" : "no ground");
  std::size_t fixed = 0, joints = 0, sensors = 0;
  std::size_t width = 4;
  for (const SdfModel& model : world.models) {
    fixed += model.is_static ? 1 : 0;
    joints += moving_joints(*model.description);
    sensors += model.sensors.size();
    width = std::max(width, model.name.size());
  }
  out += fmt::format("  models   {}, of which {} static; {} joints, {} sensors, {} lights\n",
                     world.models.size(), fixed, joints, sensors, world.settings.lights.size());
  for (const SdfModel& model : world.models) {
    const Eigen::Vector3d& p = model.X_WR.translation();
    out += fmt::format("    {:<{}}  {} link{}, {} joints, {}", model.name, width,
                       model.description->links.size(), model.description->links.size() == 1 ? "" : "s",
                       moving_joints(*model.description), kind_of(model));
    if (!model.is_static) out += fmt::format(", {:.4g} kg", mass_of(*model.description));
    out += fmt::format(", at {:.3g} {:.3g} {:.3g}\n", p.x(), p.y(), p.z());
  }
  if (!world.missing.empty()) out += fmt::format("  missing  {}\n", fmt::join(world.missing, ", "));
  return out;
}

int run_world_info(const WorldOptions& options) {
  OpenedWorld opened;
  open_sdf(options.file, opened);
  deliver(options.json ? info_json(opened).dump(2) + "\n" : info_text(opened));
  return 0;
}

// Reads and compiles as `doppel up` does.
void compile_as_up(const OpenedWorld& opened, Diagnostics& found) {
  CollisionMeshes meshes;
  std::vector<ModelInstance> instances;
  for (const SdfModel& model : opened.world.models)
    instances.push_back(make_instance(model, "", meshes, found));
  static_cast<void>(
      compile_world(kDefaultEngine, opened.world.settings, std::move(instances), found)->make_engine());
}

int run_world_check(const WorldOptions& options) {
  OpenedWorld opened;
  open_sdf(options.file, opened);
  compile_as_up(opened, opened.found);
  if (options.json) {
    Json out{{"version", 1}, {"file", shown_path(opened.file)}, {"findings", Json::array()}};
    for (const Diagnostic& one : opened.found.all()) {
      out["findings"].push_back({{"rule", one.rule},
                                 {"severity", to_string(one.severity)},
                                 {"file", one.where.file ? *one.where.file : ""},
                                 {"line", one.where.line},
                                 {"column", one.where.column},
                                 {"message", one.message},
                                 {"fix", one.fix}});
    }
    deliver(out.dump(2) + "\n");
    return 0;
  }
  std::string text;
  for (const Diagnostic& one : opened.found.all()) {
    if (!options.quiet || one.severity != Severity::note) text += one.str() + "\n";
  }
  text += fmt::format("{}: {} models, {} warnings, {} notes\n", shown_path(opened.file),
                      opened.world.models.size(), opened.found.count(Severity::warning),
                      opened.found.count(Severity::note));
  deliver(text);
  return 0;
}

int run_world_tree(const WorldOptions& options) {
  OpenedWorld opened;
  open_sdf(options.file, opened);
  std::string out = opened.world.settings.name + "\n";
  for (const SdfModel& model : opened.world.models) {
    out += fmt::format("{} ({})\n", model.name, kind_of(model));
    std::string tree = tree_text(*model.description, true);
    for (std::size_t at = 0; at < tree.size(); at = tree.find('\n', at) + 1) {
      out += "  " + tree.substr(at, tree.find('\n', at) + 1 - at);
      if (tree.find('\n', at) == std::string::npos) break;
    }
  }
  deliver(out);
  return 0;
}

// sdf, yaml or mjcf, by --to or the file's extension.
std::string chosen_format(const WorldOptions& options) {
  static const std::vector<std::string> kFormats{"sdf", "yaml", "mjcf"};
  std::string wanted = lowered(options.format);
  const std::string extension = lowered(std::filesystem::path(options.out).extension().string());
  if (wanted.empty()) {
    wanted = extension == ".xml" ? "mjcf" : extension == ".yml" || extension == ".yaml" ? "yaml" : "sdf";
  }
  if (std::ranges::find(kFormats, wanted) == kFormats.end()) {
    throw InputError("cli.format", {},
                     fmt::format("'{}' is not an output format{}", wanted, did_you_mean(wanted, kFormats)),
                     "--to takes sdf, yaml or mjcf");
  }
  return wanted;
}

// The world as one file: no includes, all poses relative to the world.
int run_world_convert(const WorldOptions& options) {
  const std::string format = chosen_format(options);
  OpenedWorld opened;
  open_sdf(options.file, opened);
  refuse_own_source(options.out, opened.world.files, "write to another file");
  MeshPlacement placement;
  placement.out_folder = options.out.empty() || options.out == "-"
                             ? std::filesystem::current_path()
                             : std::filesystem::absolute(options.out).parent_path();
  MeshFiles meshes(placement);
  Diagnostics found;
  const std::string text = format == "yaml"   ? to_world_yaml(opened.world, meshes, found)
                           : format == "mjcf" ? to_world_mjcf(opened.world, meshes, found)
                                              : to_world_sdf(opened.world, meshes, found);
  print_diagnostics(found, true);
  meshes.write();
  deliver(text, options.out);
  return 0;
}

int run_world_fetch(const WorldOptions& options) {
  OpenedWorld opened;
  open_sdf(options.file, opened);
  std::string out;
  for (const std::string& uri : opened.world.missing) {
    const bool named = uri.starts_with("model://");
    const std::string name = named ? uri.substr(8, uri.find('/', 8) - 8) : uri;
    out += named ? fmt::format("https://fuel.gazebosim.org/1.0/OpenRobotics/models/{}\n", name) : uri + "\n";
  }
  deliver(out);
  return 0;
}

using Run = int (*)(const WorldOptions&);

CLI::App* add_one(CLI::App& world, const char* name, const char* about, Run run, int& exit_code,
                  const std::shared_ptr<WorldOptions>& options) {
  CLI::App* const verb = world.add_subcommand(name, about);
  verb->add_option("FILE", options->file,
                   "An SDF file, a model's folder, a bundled world, or a name on GZ_SIM_RESOURCE_PATH")
      ->required();
  verb->footer(fmt::format("Example:\n  doppel world {} my_world.sdf", name));
  verb->callback([options, run, &exit_code] { exit_code = run(*options); });
  return verb;
}

}  // namespace

void add_world(CLI::App& app, int& exit_code) {
  CLI::App* const world = app.add_subcommand("world", "Look at SDF worlds and models");
  world->require_subcommand(1);
  world->footer("Example:\n  doppel world check my_world.sdf");
  const auto options = std::make_shared<WorldOptions>();
  add_one(*world, "info", "Print what a world contains", run_world_info, exit_code, options)
      ->add_flag("--json", options->json, "Print a JSON object to stdout, in SI units");
  CLI::App* const check = add_one(
      *world, "check", "Read and compile a world as 'up' does, and print what is wrong or without effect",
      run_world_check, exit_code, options);
  check->add_flag("--json", options->json, "Print a JSON object to stdout");
  check->add_flag("--quiet", options->quiet, "Omit notes");
  add_one(*world, "tree", "Print the links and joints of every model", run_world_tree, exit_code, options);
  CLI::App* const convert = add_one(
      *world, "convert", "Write a world as one file without includes, with resolved poses: SDF, YAML or MJCF",
      run_world_convert, exit_code, options);
  convert->add_option("-o,--out", options->out, "File to write; default: stdout");
  convert->add_option(
      "--to", options->format,
      "sdf, yaml (a world file of doppel) or mjcf (default: by the file's extension, else sdf)");
  add_one(*world, "fetch", "Print the URLs of missing models, for a machine with a network", run_world_fetch,
          exit_code, options);
}

}  // namespace doppel::app
