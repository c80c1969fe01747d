// Saved states of a twin. A restore checks everything first, and then goes through the layers from the
// engine up.

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/thrown.h"
#include "doppel/twin/loop/saved_state.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxDifferencesNamed = 5;

// The names that only one of the lists has: "+ elbow, - wrist".
std::string other_names(const std::vector<std::string>& before, const std::vector<std::string>& now) {
  std::string out;
  const auto add = [&out](const char* sign, const std::vector<std::string>& some,
                          const std::vector<std::string>& others) {
    for (const std::string& name : some) {
      if (std::ranges::find(others, name) == others.end())
        out += fmt::format("{}{} '{}'", out.empty() ? "" : ", ", sign, name);
    }
  };
  add("without", before, now);
  add("with", now, before);
  return out;
}

template <class T>
std::vector<std::string> names_of(const std::vector<T>& parts) {
  std::vector<std::string> out;
  for (const T& part : parts) out.push_back(part.name);
  return out;
}

std::string structure_difference(const CompiledRobot& before, const CompiledRobot& now) {
  const std::string joints = other_names(names_of(before.model().joints), names_of(now.model().joints));
  if (!joints.empty()) return "its joints have changed: " + joints;
  const std::string links = other_names(names_of(before.model().links), names_of(now.model().links));
  if (!links.empty()) return "its links have changed: " + links;
  if (before.setup().controllers.text() != now.setup().controllers.text())
    return "its controllers' file has changed";
  return "the type of a joint, its <mimic> or its <ros2_control> has changed";
}

bool same_joints(const Model& a, const Model& b) {
  return a.nq == b.nq && a.nv == b.nv && a.joints.size() == b.joints.size() &&
         a.links.size() == b.links.size();
}

void write_drives(const Instance& source, Instance target) {
  for (std::size_t j = 0; j < target.model().joints.size(); ++j) {
    if (!target.model().joints[j].scalar() || target.model().joints[j].mimics()) continue;
    const int joint = static_cast<int>(j);
    const DriveState drive = source.drive_state(joint);
    target.set_drive(joint, drive.mode);
    target.set_target(joint, drive.target);
    if (drive.mode == DriveMode::position) target.set_drive_reference(joint, drive.reference);
  }
}

// The state of an engine of another compilation, whose instances have the same names and joints.
void write_by_names(const Engine& source, Engine& target) {
  target.set_time(source.time());
  target.clear_applied();
  const std::vector<Attachment> present = target.attachments();
  for (const Attachment& attachment : present) target.detach(attachment.a, attachment.b);
  for (int i = 0; i < static_cast<int>(target.world().instances().size()); ++i) {
    Instance instance = target.instance(i);
    const std::optional<const Instance> before = source.find(instance.name());
    if (!before) continue;
    // A base that is fixed stands where the edited files put it; an object may have been moved.
    if (instance.made_of().is_object()) instance.set_root_pose(before->root_pose());
    instance.set_state(before->q(), before->v());
    write_drives(*before, instance);
  }
  const auto same_body = [&](BodyId body) {
    if (!body.is_ground()) body.instance = target.world().find(source.instance(body.instance).name());
    return body;
  };
  for (const Attachment& attachment : source.attachments())
    static_cast<void>(target.attach(same_body(attachment.a), same_body(attachment.b)));
}

}  // namespace

Status TwinCore::save(SavedState& out) {
  const auto held = hold();
  if (const TwinRobot* const real = find_robot_with_loop())
    return Status::refused(fmt::format(
        "'{}' drives real hardware, whose joints cannot be brought back to a former state", real->name()));
  if (engine().diverged()) return Status::refused("the physics has diverged; reset the simulation first");
  notice_instances();
  out.time_ = now();
  out.steps_ = steps_;
  out.objects_hash_ = objects_hash_;
  out.gone_hash_ = gone_hash_;
  out.machine_ = machine_->number;
  out.model_sensors_ = machine_->model_sensors;
  if (out.engine_ != nullptr && out.engine_->compiled() == engine().compiled()) {
    out.engine_->copy_state(engine());
  } else {
    out.engine_ = engine().clone();
  }
  parts_.save(out.parts_);
  out.robots_.resize(robots_.size());
  out.unsaved_.clear();
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    SavedState::Robot& robot = out.robots_[i];
    robot.name_space = robots_[i]->name_space();
    robot.machine = robots_[i]->shared_machine();
    if (Status status = robots_[i]->save(robot.run); !status) return status;
    for (const std::string& name : ControllerManager::unsaved_controllers(*robot.run.manager))
      out.unsaved_.push_back(robot.name_space.empty() ? name : robot.name_space + "/" + name);
  }
  return {};
}

