#include "python/rollouts.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

namespace doppel::python {
namespace {

std::vector<int> driven_joints(const Model& model) {
  std::vector<int> out;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    if (model.joints[i].scalar() && !model.joints[i].mimics()) out.push_back(static_cast<int>(i));
  }
  return out;
}

void command(Instance& robot, const std::vector<int>& driven, std::span<const double> row, DriveMode mode) {
  for (std::size_t i = 0; i < driven.size(); ++i) {
    const DriveMode chosen = std::isnan(row[i]) ? DriveMode::passive : mode;
    if (robot.drive(driven[i]) != chosen) robot.set_drive(driven[i], chosen);
    if (chosen != DriveMode::passive) robot.set_target(driven[i], row[i]);
  }
}

// The engine is a fresh one, because a reset may keep the solver's last guess.
void run(const RolloutInputs& inputs, std::size_t index, std::span<double> states) {
  const std::unique_ptr<Engine> engine = inputs.world->make_engine();
  Instance robot = engine->instance(inputs.instance);
  const std::vector<int> driven = driven_joints(robot.model());
  const auto nq = static_cast<std::size_t>(robot.model().nq);
  const std::size_t size = nq + static_cast<std::size_t>(robot.model().nv);
  const auto start = inputs.starts.subspan(index * size, size);
  robot.set_state(start.first(nq), start.subspan(nq));
  for (std::size_t row = 0; row < inputs.rows; ++row) {
    command(robot, driven,
            inputs.commands.subspan((index * inputs.rows + row) * driven.size(), driven.size()), inputs.mode);
    for (std::uint64_t i = 0; i < inputs.steps_per_row; ++i) engine->step();
    const auto out = states.subspan((index * inputs.rows + row) * size, size);
    if (engine->diverged()) {
      std::ranges::fill(out, std::numeric_limits<double>::quiet_NaN());
    } else {
      std::ranges::copy(robot.q(), out.begin());
      std::ranges::copy(robot.v(), out.begin() + static_cast<std::ptrdiff_t>(nq));
    }
  }
}

}  // namespace

void roll_out(const RolloutInputs& inputs, std::size_t threads, std::span<double> states) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < inputs.runs; i = next++) run(inputs, i, states);
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
      next = inputs.runs;
    }
  };
  std::vector<std::jthread> others;
  for (std::size_t i = 1; i < std::min(threads, inputs.runs); ++i) others.emplace_back(work);
  work();
  others.clear();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace doppel::python
