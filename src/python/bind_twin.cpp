// Twin of Python: a running twin with its arrays, its bus, saved states and recording. python/doppel/_twin.py
// adds names and texts. All functions that run the twin release the interpreter's lock.
#include <pybind11/stl.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "doppel/base/core/installation.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/twin/loop/saved_state.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/described_model.h"
#include "python/stepped_twin.h"

namespace doppel::python {
namespace {

using Unlocked = py::call_guard<py::gil_scoped_release>;

// The options of Python's Twin, by their names there.
std::shared_ptr<SteppedTwin> make_twin(const std::vector<std::shared_ptr<DescribedModel>>& models,
                                       const std::vector<std::string>& name_spaces, const py::dict& options) {
  Scenario scenario;
  for (std::size_t i = 0; i < models.size(); ++i) {
    WorldRobot& robot = scenario.robots.emplace_back();
    robot.target = models[i]->twin_target;
    robot.arguments = models[i]->twin_arguments;
    if (i < name_spaces.size()) robot.name_space = name_spaces[i];
    for (const auto& file : options["controller_files"].cast<std::vector<std::string>>())
      robot.controllers.emplace_back(file);
    robot.activate = options["activate"].cast<std::vector<std::string>>();
  }
  scenario.bundled_robots = data_folder() / "robots";
  if (!options["world"].is_none()) scenario.world = options["world"].cast<std::string>();
  if (!options["step"].is_none()) scenario.step = from_seconds(options["step"].cast<double>());
  scenario.engine = options["engine"].cast<std::string>();
  scenario.start_controllers = options["controllers"].cast<bool>();
  scenario.ideal = options["ideal"].cast<bool>();
  scenario.sensors.seed = options["seed"].cast<std::uint64_t>();
  scenario.sensors.lockstep = true;
  const py::gil_scoped_release released;
  return std::make_shared<SteppedTwin>(scenario);
}

// A view of memory that `owner` keeps; NumPy does not copy it.
py::object view_of(std::vector<double>& values, const py::object& owner, bool writable) {
  Numbers view(std::vector<py::ssize_t>{static_cast<py::ssize_t>(values.size())},
               std::vector<py::ssize_t>{sizeof(double)}, values.data(), owner);
  if (!writable) view.attr("flags").attr("writeable") = false;
  return view;
}

py::dict arrays(const py::object& self, std::size_t robot) {
  auto& twin = self.cast<SteppedTwin&>();
  RobotArrays& values = twin.arrays(robot);
  py::dict out;
  out["q"] = view_of(values.q, self, false);
  out["v"] = view_of(values.v, self, false);
  out["effort"] = view_of(values.effort, self, false);
  out["command"] = view_of(values.command, self, true);
  return out;
}

// The result of `function`, which reads the twin with its lock held. The interpreter's lock is released
// meanwhile, because another thread may hold the twin for many steps.
template <class Function>
auto read(const SteppedTwin& self, Function function) {
  const py::gil_scoped_release released;
  return self.read(function);
}

struct RobotListing {
  std::string name, name_space;
  std::vector<std::tuple<std::string, int, int>> joints = {};  // scalar: name, indices in q and v
  std::vector<std::string> driven = {};
  std::vector<ControllerView> controllers = {};
};

RobotListing listing_of(const TwinRobot& robot) {
  const Model& model = robot.model();
  RobotListing out{.name = robot.name(), .name_space = robot.name_space()};
  for (const ModelJoint& joint : model.joints) {
    if (joint.scalar()) out.joints.emplace_back(joint.name, joint.q, joint.v);
  }
  out.driven = model.driven_joint_names();
  out.controllers = robot.controller_manager().controllers();
  return out;
}

py::dict to_dict(const RobotListing& robot) {
  py::dict out;
  out["name"] = robot.name;
  out["namespace"] = robot.name_space;
  out["joints"] = robot.joints;
  out["driven"] = robot.driven;
  py::list controllers;
  for (const ControllerView& controller : robot.controllers)
    controllers.append(py::make_tuple(controller.name, controller.type,
                                      std::string(to_string(controller.state)), controller.claimed));
  out["controllers"] = controllers;
  return out;
}

py::list robots(const SteppedTwin& self) {
  const auto listed = read(self, [](Twin& twin) {
    std::vector<RobotListing> out;
    for (const auto& robot : twin.robots()) out.push_back(listing_of(*robot));
    return out;
  });
  py::list out;
  for (const RobotListing& robot : listed) out.append(to_dict(robot));
  return out;
}

py::dict link_poses(const SteppedTwin& self, std::size_t robot) {
  std::vector<std::pair<std::string, Pose>> poses;
  {
    const py::gil_scoped_release released;
    poses = self.read_robot(robot, [](const TwinRobot& shown) {
      std::vector<std::pair<std::string, Pose>> found;
      const std::vector<ModelLink>& links = shown.model().links;
      for (std::size_t i = 0; i < links.size(); ++i)
        found.emplace_back(links[i].name, shown.instance().link_pose(static_cast<int>(i)));
      return found;
    });
  }
  py::dict out;
  for (const auto& [name, X_WL] : poses) {
    Numbers pose(std::vector<py::ssize_t>{4, 4});
    write_pose(X_WL, pose.mutable_data());
    out[py::str(name)] = pose;
  }
  return out;
}

// The newest image of a topic: (time in s, encoding, height, width, bytes of a row, data), or None.
py::object newest_image(SteppedTwin& self, const std::string& topic) {
  double time = 0;
  sensor_msgs::msg::Image image;
  bool is_there = false;
  {
    const py::gil_scoped_release released;
    const Bytes bytes = self.newest(topic, time);
    is_there = !bytes.empty() && from_cdr(std::span<const std::byte>(bytes), image).ok();
  }
  if (!is_there) return py::none();
  py::array_t<std::uint8_t> data(static_cast<py::ssize_t>(image.data.size()));
  std::memcpy(data.mutable_data(), image.data.data(), image.data.size());
  return py::make_tuple(time, image.encoding, image.height, image.width, image.step, data);
}

py::list sensors(const SteppedTwin& self) {
  py::list out;
  for (const RigStatus& status : read(self, [](Twin& twin) { return twin.sensors(); })) {
    py::dict sensor;
    sensor["name"] = status.sensor.name;
    sensor["type"] = status.sensor.type;
    sensor["topics"] = status.sensor.topics;
    sensor["frame"] = status.sensor.frame;
    sensor["rate"] = status.sensor.rate;
    out.append(sensor);
  }
  return out;
}

template <class List>
py::dict names_and_types(const List& list) {
  py::dict out;
  for (const auto& one : list) out[py::str(one.name)] = one.type;
  return out;
}

py::dict parameters(SteppedTwin& self) {
  std::vector<NamedParameter> list;
  {
    const py::gil_scoped_release released;
    list = self.parameters();
  }
  py::dict out;
  for (const NamedParameter& parameter : list) {
    const py::str node(parameter.node);
    if (!out.contains(node)) out[node] = py::dict();
    out[node][py::str(parameter.name)] = py::cast(parameter.value);
  }
  return out;
}

py::list take_log(SteppedTwin& self) {
  py::list out;
  for (const LogLine& line : self.take_log())
    out.append(py::make_tuple(std::string(to_string(line.severity)), line.origin, line.text));
  return out;
}

py::list take_messages(SteppedTwin& self, const std::string& topic) {
  std::vector<TextMessage> messages;
  {
    const py::gil_scoped_release released;
    messages = self.take_messages(topic);
  }
  py::list out;
  for (const TextMessage& message : messages) out.append(py::make_tuple(message.time, message.json));
  return out;
}

// Ctrl-C ends a long call between two parts of it, and another thread can use the twin there. `run`: takes so
// many steps; true ends the call.
template <class Run>
void in_parts(std::uint64_t steps, Run run) {
  constexpr std::uint64_t kPart = 5000;
  for (std::uint64_t count = 0; count < steps || count == 0; count += kPart) {
    if (run(std::min(kPart, steps - count)) || steps <= kPart) return;
    const py::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

void step(SteppedTwin& self, std::uint64_t steps) {
  in_parts(steps, [&](std::uint64_t part) {
    self.step(part);
    return false;
  });
}

bool step_until_answered(SteppedTwin& self, std::uint32_t call, std::uint64_t steps) {
  bool is_there = false;
  in_parts(steps, [&](std::uint64_t part) { return is_there = self.step_until_answered(call, part); });
  return is_there;
}

// A property of the twin that takes the lock.
template <class Function>
py::cpp_function locked(Function function) {
  return py::cpp_function([function](const SteppedTwin& self) { return self.read(function); }, Unlocked());
}

void bind_bus(py::class_<SteppedTwin, std::shared_ptr<SteppedTwin>>& twin) {
  twin.def("topics",
           [](const SteppedTwin& self) {
             return names_and_types(read(self, [](Twin& running) { return running.bus().topics(); }));
           })
      .def("services",
           [](const SteppedTwin& self) {
             return names_and_types(read(self, [](Twin& running) { return running.bus().services(); }));
           })
      .def("publish", &SteppedTwin::publish, Unlocked())
      .def("subscribe", &SteppedTwin::subscribe, Unlocked())
      .def("unsubscribe", &SteppedTwin::unsubscribe, Unlocked())
      .def("take_messages", &take_messages)
      .def("newest_image", &newest_image)
      .def("begin_call", &SteppedTwin::begin_call, Unlocked())
      .def("step_until_answered", &step_until_answered, Unlocked())
      .def("take_answer", &SteppedTwin::take_answer, Unlocked())
      .def("parameters", &parameters)
      .def("set_parameter", &SteppedTwin::set_parameter, Unlocked());
}

}  // namespace

void bind_twin(py::module_& module) {
  py::class_<SavedState, std::shared_ptr<SavedState>>(module, "SavedState")
      .def_property_readonly("time", [](const SavedState& self) { return to_seconds(self.time()); })
      .def_property_readonly("steps", &SavedState::steps)
      .def_property_readonly("unsaved_controllers", &SavedState::unsaved_controllers);
  py::class_<SteppedTwin, std::shared_ptr<SteppedTwin>> twin(module, "SteppedTwin");
  twin.def("step", &step, Unlocked())
      .def("view", &SteppedTwin::view, Unlocked())
      .def("close", &SteppedTwin::close, Unlocked())
      .def_property_readonly("closed", py::cpp_function(&SteppedTwin::is_closed, Unlocked()))
      .def("reset", &SteppedTwin::reset, Unlocked())
      .def("set_state", &SteppedTwin::set_state, Unlocked())
      .def("save",
           [](SteppedTwin& self) {
             const py::gil_scoped_release released;
             return std::const_pointer_cast<SavedState>(self.save());
           })
      .def("restore", &SteppedTwin::restore, Unlocked())
      .def_property_readonly("time", locked([](Twin& running) { return to_seconds(running.now()); }))
      .def_property_readonly("step_size",
                             locked([](Twin& running) { return to_seconds(running.step_size()); }))
      .def_property_readonly("steps", locked([](Twin& running) { return running.steps(); }))
      .def_property_readonly("state_hash", locked([](Twin& running) { return running.state_hash(); }))
      .def_property_readonly("diagnostics",
                             [](const SteppedTwin& self) { return to_list(self.diagnostics()); })
      .def("check_command", &SteppedTwin::check_command, Unlocked())
      .def("check_present", &SteppedTwin::check_present)
      .def("arrays", [](const py::object& self, std::size_t robot) { return arrays(self, robot); })
      .def("robots", &robots)
      .def("link_poses", &link_poses)
      .def("sensors", &sensors)
      .def("take_log", &take_log)
      .def("record", &SteppedTwin::record, Unlocked())
      .def("stop_recording", &SteppedTwin::stop_recording, Unlocked());
  bind_bus(twin);
  module.def("make_twin", &make_twin);
}

}  // namespace doppel::python
