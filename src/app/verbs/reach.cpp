// doppel reach: where an arm's tool can go, as facts, slices and files.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/output.h"
#include "app/verbs/arm_target.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/position_text.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/robot/reach/reach_files.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct ReachOptions {
  ArmOptions arm;
  double cell = 0;
  int directions = 50, jobs = 0;
  std::vector<std::string> approach, slices;
  bool down = false, json = false;
  std::string value = "share", out;
};

const std::vector<std::string> kMapFiles = {"svg", "csv", "ply", "reach"};
const std::vector<std::string> kMapValues = {"share", "manipulability", "limits"};

std::string file_kind(const std::string& out) {
  if (out.empty()) return "";
  const std::string extension = lowered(fs::path(out).extension().string());
  const std::string kind = extension.empty() ? "" : extension.substr(1);
  if (std::find(kMapFiles.begin(), kMapFiles.end(), kind) != kMapFiles.end()) return kind;
  throw InputError(
      "cli.format", {},
      fmt::format("'{}' is not a format of reach maps{}", kind, did_you_mean(kind, kMapFiles)),
      "name a file that ends in .svg (slices), .csv or .ply (points), or .reach (all cells, binary)");
}

// "y=0", "z=0.2".
ReachSlice parse_slice(const std::string& text) {
  const std::size_t axis = text.empty() ? std::string::npos : std::string("xyz").find(text[0]);
  if (axis == std::string::npos || text.size() < 3 || text[1] != '=') {
    throw InputError("cli.slice", {}, fmt::format("'{}' is not a slice", text),
                     "write the plane as x=0.1, y=0 or z=0.2, in m");
  }
  return {static_cast<int>(axis), parse_position(std::string_view(text).substr(2), text)};
}

ReachValue value_named(const std::string& name) {
  const auto found = std::find(kMapValues.begin(), kMapValues.end(), name);
  if (found == kMapValues.end()) {
    throw InputError("cli.value", {},
                     fmt::format("'{}' is not a value of reach maps{}", name, did_you_mean(name, kMapValues)),
                     "--value takes share, manipulability or limits");
  }
  return static_cast<ReachValue>(found - kMapValues.begin());
}

ReachMapOptions map_options(const ReachOptions& options, const ArmTarget& arm) {
  ReachMapOptions out;
  out.cell = options.cell;
  out.directions = options.directions;
  out.threads = options.jobs;
  out.q = arm.q;
  if (options.down) out.approach = Eigen::Vector3d(0, 0, -1);
  if (!options.approach.empty()) {
    Eigen::Vector3d direction;
    for (int i = 0; i < 3; ++i) {
      const std::string& word = options.approach[static_cast<std::size_t>(i)];
      direction[i] = parse_position(word, word);
    }
    if (direction.norm() < 1e-9)
      throw InputError("cli.approach", {}, "the direction is zero", "down is 0 0 -1");
    out.approach = direction.normalized();
  }
  return out;
}

