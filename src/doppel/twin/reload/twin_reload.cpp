#include "doppel/twin/reload/twin_reload.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "doppel/base/core/thrown.h"
#include "doppel/ros/bus/stage.h"
#include "doppel/scenario/resolve/controllers_search.h"
#include "doppel/twin/loop/divergence.h"

namespace doppel {
namespace {

constexpr Duration kRehearsal{50'000'000};         // simulated
constexpr Duration kEditProbation{1'000'000'000};  // simulated: an edit that diverges within it is taken back

// Running controllers continue if they are still declared; newly declared ones are treated as at the start.
ControllerSelection renewed(const ControllerSelection& before,
                            const std::vector<std::pair<std::string, std::string>>& declared,
                            const Scenario& scenario, const WorldRobot& robot) {
  ControllerSelection selection = before;
  const auto gone = [&declared](const std::string& name) {
    return std::none_of(declared.begin(), declared.end(), [&name](const auto& d) { return d.first == name; });
  };
  std::erase_if(selection.active, gone);
  std::erase_if(selection.inactive, gone);
  for (const auto& [name, type] : declared) {
    const bool known =
        std::find(before.declared.begin(), before.declared.end(), name) != before.declared.end();
    if (known || !scenario.start_controllers) continue;
    (robot.activate.empty() ? selection.active : selection.inactive).push_back(name);
  }
  return selection;
}

// A controllers' file that an edit has made invalid, empty or deleted: its controllers keep running until it
// is valid again. Throws InputError.
void refuse_lost_controllers(const RobotSetup& before, const RobotSetup& after, const Diagnostics& said) {
  if (before.controllers_named) return;
  const auto ours = [&before](const std::filesystem::path& file) {
    return std::ranges::find(before.controllers_files, file) != before.controllers_files.end();
  };
  for (const Diagnostic& d : said.all()) {
    if (d.rule == "up.controllers_unreadable" && d.where.known() && ours(*d.where.file))
      throw InputError(d.rule, d.where, d.message, d.fix);
  }
  for (const std::filesystem::path& file : before.declaring_files) {
    if (is_controllers_file(file)) continue;
    std::error_code none;
    const bool there = std::filesystem::exists(file, none);
    throw InputError("reload.controllers_lost", make_location(file.string()),
                     there ? "this file, which the running controllers come from, no longer declares any"
                           : "this file, which the running controllers come from, no longer exists",
                     "restore it, or restart without it");
  }
  if (!before.declaring_files.empty() && after.controllers_files.empty()) {
    throw InputError("reload.controllers_lost", make_location(before.declaring_files.front().string()),
                     "the running controllers of this file would no longer list any joint of this robot",
                     "correct the joint names in it or in the description, or restart without it");
  }
}

// Running controllers must keep running; new ones may be left out if the user did not choose them.
void rehearse_start(ControlStack& control, const Log& quiet, const ControllerSelection& ran_before,
                    const ControllerSelection& selection) {
  ControllerSelection ran = selection;
  ran.only_compatible = false;
  std::erase_if(ran.active, [&](const std::string& name) {
    return std::find(ran_before.active.begin(), ran_before.active.end(), name) == ran_before.active.end();
  });
  control.start(ran, quiet);
  if (selection.only_compatible) control.start(selection, quiet);
}

// Replaces the running robots by those of a new machine. The new ones are built completely before any part of
// the running ones is destroyed, so that an exception leaves these unchanged.
class RobotReplacement {
 public:
  RobotReplacement(TwinCore& core, std::unique_ptr<CompiledScenario>& compiled)
      : core_(core), machine_(compiled), stage_(core.bus()) {
    refuse_real_hardware();
    kept_robots_.reserve(compiled->robots.size());
    for (const auto& robot : core_.robots()) overloaded_[robot->name_space()] = robot->overloaded_joints();
    core_.exchange_machine(machine_);
    former_ = std::exchange(core_.robots(), {});
  }
  ~RobotReplacement() {
    if (done_) return;
    try {
      undo();
    } catch (...) {
      core_.log().error("reload", "the running model could not be restored completely: " + thrown_text());
    }
  }
  RobotReplacement(const RobotReplacement&) = delete;
  RobotReplacement& operator=(const RobotReplacement&) = delete;

  // True: the controllers of every robot continue.
  bool run(const std::map<std::string, ControllerSelection>& selections) {
    core_.robots().reserve(core_.machine().robots.size());
    bool same = core_.machine().robots.size() == former_.size();
    for (const auto& compiled : core_.machine().robots) {
      const std::size_t before = index_of(*compiled);
      if (before < former_.size() && is_kept(*former_[before], *compiled)) {
        hand_over(before, compiled);
      } else {
        same = false;
        make(before, compiled, selections);
      }
    }
    core_.renew_handles();
    if (!machine_->engine->diverged()) refuse_divergence();
    core_.publish_state();
    stage_->commit();
    done_ = true;
    for (const auto& robot : core_.robots()) robot->report_overloads(overloaded_[robot->name_space()]);
    return same;
  }

 private:
  struct KeptRobot {
    std::size_t index = 0;  // in former_
    std::shared_ptr<const CompiledRobot> machine;
    Instance instance;
    TickList publishers;  // the former ones, once new ones are made
    bool has_publishers = false;
  };

  // former_.size(): no former robot has its namespace.
  [[nodiscard]] std::size_t index_of(const CompiledRobot& compiled) const {
    const auto found = std::ranges::find_if(former_, [&](const auto& robot) {
      return robot != nullptr && robot->name_space() == compiled.name_space();
    });
    return static_cast<std::size_t>(found - former_.begin());
  }

  [[nodiscard]] bool is_kept(const TwinRobot& robot, const CompiledRobot& compiled) const {
    return same_structure(robot.machine(), compiled) &&
           machine_->engine->world().settings().step == core_.machine().world.step;
  }

  // From the present state, with the drives as they are now. Not beside real hardware, whose loop waits
  // meanwhile: there an edit that diverges is only taken back afterwards.
  void refuse_divergence() const {
    if (core_.find_robot_with_loop() != nullptr) return;
    const std::string why = divergence_within(*core_.machine().engine, kRehearsal);
    if (!why.empty())
      throw InputError("reload.diverges", {}, "with this edit " + why,
                       "look for extreme values in what was edited: gravity, masses, inertias, step");
  }

  // A device cannot be opened a second time for a machine that may still fail.
  void refuse_real_hardware() const {
    for (const auto& robot : core_.robots()) {
      const auto next = std::ranges::find_if(machine_->robots, [&](const auto& compiled) {
        return compiled->name_space() == robot->name_space();
      });
      if (!robot->has_loop() || (next != machine_->robots.end() && same_structure(robot->machine(), **next)))
        continue;
      throw InputError("reload.real_hardware", robot->description().source,
                       fmt::format("'{}' drives real hardware: changes of joints, interfaces or controllers "
                                   "are not applied while it runs",
                                   robot->name()),
                       "restart to apply them");
    }
  }

  void hand_over(std::size_t before, const std::shared_ptr<const CompiledRobot>& compiled) {
    TwinRobot& robot = *former_[before];
    KeptRobot& entry = kept_robots_.emplace_back();
    entry.index = before;
    entry.machine = robot.shared_machine();
    entry.instance = robot.instance();
    core_.robots().push_back(std::move(former_[before]));
    robot.take_over(compiled, instance_of(*core_.machine().engine, *compiled));
    robot.carry_references(entry.instance);
    entry.publishers = robot.make_publishers();
    entry.has_publishers = true;
  }

  void make(std::size_t before, const std::shared_ptr<const CompiledRobot>& compiled,
            const std::map<std::string, ControllerSelection>& selections) {
    const TwinRobot* const former = before < former_.size() ? former_[before].get() : nullptr;
    Diagnostics reported_before;
    core_.robots().push_back(core_.make_robot(compiled, former, reported_before));
    TwinRobot& made = *core_.robots().back();
    const auto selection = selections.find(made.name_space());
    if (selection != selections.end()) {
      made.start(selection->second);
    } else {
      made.start_first();
    }
    made.make_publishers();
    made.start_loop();
  }

  void undo() {
    for (auto& robot : core_.robots()) {
      const auto entry = std::ranges::find_if(kept_robots_, [&](const KeptRobot& e) {
        return former_[e.index] == nullptr && e.machine->name_space() == robot->name_space();
      });
      if (entry != kept_robots_.end()) former_[entry->index] = std::move(robot);
    }
    core_.robots().clear();  // the new ones, with their nodes
    core_.exchange_machine(machine_);
    core_.robots() = std::move(former_);
    for (KeptRobot& entry : kept_robots_) {
      TwinRobot& robot = *core_.robots()[entry.index];
      robot.take_over(entry.machine, entry.instance);
      if (entry.has_publishers) robot.restore_publishers(std::move(entry.publishers));
    }
    stage_.reset();  // restores the former nodes
    core_.renew_handles();
    for (const auto& robot : core_.robots()) robot->robots_changed(core_.machine().engine->time());
  }

  TwinCore& core_;
  std::unique_ptr<CompiledScenario>& machine_;  // the one that is not running
  std::optional<BusStage> stage_;
  std::vector<std::unique_ptr<TwinRobot>> former_;
  std::vector<KeptRobot> kept_robots_;
  std::map<std::string, std::set<std::string>> overloaded_;  // by namespace: joints before the edit
  bool done_ = false;
};

}  // namespace

bool TwinReload::replace(TwinReplacement& fresh) {
  const auto held = core_.hold();
  if (!std::ranges::equal(
          fresh.running->robots.now, core_.machine().robots, {},
          [](const auto& robot) { return robot->name(); }, [](const auto& robot) { return robot->name(); })) {
    throw InputError("reload.robots_changed", {}, "a robot was added or removed while the edit was read",
                     "save the file again");
  }
  refuse_lost_range(core_.machine(), *fresh.machine);
  carry_over_state(core_.machine(), *fresh.machine);
  auto before = std::make_shared<TwinReplacement>();
  before->selections = core_.present_selections();
  bool kept = false;
  {
    RobotReplacement replacement(core_, fresh.machine);
    kept = replacement.run(fresh.selections);
  }
  before->machine = std::move(fresh.machine);
  if (before->machine->engine->diverged()) {
    core_.reset(core_.now());
    core_.log().note("reload", "the robots are at their start, because the former state had diverged");
  } else {
    edited_ = Edited{std::move(before), core_.engine().compiled(), core_.now()};
  }
  return kept;
}

// The state becomes that at the time of the edit, because a later one belongs to the model that diverged.
bool TwinReload::recover(const std::string& cause) {
  const std::optional<Edited> last = std::exchange(edited_, std::nullopt);
  const Time now = core_.now();
  if (!last || now - last->applied > kEditProbation || core_.engine().compiled() != last->world) return false;
  try {
    last->before->machine->engine->set_time(now);
    RobotReplacement replacement(core_, last->before->machine);
    replacement.run(last->before->selections);
  } catch (...) {
    core_.log().error("reload", "the previous model cannot be restored: " + thrown_text());
    return false;
  }
  core_.log().error(
      "reload",
      fmt::format(
          "{}; the edit that was applied {:.3f} s before is taken back, and the previous model continues "
          "from the state that it had then",
          cause, to_seconds(now - last->applied)));
  core_.report_robots_changed();
  return true;
}

// It has proved itself: it is not taken back any more.
void TwinReload::between_steps(Time now) {
  if (edited_ && now - edited_->applied > kEditProbation) edited_.reset();
}

std::shared_ptr<TwinReplacement> prepare_replacement(const std::shared_ptr<const RunningMachine>& running,
                                                     Diagnostics& diagnostics) {
  const TwinSources& from = *running->sources;
  auto fresh = std::make_shared<TwinReplacement>();
  fresh->running = running;
  fresh->machine = std::make_unique<CompiledScenario>(from.scenario, diagnostics, &running->robots);
  for (const auto& robot : fresh->machine->robots) {
    const auto ran = running->selections.find(robot->name_space());
    const bool is_new = ran == running->selections.end();
    for (const auto& before : running->robots.now) {
      if (before->name_space() == robot->name_space())
        refuse_lost_controllers(before->setup(), robot->setup(), diagnostics);
    }
    const auto start = [&](ControlStack& control, const Log& quiet) {
      if (is_new) {
        if (from.scenario.start_controllers) control.start(control.selection_of(*robot), quiet);
        return;
      }
      ControllerSelection& selection = fresh->selections[robot->name_space()];
      selection =
          renewed(ran->second, control.manager().declared_controllers(), from.scenario, robot->asked());
      rehearse_start(control, quiet, ran->second, selection);
    };
    rehearse(*robot, instance_of(*fresh->machine->engine, *robot), from, start, diagnostics);
  }
  fresh->machine->engine->reset();
  return fresh;
}

}  // namespace doppel
