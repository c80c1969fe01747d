// doppel bag resimulate: a recorded run, run again.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/interruptible_work.h"
#include "doppel/base/core/installation.h"
#include "doppel/base/core/path_below.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/lab/curve_plot/curve_plot.h"
#include "doppel/lab/recording/run_recording.h"
#include "doppel/lab/resimulation/joint_panels.h"
#include "doppel/lab/resimulation/resimulation.h"
#include "doppel/version.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct ResimulateOptions {
  std::string bag, files, overlay, engine, out, plot;
  std::vector<std::string> arguments;  // name:=value
  std::vector<std::string> plugins;
  [[nodiscard]] bool is_what_if() const { return !overlay.empty() || !engine.empty() || !arguments.empty(); }
};

// A folder of its own, which is removed again.
class RunFolder {
 public:
  explicit RunFolder(const std::string& chosen) : is_kept_(!chosen.empty()), folder_(chosen) {
    if (is_kept_) {
      if (fs::exists(folder_) && !fs::is_empty(folder_))
        throw InputError("output.unwritable", {}, fmt::format("'{}' is not empty", chosen),
                         "name another folder");
      std::error_code error;
      if (!fs::exists(folder_) && !fs::create_directories(folder_, error))
        throw InputError("output.unwritable", {},
                         fmt::format("the folder '{}' cannot be made: {}", chosen, error.message()));
      return;
    }
    std::string name = (fs::temp_directory_path() / "doppel-run-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
      throw InputError("output.unwritable", {},
                       fmt::format("no folder can be made in {}", fs::temp_directory_path().string()));
    folder_ = name;
  }
  ~RunFolder() {
    std::error_code none;
    if (!is_kept_) fs::remove_all(folder_, none);
  }
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return folder_; }

 private:
  bool is_kept_;
  fs::path folder_;
};

// A robot that comes with doppel is changed in a copy of its package.
void move_into(WorldRobot& robot, const fs::path& folder) {
  const fs::path file =
      fs::absolute(open_target(robot.target, robot.arguments).target.description).lexically_normal();
  const fs::path package = package_around(file);
  robot.target = file.string();
  if (path_below(file, fs::absolute(folder))) return;
  if (package.empty()) {
    throw InputError("bag.no_run", make_location(file.string()),
                     "this file of the run is not in the recording, so that no overlay is written beside it",
                     "record the run again, or use --set");
  }
  const fs::path copy = folder / package.filename();
  if (!fs::exists(copy)) fs::copy(package, copy, fs::copy_options::recursive);
  robot.target = (copy / file.lexically_relative(package)).string();
}

// The change of a what-if applies to every robot of the run.
void change(RecordedRun& run, const ResimulateOptions& options) {
  if (!options.engine.empty()) run.scenario.engine = options.engine;
  for (WorldRobot& robot : run.scenario.robots) {
    for (const std::string& text : options.arguments) {
      const auto argument = split_argument(text);
      std::erase_if(robot.arguments, [&](const auto& other) { return other.first == argument.first; });
      robot.arguments.push_back(argument);
    }
    if (options.overlay.empty()) continue;
    move_into(robot, run.folder);
    fs::copy_file(options.overlay, overlay_path(robot.target), fs::copy_options::overwrite_existing);
  }
}

std::string changes_text(const ResimulateOptions& options) {
  std::string out;
  const auto add = [&out](const std::string& change) { out += (out.empty() ? "" : ", ") + change; };
  for (const std::string& argument : options.arguments) add(argument);
  if (!options.overlay.empty()) add(fs::path(options.overlay).filename().string());
  if (!options.engine.empty()) add(options.engine);
  return out.empty() ? "the same run again" : "what if: " + out;
}

double seconds_of(const RecordedRun& run, std::uint64_t step) {
  for (const auto& hash : run.hashes) {
    if (hash.step >= step) return to_seconds(from_msg(hash.stamp));
  }
  return 0;
}

std::string verdict(const RecordedRun& run, const Resimulation& result) {
  if (result.equal()) {
    return fmt::format("equal: {} of {} hashes, {} steps, {} inputs\n", result.compared, run.hashes.size(),
                       run.hashes.back().step, run.inputs.size());
  }
  std::string out = "different";
  if (result.wrong_after) {
    out += fmt::format(": the states after step {} (t = {:.3f} s) are not the recorded ones",
                       *result.wrong_after, seconds_of(run, *result.wrong_after));
    if (result.equal_until > 0) out += fmt::format("; until step {} they are", result.equal_until);
  }
  out += "\n";
  if (result.first) {
    out += fmt::format("first message that differs: {} at t = {:.3f} s (step {})\n", result.first->topic,
                       to_seconds(result.first->time), result.first->step);
  }
  return out;
}

