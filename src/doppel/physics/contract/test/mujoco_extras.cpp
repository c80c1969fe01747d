// The functions of mujoco_extras.h, looked up in the MuJoCo module.

#include "doppel/physics/contract/test/mujoco_extras.h"

#include "doppel/base/core/plugin_module.h"

namespace doppel {
namespace {

constexpr const char* kModule = "doppel_engine_mujoco";

}  // namespace

double measure_bare_step_rate(const Engine& engine, int steps) {
  using Measure = double (*)(const Engine&, int);
  return reinterpret_cast<Measure>(plugin_symbol(kModule, "doppel_mujoco_bare_step_rate"))(  // NOLINT
      engine, steps);
}

void mujoco_inverse_dynamics(const Engine& engine, std::span<const double> acceleration,
                             std::span<double> tau) {
  using Solve = void (*)(const Engine&, const double*, double*);
  reinterpret_cast<Solve>(plugin_symbol(kModule, "doppel_mujoco_inverse_dynamics"))(  // NOLINT
      engine, acceleration.data(), tau.data());
}

namespace {

bool changes_nothing(const Engine& engine, bool rules_of_world) {
  using Compare = bool (*)(const Engine&, bool);
  return reinterpret_cast<Compare>(plugin_symbol(kModule, "doppel_mujoco_same_contacts"))(  // NOLINT
      engine, rules_of_world);
}

}  // namespace

bool empty_contact_rules_change_nothing(const Engine& engine) {
  return changes_nothing(engine, false);
}

bool contact_rules_change_nothing(const Engine& engine) {
  return changes_nothing(engine, true);
}

bool mujoco_error_unwinds(const Engine& engine) {
  using Raise = bool (*)(const Engine&);
  return reinterpret_cast<Raise>(plugin_symbol(kModule, "doppel_mujoco_error_unwinds"))(engine);  // NOLINT
}

double difference_of_islands(const Engine& engine) {
  using Compare = double (*)(const Engine&);
  return reinterpret_cast<Compare>(plugin_symbol(kModule, "doppel_mujoco_island_difference"))(  // NOLINT
      engine);
}

}  // namespace doppel
