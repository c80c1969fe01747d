#include "doppel/control/manager/detail/idle_parameters.h"

#include <fmt/format.h>

#include <span>

#include "doppel/control/manager/distro_differences.h"

namespace doppel {
namespace {

constexpr const char* kWhy = "not used: one thread and one clock run all nodes";

// Hz for the periodicity, microseconds for the execution time.
struct Threshold {
  const char* name;
  double warn, error;
};
constexpr Threshold kPeriodicity[] = {{"periodicity.mean_error", 5, 10},
                                      {"periodicity.standard_deviation", 5, 10}};
constexpr Threshold kExecutionTime[] = {{"execution_time.mean_error", 1000, 2000},
                                        {"execution_time.standard_deviation", 100, 200}};

// Parameters without a default, of any type.
bool meant_for_ros2_control(std::string_view name) {
  for (const std::string_view known :
       {"robot_description", "cpu_affinity", "thread_priority", "lock_memory", "diagnostics.", "overruns.",
        "defaults.", "statistics.", "hardware_synchronization."}) {
    if (name == known || (known.ends_with('.') && name.starts_with(known))) return true;
  }
  return false;
}

class Declarer {
 public:
  Declarer(Parameters& parameters, ParameterOverrides& written)
      : parameters_(parameters), written_(written) {}

  template <class T>
  void idle(const std::string& name, T initial) {
    if (const DistroDefault* const changed = changed_default("controller_manager", name)) {
      if (const T* const value = std::get_if<T>(changed)) initial = *value;
    }
    declare<T>(parameters_, &written_, name, std::move(initial), {kWhy, true});
  }
  void thresholds(const char* of, std::span<const Threshold> all) {
    for (const Threshold& one : all) {
      idle(fmt::format("diagnostics.threshold.{}.{}.warn", of, one.name), one.warn);
      idle(fmt::format("diagnostics.threshold.{}.{}.error", of, one.name), one.error);
    }
  }

 private:
  Parameters& parameters_;
  ParameterOverrides& written_;
};

}  // namespace

void declare_idle_parameters(Parameters& parameters, ParameterOverrides& written) {
  Declarer declarer(parameters, written);
  declarer.idle("handle_exceptions", true);
  declarer.idle("hardware_components_initial_state.shutdown_on_initial_state_failure", true);
  declarer.idle("defaults.allow_controller_activation_with_inactive_hardware", false);
  declarer.idle("defaults.deactivate_controllers_on_hardware_self_deactivate", true);
  declarer.thresholds("controller_manager", kPeriodicity);
  for (const char* of : {"controllers", "hardware_components"}) {
    declarer.thresholds(of, kPeriodicity);
    declarer.thresholds(of, kExecutionTime);
  }
  declarer.idle("overruns.print_warnings", false);
  for (const ParameterOverride& o : written.all()) {
    if (meant_for_ros2_control(o.name)) written.find(o.name)->used = true;
  }
}

}  // namespace doppel