std::vector<std::string> TwinCore::differences(const SavedState& saved) const {
  std::vector<std::string> out;
  for (const SavedState::Robot& before : saved.robots_) {
    const TwinRobot* const robot = find(before.name_space);
    if (robot == nullptr || robot->name() != before.machine->name()) {
      out.push_back(fmt::format("the robot '{}' has been removed since", before.machine->name()));
    } else if (robot->shared_machine() != before.machine &&
               !same_structure(*before.machine, robot->machine())) {
      out.push_back(fmt::format("'{}' is another robot after an edit: {}", robot->name(),
                                structure_difference(*before.machine, robot->machine())));
    } else {
      for (const std::string& difference : robot->controller_manager().differences(*before.run.manager))
        out.push_back(fmt::format("'{}': {}", robot->name(), difference));
    }
  }
  for (const auto& robot : robots_) {
    const auto same = [&](const SavedState::Robot& before) {
      return before.name_space == robot->name_space();
    };
    if (std::ranges::none_of(saved.robots_, same))
      out.push_back(fmt::format("the robot '{}' has been added since", robot->name()));
  }
  if (saved.machine_ == machine_->number) return out;
  // After a reload the world of the saved state cannot be continued, and each object needs its counterpart.
  const CompiledWorld &before = saved.engine_->world(), &now = engine().world();
  if (before.settings().step != now.settings().step)
    out.emplace_back("the world has another step after an edit");
  if (const std::string names = other_names(names_of(before.instances()), names_of(now.instances()));
      !names.empty())
    out.push_back("the world was edited since and has other objects: " + names);
  for (const ModelInstance& instance : now.instances()) {
    const int index = before.find(instance.name);
    if (index < 0 || !instance.is_object()) continue;
    if (!same_joints(*before.instances()[static_cast<std::size_t>(index)].model, *instance.model))
      out.push_back(fmt::format("'{}' has other joints after an edit", instance.name));
  }
  return out;
}

// Objects that were added since are removed, and those that were removed return, with the world of the
// saved state.
void TwinCore::restore_engine(const SavedState& saved) {
  if (saved.machine_ != machine_->number) return write_by_names(*saved.engine_, engine());
  if (engine().compiled() != saved.engine_->compiled()) {
    engine().continue_with(saved.engine_->compiled());
    machine_->model_sensors = saved.model_sensors_;
    renew_handles();
  }
  engine().copy_state(*saved.engine_);
}

void TwinCore::restore_values(const SavedState& saved) {
  steps_ = saved.steps_;
  objects_hash_ = saved.objects_hash_;
  gone_hash_ = saved.gone_hash_;
  for (const SavedState::Robot& before : saved.robots_)
    find(before.name_space)->restore_values(before.run, now());
  parts_.restore(saved.parts_, now());
}

Status TwinCore::restore(const SavedState& saved) {
  const auto held = hold();
  if (const TwinRobot* const real = find_robot_with_loop())
    return Status::refused(fmt::format(
        "'{}' drives real hardware, whose joints cannot be brought back to a former state", real->name()));
  if (const std::vector<std::string> why = differences(saved); !why.empty()) {
    const std::size_t named = std::min(why.size(), kMaxDifferencesNamed);
    std::string text =
        fmt::format("{}", fmt::join(why.begin(), why.begin() + static_cast<std::ptrdiff_t>(named), "; "));
    if (why.size() > named) text += fmt::format("; and {} more differences", why.size() - named);
    return Status::refused(std::move(text));
  }
  try {
    restore_engine(saved);
  } catch (const InputError&) {
    return Status::refused("the world of that state cannot be continued: " + thrown_text());
  }
  bus_.set_now(now());
  follow_wall(now());
  bool switched = false;
  for (const SavedState::Robot& before : saved.robots_)
    switched = find(before.name_space)->controller_manager().restore_switches(*before.run.manager, now()) ||
               switched;
  // A switch of controllers changes drives.
  if (switched) restore_engine(saved);
  restore_values(saved);
  // Publishing reads hardware and shifts schedules, so that the values are restored once more.
  publish_state();
  restore_values(saved);
  for (const SavedState::Robot& before : saved.robots_)
    find(before.name_space)->controller_manager().restart_unsaved(*before.run.manager, now());
  if (saved.machine_ != machine_->number)
    log_.note("state",
              "the files were edited since that state was saved: it continues with the present parameters");
  return {};
}

}  // namespace doppel
