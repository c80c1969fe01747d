// doppel snapshot: a picture of a robot or a world, made without a window, a browser or a graphics processor.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <sstream>

#include "app/described_scenario.h"
#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/saved_message.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/lab/headless_run/headless_run.h"
#include "doppel/sensors/rigs/picture.h"
#include "doppel/session/live/audit_result.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel::app {
namespace {

struct SnapshotVerb {
  DescribedBy robot;
  std::string world, camera, file = "snapshot.png", size = "1280x720";
  std::vector<double> from, at;
  double fov = 0.7, time = 0;
  int samples = 8;
};

std::pair<int, int> size_of(const std::string& text) {
  int width = 0, height = 0;
  char x = 0;
  std::istringstream in(text);
  if (in >> width >> x >> height && x == 'x' && width > 0 && height > 0 && width <= 8192 && height <= 8192)
    return {width, height};
  throw InputError("cli.size", {}, fmt::format("'{}' is not a size", text),
                   "write it as 1280x720, at most 8192x8192");
}

struct Found {
  CameraDescription camera;
  Pose X_WS;
};

Found camera_named(const Twin& twin, const std::string& name) {
  std::vector<std::string> names;
  for (const auto& robot : twin.robots())
    for (const RobotSensor& sensor : robot->machine().sensors().sensors) {
      const auto* cameras = std::get_if<std::vector<CameraDescription>>(&sensor.description.what);
      if (cameras == nullptr) continue;
      names.push_back(sensor.description.name);
      if (sensor.description.name != name) continue;
      const CameraDescription& camera = cameras->front();
      return {camera, robot->instance().link_pose(sensor.link) * sensor.description.X_LS * camera.X_SC};
    }
  if (names.empty())
    throw InputError("cli.camera", {}, "no robot here has a camera",
                     "leave out --camera for a view from outside");
  throw InputError("cli.camera", {},
                   fmt::format("there is no camera '{}'{}", name, did_you_mean(name, names)));
}

// From the front and the side, so far away that everything is in the picture.
Found view_of_all(const SnapshotVerb& options, const Engine& engine, Diagnostics& diagnostics) {
  Found out;
  out.camera.hfov = options.fov;
  out.camera.near = 0.005;
  out.camera.far = 500;
  Eigen::Vector3d at(0, 0, 0), from(1, -1, 0.7);
  if (options.from.size() != 3 || options.at.size() != 3) {
    const Eigen::AlignedBox3d box = bounds_of(engine, diagnostics);
    if (!box.isEmpty()) at = box.center();
    const double radius = box.isEmpty() ? 0.5 : 0.5 * box.diagonal().norm();
    const auto [width, height] = size_of(options.size);
    const double narrow = std::min(1.0, static_cast<double>(height) / width) * options.fov;
    from = at + 1.05 * radius / std::sin(narrow / 2) * Eigen::Vector3d(0.8, -0.62, 0.5).normalized();
  }
  if (options.at.size() == 3) at = Eigen::Vector3d(options.at[0], options.at[1], options.at[2]);
  if (options.from.size() == 3) from = Eigen::Vector3d(options.from[0], options.from[1], options.from[2]);
  out.X_WS = looking_at(from, at);
  return out;
}

// A file without an ending is a PNG, as stdout is.
std::string picture_ending(const std::string& file) {
  if (file.empty()) throw InputError("cli.output", {}, "-o names no file", "name one, or - for stdout");
  const std::string ending = file == "-" ? "" : ending_of(file);
  if (ending.empty()) return ".png";
  if (!is_picture(ending))
    throw InputError("cli.output", {}, fmt::format("a picture cannot be saved as '{}'", ending),
                     "name a file that ends in .png or .jpg");
  return ending;
}

int run_snapshot(const SnapshotVerb& options, bool sized) {
  const std::string ending = picture_ending(options.file);
  check_output(options.file);
  Scenario scenario = described_scenario(options.robot);
  if (!options.world.empty()) scenario.world = options.world;
  Diagnostics diagnostics;
  Log quiet;
  Twin twin(scenario, quiet, diagnostics);
  for (const auto& robot : twin.robots()) report_misspellings(robot->machine(), diagnostics);
  const RunResult run = run_headless(twin, {.duration = from_seconds(options.time)});
  run.throw_if_failed();
  if (run.end == RunEnd::diverged) {
    diagnostics.warning(
        "snapshot.diverged", {},
        fmt::format("the physics diverged at t = {:.3f} s; the picture shows the last finite state",
                    to_seconds(twin.now())),
        "doppel check --rest looks for the cause");
  }
  Found view = options.camera.empty() ? view_of_all(options, twin.engine(), diagnostics)
                                      : camera_named(twin, options.camera);
  if (options.camera.empty() || sized)
    std::tie(view.camera.width, view.camera.height) = size_of(options.size);
  view.camera.samples = options.samples;
  const Bitmap picture = take_picture(twin.engine(), view.camera, view.X_WS, diagnostics);
  print_diagnostics(diagnostics);
  deliver(encoded_picture(picture, ending), options.file);
  if (options.file != "-") print_stderr("{}: {} x {}\n", options.file, picture.width, picture.height);
  return 0;
}

}  // namespace

void add_snapshot(CLI::App& app, int& exit_code) {
  CLI::App* verb = app.add_subcommand("snapshot", "Make a picture of a robot or a world, without a browser");
  const auto options = std::make_shared<SnapshotVerb>();
  add_described_by(*verb, options->robot, false);
  verb->add_option("--world", options->world, "World file (YAML or SDF)");
  verb->add_option("--camera", options->camera, "As this camera of the robot sees it (default: from outside)")
      ->type_name("NAME");
  verb->add_option("--from", options->from, "Place of the camera: x y z in m")
      ->expected(3)
      ->type_name("X Y Z");
  verb->add_option("--at", options->at, "Point to look at: x y z in m")->expected(3)->type_name("X Y Z");
  verb->add_option("--fov", options->fov, "Horizontal field of view in rad (default 0.7)")
      ->check(CLI::Range(0.01, 3.0));
  CLI::Option* size = verb->add_option("--size", options->size, "Pixels (default 1280x720, or the camera's)")
                          ->type_name("WxH");
  verb->add_option("--samples", options->samples, "Samples of each pixel, against jagged edges (default 8)")
      ->check(CLI::Range(1, 64));
  verb->add_option("--time", options->time, "Simulate this long first, in s")->check(CLI::Range(0.0, 3600.0));
  verb->add_option("-o,--output", options->file, "File, .png or .jpg; - for stdout (default snapshot.png)")
      ->type_name("FILE");
  verb->footer(
      "Examples:\n  doppel snapshot omarm_one -o arm.png\n  doppel snapshot lab_arm --camera camera\n"
      "  doppel snapshot kate --world worlds/kate_lab.sdf --from 3 -3 2 --at 0 0 0.5 --time 1");
  verb->callback([options, size, &exit_code] { exit_code = run_snapshot(*options, size->count() > 0); });
}

}  // namespace doppel::app
