// doppel convert: the description for other tools.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/found_controllers.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/review/conversion/absolute_paths.h"
#include "doppel/review/conversion/joint_limits.h"
#include "doppel/review/conversion/mjcf_export.h"
#include "doppel/review/conversion/sdf.h"
#include "doppel/review/conversion/srdf.h"
#include "doppel/review/conversion/urdf.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct ConvertOptions {
  std::vector<std::string> target;
  std::string format, out, copy_meshes, controllers, base = "fixed";
  bool package_uris = false, hulls = false, spheres = false;
  int samples = 10000;
  std::uint64_t seed = 1;
};

const std::vector<std::string> kFormats = {"urdf", "sdf", "mjcf", "srdf", "joint_limits"};
const Eigen::Vector3d kGravity(0, 0, -9.81);  // m/s^2

// The format that a file's name stands for; "": it has no extension.
std::string format_of(const fs::path& file) {
  const std::string extension = lowered(file.extension().string());
  if (extension == ".xml") return "mjcf";
  const bool yaml = extension == ".yaml" || extension == ".yml";
  if (yaml && file.stem().string().ends_with("joint_limits")) return "joint_limits";
  return extension.empty() ? "" : extension.substr(1);
}

std::string choose_format(const ConvertOptions& options) {
  std::string wanted = lowered(options.format);
  if (wanted.empty()) {
    wanted = format_of(options.out);
    if (wanted.empty()) {
      throw InputError("cli.format", {}, "no output format is given",
                       "add --to urdf, sdf, mjcf, srdf or joint_limits, or name a file with such an "
                       "extension, or joint_limits.yaml, with -o");
    }
  }
  if (std::find(kFormats.begin(), kFormats.end(), wanted) == kFormats.end()) {
    throw InputError("cli.format", {},
                     fmt::format("'{}' is not an output format{}", wanted, did_you_mean(wanted, kFormats)),
                     fmt::format("--to takes one of {}", fmt::join(kFormats, ", ")));
  }
  if (options.spheres && wanted != "srdf") {
    throw InputError("cli.spheres", {}, fmt::format("--spheres is for SRDF, and the output is {}", wanted),
                     "leave it out, or write --to srdf");
  }
  return wanted;
}

void report_absolute_paths(const std::string& text, const std::string& out) {
  Diagnostics diagnostics;
  warn_of_absolute_paths(text, out.empty() || out == "-" ? "stdout" : out, diagnostics);
  print_diagnostics(diagnostics);
}

void report_spheres(const std::vector<LinkSpheres>& spheres, const Model& model) {
  std::size_t count = 0, width = 0;
  const auto name = [&model](const LinkSpheres& cover) {
    return model.links[static_cast<std::size_t>(cover.link)].name;
  };
  for (const LinkSpheres& cover : spheres) {
    count += cover.spheres.size();
    width = std::max(width, name(cover).size());
  }
  print_stderr("{} spheres, proven to cover {} link{}; how many, and how far they stick out:\n", count,
               spheres.size(), spheres.size() == 1 ? "" : "s");
  for (const LinkSpheres& cover : spheres)
    print_stderr("  {:<{}}  {:>3}  {:>6.1f} mm\n", name(cover), width, cover.spheres.size(),
                 1e3 * cover.excess);
}

int convert_to_srdf(const ConvertOptions& options, const RobotDescription& robot,
                    const DescriptionTarget& target, const Model& model) {
  check_output(options.out);
  const auto groups =
      find_planning_groups(model, find_controllers(robot, target, options.controllers).controllers);
  SelfCollisionOptions sampling;
  sampling.samples = options.samples;
  sampling.seed = options.seed;
  sampling.detail = options.hulls ? CollisionDetail::hulls : CollisionDetail::triangles;
  const SelfCollisions found = [&] {
    const InterruptibleWork work("of the configurations are checked for collisions");
    sampling.progress = [&work](double done) { return work.progress(done); };
    return find_self_collisions(robot, model, sampling);
  }();
  if (found.cancelled) return interrupted_without_output();
  std::vector<LinkSpheres> spheres;
  if (options.spheres) {
    Diagnostics diagnostics;
    spheres = find_link_spheres(robot, model, sampling.detail, diagnostics);
    print_diagnostics(diagnostics);
  }
  deliver(to_srdf(model, groups, found.disabled, spheres), options.out);
  print_stderr("{}: {} group{}; of {} pairs of links {} need no collision checking\n", robot.name,
               groups.size(), groups.size() == 1 ? "" : "s", found.checked_pairs, found.disabled.size());
  if (options.spheres) report_spheres(spheres, model);
  return 0;
}