std::string facts_text(const ArmTarget& arm, const ReachMap& map, const ReachFacts& facts) {
  const auto vector = [](const Eigen::Vector3d& v) {
    return fmt::format("{:.3f} {:.3f} {:.3f} m", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
  };
  std::string out = fmt::format("{}: {}, cells of {:.3g} mm{}\n", arm.robot, arm.group, map.cell * 1e3,
                                map.directions > 1 ? fmt::format(", {} directions", map.directions) : "");
  if (facts.volume == 0) return out + "  nothing can be reached\n";
  out += fmt::format("  reach          {:.3f} m from the first joint\n", facts.farthest);
  out += fmt::format("  volume         {:.3g} l\n", facts.volume * 1e3);
  out += fmt::format("  box            {} to {}\n", vector(facts.low), vector(facts.high));
  if (map.directions > 1) {
    out += fmt::format("  dexterous      {:.3g} l, where nine tenths of all directions are possible\n",
                       facts.dexterous_volume * 1e3);
  }
  out += fmt::format("  best           {}, {:.0f} % of the directions\n", vector(facts.best),
                     facts.best_share * 100);
  return out;
}

std::string facts_json(const ArmTarget& arm, const ReachMap& map, const ReachFacts& facts) {
  const auto vector = [](const Eigen::Vector3d& v) { return nlohmann::ordered_json{v.x(), v.y(), v.z()}; };
  const nlohmann::ordered_json out{{"version", 1},
                                   {"robot", arm.robot},
                                   {"group", arm.group},
                                   {"cell", map.cell},
                                   {"directions", map.directions},
                                   {"reach", facts.farthest},
                                   {"volume", facts.volume},
                                   {"dexterous_volume", facts.dexterous_volume},
                                   {"low", vector(facts.low)},
                                   {"high", vector(facts.high)},
                                   {"best", vector(facts.best)},
                                   {"best_share", facts.best_share}};
  return out.dump(2) + "\n";
}

std::string file_text(const std::string& kind, const ReachOptions& options, const ArmTarget& arm,
                      const ReachMap& map, const Eigen::Vector3d& first_joint, const ReachFacts& facts) {
  if (kind == "csv") return reach_csv(map);
  if (kind == "ply") return reach_ply(map);
  if (kind == "reach") return reach_binary(map);
  std::vector<ReachSlice> slices;
  for (const std::string& text : options.slices) slices.push_back(parse_slice(text));
  if (slices.empty()) slices = {{1, first_joint.y()}, {2, facts.best.z()}};
  const ReachBodies bodies = arm.scene != nullptr ? scene_bodies(*arm.scene, arm.q) : ReachBodies{};
  return reach_svg(map, slices, value_named(options.value), bodies,
                   fmt::format("Reach of {}, {}", arm.robot, arm.group));
}

int run_reach(const ReachOptions& options) {
  const std::string kind = file_kind(options.out);
  for (const std::string& text : options.slices) parse_slice(text);
  (void)value_named(options.value);
  check_output(options.out);
  const ArmTarget arm = open_arm(options.arm);
  const Chain& chain = arm.reach->solver().chain();
  const ReachMap map = [&] {
    const InterruptibleWork work("of the cells");
    ReachMapOptions how = map_options(options, arm);
    how.progress = [&work](double done) { return work.progress(done); };
    return make_reach_map(arm.model, chain, arm.scene, how);
  }();
  if (map.cancelled) return interrupted_without_output();
  const Eigen::Vector3d first_joint = arm.reach->base_pose(arm.q) * chain.joints.front().X_PZ.translation();
  const ReachFacts facts = reach_facts(map, first_joint);
  if (!options.out.empty()) deliver(file_text(kind, options, arm, map, first_joint, facts), options.out);
  deliver(options.json ? facts_json(arm, map, facts) : facts_text(arm, map, facts));
  return 0;
}

}  // namespace

void add_reach(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ReachOptions>();
  CLI::App* verb = app.add_subcommand("reach", "Map where the tool can go, and in how many directions");
  add_arm_options(*verb, options->arm);
  verb->add_option("--cell", options->cell, "Side of a cell, m (default: a fortieth of the reach's diameter)")
      ->type_name("M")
      ->check(CLI::Range(1e-3, 10.0));
  verb->add_option("--directions", options->directions, "Directions of the tool that are tried in each cell")
      ->check(CLI::Range(1, 1000));
  auto* down = verb->add_flag("--down", options->down, "Only with the tool pointing down");
  verb->add_option("--approach", options->approach, "Only with the tool pointing in this direction")
      ->type_name("X Y Z")
      ->expected(3)
      ->excludes(down);
  verb->add_option("-o,--out", options->out,
                   "Also write the map: .svg (slices), .csv or .ply (points), .reach (all cells, binary)")
      ->type_name("FILE");
  verb->add_option("--slice", options->slices,
                   "SVG: planes, as y=0 or z=0.2 (default: upright, and through the best cell)")
      ->type_name("AXIS=M")
      ->expected(1, -1);
  verb->add_option("--value", options->value,
                   "SVG: share (of directions), manipulability, or limits (distance from them)")
      ->type_name("VALUE");
  verb->add_option("--jobs", options->jobs, "Threads (default: all of the processor's)")
      ->check(CLI::Range(1, 1024));
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in m");
  verb->footer(
      "Examples:\n  doppel reach omarm_one -o reach.svg\n  doppel reach my_arm.urdf --down --cell 0.01 -o "
      "down.csv\n  "
      "doppel reach kate --group arm --slice x=0 z=0.5 -o kate.svg\nFor one pose: doppel ik. See doppel man "
      "reach.md");
  verb->callback([options, &exit_code] { exit_code = run_reach(*options); });
}

}  // namespace doppel::app
