// What replaces a machine that runs.

#include <fmt/format.h>

#include "doppel/twin/contact_publisher.h"
#include "doppel/twin/controllers_choice.h"
#include "doppel/twin/load_publisher.h"
#include "doppel/twin/twin_detail.h"

namespace doppel {
namespace {

// What ran goes on where it is still declared; what the YAML declares newly is treated as at the start.
ControllerWish renewed(const ControllerWish& before,
                       const std::vector<std::pair<std::string, std::string>>& declared,
                       const Scenario& scenario, const WorldRobot& robot) {
  ControllerWish wish = before;
  const auto gone = [&declared](const std::string& name) {
    return std::none_of(declared.begin(), declared.end(), [&name](const auto& d) { return d.first == name; });
  };
  std::erase_if(wish.active, gone);
  std::erase_if(wish.inactive, gone);
  for (const auto& [name, type] : declared) {
    const bool known =
        std::find(before.declared.begin(), before.declared.end(), name) != before.declared.end();
    if (known || !scenario.start_controllers) continue;
    (robot.activate.empty() ? wish.active : wish.inactive).push_back(name);
  }
  return wish;
}

// A file that was found, and that an edit has broken, emptied or deleted, is waited for: what it declares
// runs on. Throws InputError.
void refuse_lost_controllers(const RobotSetup& before, const RobotSetup& after, const Diagnostics& said) {
  if (before.controllers_named) return;
  const auto ours = [&before](const std::filesystem::path& file) {
    return std::ranges::find(before.controllers_files, file) != before.controllers_files.end();
  };
  for (const Diagnostic& d : said.all()) {
    if (d.rule == "up.controllers_unreadable" && d.where.known() && ours(*d.where.file))
      throw InputError(d.rule, d.where, d.message, d.mend);
  }
  for (const std::filesystem::path& file : before.declaring_files) {
    if (is_controllers_file(file)) continue;
    std::error_code none;
    const bool there = std::filesystem::exists(file, none);
    throw InputError("reload.controllers_lost", make_location(file.string()),
                     there ? "this file, which the running controllers come from, declares none any more"
                           : "this file, which the running controllers come from, does not exist any more",
                     "restore it; to run without it, start again");
  }
  if (!before.declaring_files.empty() && after.controllers_files.empty()) {
    throw InputError("reload.controllers_lost", make_location(before.declaring_files.front().string()),
                     "the controllers of this file, which run, would name no joint of this robot any more",
                     "correct the joints' names in it or in the description; to run without it, start again");
  }
}

// What runs must run on, whoever chose it; what comes new may be left out where nobody chose it.
void start_in_rehearsal(ControlStack& control, const Log& quiet, const ControllerWish& ran_before,
                        const ControllerWish& wish) {
  ControllerWish ran = wish;
  ran.what_fits = false;
  std::erase_if(ran.active, [&](const std::string& name) {
    return std::find(ran_before.active.begin(), ran_before.active.end(), name) == ran_before.active.end();
  });
  control.start(ran, quiet);
  if (wish.what_fits) control.start(wish, quiet);
}

}  // namespace

void rehearse(const RobotMachine& machine, Instance instance, const Scenario& scenario,
              const ControllerRegistry& controllers, const HardwareRegistry& hardware,
              const std::function<void(ControlStack&, const Log&)>& start, Diagnostics& diagnostics) {
  Bus bus({.names = scenario.ros.names, .sim_time = !scenario.wall_stamps});
  const Log quiet;
  const ControlStack::Options with{controllers, hardware, scenario.enforce_limits, /*rehearsal=*/true};
  ControlStack control(bus, machine, instance, with, quiet, diagnostics);
  start(control, quiet);
  // What publishes its state may refuse, too.
  StatePublisher::Options options;
  options.name_space = machine.name_space();
  options.tf = machine.asked().tf;
  options.X_WR = machine.instance().X_WR;
  options.file = &machine.setup().controllers;
  const StatePublisher state(bus, machine.description(), machine.shared_model(), options);
}

std::map<std::string, ControllerWish> Twin::Impl::present_wishes() const {
  std::map<std::string, ControllerWish> out;
  for (const auto& robot : robots) out[robot->name_space()] = robot->present_wish();
  return out;
}

bool Twin::Impl::adopt(const std::vector<std::shared_ptr<const RobotMachine>>& machines,
                       const std::map<std::string, ControllerWish>& wishes) {
  std::vector<std::unique_ptr<TwinRobot>> before = std::exchange(robots, {}), next(machines.size());
  std::vector<std::optional<TwinRobot::Past>> pasts(machines.size());
  bool same = machines.size() == before.size();
  for (std::size_t i = 0; i < machines.size(); ++i) {
    const auto found = std::ranges::find_if(before, [&](const auto& robot) {
      return robot != nullptr && robot->name_space() == machines[i]->name_space();
    });
    if (found == before.end()) {
      same = false;
      continue;
    }
    std::unique_ptr<TwinRobot> robot = std::move(*found);
    pasts[i] = robot->past();
    if (!same_structure(robot->machine(), *machines[i]) || robot->step() != machine->world.step) {
      same = false;  // it goes, and its names on the bus are free
    } else {
      next[i] = std::move(robot);
    }
  }
  before.clear();
  try {
    for (std::size_t i = 0; i < machines.size(); ++i) adopt(machines[i], next[i], pasts[i], wishes);
  } catch (...) {
    for (auto& robot : next) {
      if (robot != nullptr) robots.push_back(std::move(robot));
    }
    throw;
  }
  renew_handles();
  return same;
}

// One of them: `robot` goes on with the machine, or is made anew where it is null.
void Twin::Impl::adopt(const std::shared_ptr<const RobotMachine>& machine_of_it,
                       std::unique_ptr<TwinRobot>& robot, std::optional<TwinRobot::Past> past,
                       const std::map<std::string, ControllerWish>& wishes) {
  if (robot != nullptr) {
    robot->take_over(machine_of_it, instance_of(*machine->engine, *machine_of_it));
    robots.push_back(std::move(robot));
    robots.back()->make_publishers();
    return;
  }
  Diagnostics reported_before;
  robots.push_back(make_robot(machine_of_it, std::move(past), reported_before));
  TwinRobot& made = *robots.back();
  const auto wish = wishes.find(made.name_space());
  if (wish != wishes.end()) {
    made.start(wish->second);
  } else if (scenario.start_controllers) {
    made.start(made.first_wish());
  }
  made.make_publishers();
}

Twin::Reload Twin::Impl::replace(Replacement& fresh) {
  if (!std::ranges::equal(
          fresh.running->robots.now, machine->robots, {}, [](const auto& robot) { return robot->name(); },
          [](const auto& robot) { return robot->name(); })) {
    throw InputError("reload.robots_changed", {}, "a robot came or went while the edit was read",
                     "save the file again");
  }
  refuse_lost_range(*machine, *fresh.machine);
  carry_over_state(*machine, *fresh.machine);
  const std::map<std::string, ControllerWish> before = present_wishes();
  std::swap(machine, fresh.machine);  // the old one waits there, to run on if controllers refuse the new one
  bool same = false;
  try {
    same = adopt(machine->robots, fresh.wishes);
  } catch (...) {  // what prepare() could not rehearse
    std::swap(machine, fresh.machine);
    adopt(machine->robots, before);
    throw;
  }
  publish_state();
  return same ? Reload::controllers_went_on : Reload::controllers_made_anew;
}

std::shared_ptr<const Twin::Running> Twin::running() const {
  auto out = std::make_shared<Running>();
  out->robots = {impl_->machine->robots, impl_->machine->world.robots};
  out->wishes = impl_->present_wishes();
  out->settings = impl_->machine->world;
  return out;
}

std::shared_ptr<Twin::Replacement> Twin::prepare(const std::shared_ptr<const Running>& running,
                                                 Diagnostics& diagnostics) const {
  auto fresh = std::make_shared<Replacement>();
  fresh->running = running;
  fresh->machine = std::make_unique<Machine>(impl_->scenario, diagnostics, &running->robots);
  for (const auto& robot : fresh->machine->robots) {
    const auto ran = running->wishes.find(robot->name_space());
    const bool is_new = ran == running->wishes.end();
    for (const auto& before : running->robots.now) {
      if (before->name_space() == robot->name_space())
        refuse_lost_controllers(before->setup(), robot->setup(), diagnostics);
    }
    const auto start = [&](ControlStack& control, const Log& quiet) {
      if (is_new) {
        if (impl_->scenario.start_controllers) control.start(control.wish_of(robot->asked().activate), quiet);
        return;
      }
      ControllerWish& wish = fresh->wishes[robot->name_space()];
      wish = renewed(ran->second, control.manager().declared_controllers(), impl_->scenario, robot->asked());
      start_in_rehearsal(control, quiet, ran->second, wish);
    };
    rehearse(*robot, instance_of(*fresh->machine->engine, *robot), impl_->scenario, impl_->controllers,
             impl_->hardware, start, diagnostics);
  }
  fresh->machine->engine->reset();
  return fresh;
}

Twin::Reload Twin::replace(const std::shared_ptr<Replacement>& replacement) {
  return impl_->replace(*replacement);
}

std::vector<ModelInstance> Twin::instances(const Replacement& replacement) {
  return replacement.machine->engine->world().instances();
}

}  // namespace doppel