// The limits, and on stderr what they are bounded by.
int convert_to_joint_limits(const ConvertOptions& options, const RobotDescription& robot,
                            const Model& model) {
  const AccelerationLimits limits = acceleration_limits(model, kGravity);
  Diagnostics diagnostics;
  const std::string text = to_joint_limits(robot, model, limits, diagnostics);
  print_diagnostics(diagnostics);
  deliver(text, options.out);
  const auto limited = std::ranges::count_if(
      limits.joints, [](const JointAcceleration& joint) { return std::isfinite(joint.limit); });
  const auto scalar = std::ranges::count_if(model.joints, &ModelJoint::scalar);
  std::string share;
  if (limits.decisive >= 0) {
    share = fmt::format(
        "; together they get {:.0f} % of what each may have alone, which loads the drive of '{}' fully",
        100 * limits.share, model.joints[static_cast<std::size_t>(limits.decisive)].name);
  }
  print_stderr("{}: {} of {} joint{} have an acceleration limit{}\n", robot.name, limited, scalar,
               scalar == 1 ? "" : "s", share);
  return 0;
}

int run_convert(const ConvertOptions& options) {
  const std::string format = choose_format(options);
  DescriptionTarget target = open_target(options.target);
  const LoadedDescription loaded = load_target(target);
  const RobotDescription& robot = loaded.robot;
  refuse_own_source(options.out, loaded.files, "write to another file, for instance below build/");
  MeshPlacement placement;
  const bool to_stdout = options.out.empty() || options.out == "-";
  placement.out_folder = to_stdout ? fs::current_path() : fs::absolute(options.out).parent_path();
  placement.package_uris = options.package_uris;
  if (!options.copy_meshes.empty()) placement.copy_to = options.copy_meshes;
  MeshFiles meshes(placement);
  if (format == "urdf") {
    const std::string text = to_urdf(robot, meshes);
    report_absolute_paths(text, options.out);
    meshes.write();
    deliver(text, options.out);
    return 0;
  }
  const BaseKind base = options.base == "floating" ? BaseKind::floating : BaseKind::fixed;
  Diagnostics diagnostics;
  const Model model = compile_model(robot, format == "mjcf" ? base : BaseKind::fixed, diagnostics);
  if (format == "srdf") {
    print_diagnostics(diagnostics);
    return convert_to_srdf(options, robot, target, model);
  }
  if (format == "joint_limits") {
    print_diagnostics(diagnostics);
    return convert_to_joint_limits(options, robot, model);
  }
  const std::string text = format == "sdf" ? to_sdf(robot, model, meshes, diagnostics)
                                           : to_mjcf(robot, model, meshes, diagnostics);
  print_diagnostics(diagnostics);
  if (format == "sdf") report_absolute_paths(text, options.out);
  meshes.write();
  deliver(text, options.out);
  return 0;
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ConvertOptions>();
  CLI::App* verb = app.add_subcommand(
      "convert", "Write the description as URDF, SDF, MJCF or SRDF, or its joints' limits");
  add_target(*verb, options->target);
  verb->add_option("--to", options->format, "Output format (default: by the name of OUT)")
      ->type_name(fmt::format("FORMAT:{{{}}}", fmt::join(kFormats, ",")));  // completion reads the list
  verb->add_option("-o,--out", options->out, "Output file, replaced atomically (default: stdout)")
      ->type_name("OUT");
  verb->add_flag("--copy-meshes{meshes}", options->copy_meshes,
                 "Copy the meshes next to OUT, into meshes/ or the folder of --copy-meshes=DIR");
  verb->add_flag("--package-uris", options->package_uris,
                 "URDF, SDF: write package:// URIs instead of relative paths");
  verb->add_option("--base", options->base, "MJCF: base of a robot without a link 'world': fixed or floating")
      ->check(CLI::IsMember({"fixed", "floating"}));
  verb->add_option("--samples", options->samples,
                   "SRDF: number of random configurations checked for collisions")
      ->check(CLI::Range(0, 100'000'000));
  verb->add_option("--seed", options->seed, "SRDF: random seed; the same seed gives the same file");
  verb->add_flag("--hulls", options->hulls, "SRDF: use convex hulls instead of triangle meshes; faster");
  verb->add_flag("--spheres", options->spheres,
                 "SRDF: write spheres that cover each link's collision shapes, proven");
  verb->add_option("--controllers", options->controllers,
                   "SRDF: controllers' parameter file (YAML) that defines the groups")
      ->type_name("FILE");
  verb->footer(
      "Examples:\n  doppel convert my_arm.urdf.xacro use_sim:=true -o build/my_arm.urdf --copy-meshes\n  "
      "doppel convert omarm_one -o omarm.sdf\n  doppel convert omarm_one -o omarm.xml        # MJCF\n  "
      "doppel convert omarm_one --to srdf --samples 100000 -o omarm.srdf\n  doppel convert omarm_one -o "
      "omarm.srdf "
      "--spheres\n  doppel convert omarm_one --to joint_limits -o config/joint_limits.yaml\nWhat is "
      "converted, and what is "
      "not: doppel man convert.md");
  verb->callback([options, &exit_code] { exit_code = run_convert(*options); });
}

}  // namespace doppel::app
