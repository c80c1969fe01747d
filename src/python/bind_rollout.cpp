// rollout of Python: the world is compiled once, in a twin without controllers.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <tuple>

#include "doppel/base/core/names.h"
#include "doppel/scenario/compile/compiled_scenario.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/rollouts.h"
#include "python/stepped_twin.h"

namespace doppel::python {
namespace {

DriveMode mode_of(const std::string& name) {
  const std::vector<std::string> names{"position", "velocity", "effort"};
  constexpr std::array kModes{DriveMode::position, DriveMode::velocity, DriveMode::effort};
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw InputError("python.mode", {},
                     fmt::format("'{}' is no mode of a drive{}", name, did_you_mean(name, names)));
  return kModes[static_cast<std::size_t>(found - names.begin())];
}

// state0: [runs, nq + nv], commands: [runs, rows, driven]; python/doppel/_rollout.py has checked the shapes.
Numbers rollout(SteppedTwin& twin, const Numbers& state0, const Numbers& commands, std::size_t threads,
                const std::string& mode, std::uint64_t steps_per_row) {
  RolloutInputs inputs;
  std::shared_ptr<const CompiledWorld> world;
  {
    const py::gil_scoped_release released;
    std::tie(world, inputs.instance) = twin.read_robot(0, [](const TwinRobot& robot) {
      return std::pair(robot.instance().engine().compiled(), robot.instance().index());
    });
  }
  inputs.world = world.get();
  inputs.starts = {state0.data(), static_cast<std::size_t>(state0.size())};
  inputs.commands = {commands.data(), static_cast<std::size_t>(commands.size())};
  inputs.runs = static_cast<std::size_t>(commands.shape(0));
  inputs.rows = static_cast<std::size_t>(commands.shape(1));
  inputs.steps_per_row = steps_per_row;
  inputs.mode = mode_of(mode);
  Numbers states(std::vector<py::ssize_t>{commands.shape(0), commands.shape(1), state0.shape(1)});
  const std::span<double> out(states.mutable_data(), static_cast<std::size_t>(states.size()));
  const py::gil_scoped_release released;
  roll_out(inputs, threads, out);
  return states;
}

}  // namespace

void bind_rollout(py::module_& module) {
  module.def("rollout", &rollout);
}

}  // namespace doppel::python