std::string notes_text(const RecordedRun& run, const Resimulation& result) {
  std::string out;
  for (const std::string& failed : result.failed_inputs) out += fmt::format("not repeated: {}\n", failed);
  if (run.lost_inputs > 0)
    out += fmt::format("{} inputs are not in the recording, because the disk did not keep up\n",
                       run.lost_inputs);
  if (run.scenario.wall_stamps)
    out += "messages had wall-clock stamps, which are not the same in another run\n";
  for (const Diagnostic& note : run.notes.all()) out += note.str() + "\n";
  if (run.version != version())
    out += fmt::format("recorded by doppel {}, and this is {}\n", run.version, version());
  return out;
}

// The positions of the joints in both runs.
void write_plot(const ResimulateOptions& options, BagReader& bag, const std::string& second_run) {
  constexpr std::size_t kMaxPanels = 12;
  BagReader second(second_run);
  const char* const label = options.is_what_if() ? "what if" : "run again";
  const std::vector<PlotPanel> panels = joint_panels(bag, "recorded", second, label, kMaxPanels);
  const std::string name = fs::path(options.bag).lexically_normal().filename().string();
  deliver(curve_plot(name, changes_text(options), panels), options.plot);
}

int run_resimulate(const ResimulateOptions& options) {
  if (!options.out.empty() && fs::exists(options.out)) {
    throw InputError("output.unwritable", {}, fmt::format("'{}' exists already", options.out),
                     "name another folder; a bag is never appended to");
  }
  const RunFolder folder(options.files);
  BagReader bag(options.bag);
  RecordedRun run = read_recorded_run(bag, folder.path(), data_folder() / "robots", options.plugins);
  change(run, options);
  ResimulationOptions with;
  with.compare_with = options.is_what_if() ? nullptr : &bag;
  const Log quiet;
  // A plot without a bag of its own is made of one that is removed again.
  const std::string second_run = options.out.empty() ? (folder.path() / "second_run").string() : options.out;
  if (!options.out.empty() || !options.plot.empty()) {
    with.record = [&](Twin& twin) {
      RunRecordingOptions recording;
      recording.version = version();
      recording.bag.folder = second_run;
      return run_recorder_options(twin, recording, quiet);
    };
  }
  const InterruptibleWork work("of the run");
  std::atomic<bool> cancel{false};
  with.cancel = &cancel;
  with.progress = [&](double done) {
    if (!work.progress(done)) cancel = true;
  };
  const Resimulation result = resimulate(run, with);
  if (cancel) {
    std::error_code none;
    if (!options.out.empty()) fs::remove_all(options.out, none);
    return interrupted_without_output();
  }
  result.run.throw_if_failed();
  if (options.is_what_if()) print_diagnostics(result.run.diagnostics);
  std::string text;
  if (options.is_what_if()) {
    text = fmt::format("what if: {} of {} steps, {} inputs{}\n", result.run.steps, run.hashes.back().step,
                       run.inputs.size(), result.run.end == RunEnd::diverged ? "; the physics diverged" : "");
    text += result.wrong_after
                ? fmt::format("it moves otherwise from step {} on at the latest\n", *result.wrong_after)
                : "it moves as it did\n";
  } else {
    text = verdict(run, result);
  }
  if (!options.out.empty()) text += fmt::format("recorded: {}\n", options.out);
  if (!options.plot.empty()) {
    write_plot(options, bag, second_run);
    if (options.plot != "-") text += fmt::format("plotted: {}\n", options.plot);
  }
  deliver(text + notes_text(run, result));
  return options.is_what_if() || result.equal() ? 0 : 1;
}

}  // namespace

void add_bag_resimulate(CLI::App& bag, int& exit_code) {
  CLI::App* verb = bag.add_subcommand(
      "resimulate",
      "Run a recorded run again: equal states, or where they differ; or what if something else had been");
  const auto options = std::make_shared<ResimulateOptions>();
  verb->add_option("BAG", options->bag, "A bag of doppel up --record, or of the black box")->required();
  verb->add_option("--set", options->arguments, "What if: another value of an argument, name:=value")
      ->take_all();
  verb->add_option("--overlay", options->overlay, "What if: another overlay")->check(CLI::ExistingFile);
  verb->add_option("--engine", options->engine, "What if: another engine");
  verb->add_option(
          "--plugin", options->plugins,
          "A shared library that the run needs and that you trust; the recording's own is never loaded")
      ->take_all();
  verb->add_option("-o,--output,--out", options->out, "Record the second run, too")->type_name("FOLDER");
  verb->add_option("--plot", options->plot, "The joints of both runs as a picture (SVG)")->type_name("FILE");
  verb->add_option("--files", options->files, "Keep the files of the run in this folder")
      ->type_name("FOLDER");
  verb->footer(
      "The run's own files, as they were recorded, are used, and every input acts at its step.\nExit code 1: "
      "the states "
      "differ.\nExamples:\n  doppel bag resimulate my_run\n  doppel bag resimulate my_run --set "
      "stiffness:=80 -o softer --plot softer.svg");
  verb->callback([options, &exit_code] { exit_code = run_resimulate(*options); });
}

}  // namespace doppel::app
