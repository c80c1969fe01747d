#pragma once
// The implementation of the twin, shared by its source files: the loop (twin.cpp), the replacement of a
// running machine (twin_reload.cpp), and spawned and deleted robots (twin_robots.cpp).

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "doppel/control/manager/control_loop.h"
#include "doppel/scenario/compile/compiled_scenario.h"
#include "doppel/twin/loop/detail/sensor_ticks.h"
#include "doppel/twin/loop/detail/state_hash.h"
#include "doppel/twin/loop/scene.h"
#include "doppel/twin/loop/simulator_services.h"
#include "doppel/twin/loop/twin.h"

namespace doppel {

inline constexpr Duration kEditProbation{
    1'000'000'000};  // simulated: an edit that diverges within it is taken back

// The inputs of a machine besides files; shared, because a build on another thread may outlive the twin.
struct TwinSources {
  Scenario scenario;
  ControllerRegistry controllers;
  HardwareRegistry hardware;
};

struct Twin::Impl {
  Impl(Twin& the_twin, Scenario the_scenario, const Log& the_log, Diagnostics& diagnostics);
  ~Impl();

  // -- twin.cpp
  void add_world_ticks();
  void step();
  void hash_objects();
  // Locks out the loops of real hardware, including those that start meanwhile; uncontended in a simulation.
  [[nodiscard]] std::unique_lock<LoopGate> hold();
  [[nodiscard]] TwinRobot* find_robot_with_loop() const;  // the first one; nullptr: a simulation
  [[nodiscard]] Time control_time() const;
  void follow_wall(Time now);
  void publish_due(Time now);
  void publish_state();
  void between_steps();
  // Between steps: what a diverged physics leads to, and that it can step again after a reset.
  void settle_divergence();
  [[nodiscard]] std::string divergence_text() const;
  void reset(std::optional<Time> at = std::nullopt);  // at: the time afterwards; none: 0
  // Updates the scene and every handle to the engine's present instances.
  void renew_handles();
  // Instances may have changed without the twin, because users of engine() can spawn objects.
  void notice_instances() {
    if (seen_world != machine->engine->compiled()) renew_handles();
  }
  void all_due_now() {
    for (const auto& robot : robots) robot->control_at_once(count);
  }
  // Throws InputError if its nodes would have the names of those of a robot with another namespace.
  [[nodiscard]] std::unique_ptr<TwinRobot> make_robot(std::shared_ptr<const CompiledRobot> robot,
                                                      const TwinRobot* former, Diagnostics& diagnostics);
  [[nodiscard]] TwinRobot* find(std::string_view name_space) const;

  // -- twin_reload.cpp
  class RobotReplacement;
  Reload replace(Replacement& fresh);
  // Continues with the machine before the last edit, if that was applied shortly before. False: it was not,
  // or that fails.
  bool take_back_edit(const std::string& cause);
  [[nodiscard]] std::map<std::string, ControllerSelection> present_selections() const;

  // -- twin_robots.cpp
  void add_robot(JoiningRobot& joining);
  Status remove_robot(const std::string& name_space);
  struct Spawning;
  struct BuildResults;
  void spawn_robot(WorldRobot robot, SpawnedText text, std::function<void(const Status&)> done);
  void build(const std::shared_ptr<Spawning>& job);
  void settle(const std::shared_ptr<Spawning>& job);
  void answer(const Spawning& job, const Status& status);
  void abandon_build();
  void end_build();
  std::shared_ptr<BuildResults> make_build_results();

  Twin& twin;
  const std::shared_ptr<TwinSources> sources;
  const Scenario& scenario = sources->scenario;
  ControllerRegistry& controllers = sources->controllers;
  HardwareRegistry& hardware = sources->hardware;
  const Log& log;
  Bus bus;
  std::shared_ptr<StaticTransforms> statics = std::make_shared<StaticTransforms>();
  const std::shared_ptr<EarthFrame> earth = std::make_shared<EarthFrame>();  // of the present world
  const std::shared_ptr<RangeValues> ranges = std::make_shared<RangeValues>();
  TimeControl time_control;
  std::unique_ptr<CompiledScenario> machine;
  LoopGate gate;
  Scene scene;
  std::shared_ptr<const CompiledWorld> seen_world;  // the one of the handles
  std::vector<std::unique_ptr<TwinRobot>> robots;
  TickList ticks;                              // of the world
  SensorTicks* sensor_ticks = nullptr;         // in `ticks`
  SimulatorServices* time_services = nullptr;  // in `ticks`

  LoopPhases phases;
  Time last_wall{};  // wall-clock time of the last stamp
  std::uint64_t count = 0;
  std::uint64_t objects_hash = kEmptyHash, gone_hash = kEmptyHash;  // gone: of robots that were removed

  bool paused_by_divergence = false;
  // The machine before the last edit, with its state at that moment, while the edit may be taken back.
  struct Edited {
    std::shared_ptr<Replacement> before;
    std::shared_ptr<const CompiledWorld>
        world;       // of the edit; another one: something was added or removed since
    Time applied{};  // simulated
  };
  std::optional<Edited> edited;

  std::function<void()> robots_changed;
  std::shared_ptr<Spawning> spawning;  // by `builder`; nullptr: none
  const std::shared_ptr<BuildResults> build_results = make_build_results();
  const std::shared_ptr<std::atomic<int>> unfinished_builds = std::make_shared<std::atomic<int>>(0);
  std::thread builder;
};

struct Twin::Running {
  std::shared_ptr<const TwinSources> sources;
  RunningRobots robots;
  std::map<std::string, ControllerSelection> selections;  // by namespace
  std::shared_ptr<const CompiledWorld> world;
};

struct Twin::Replacement {
  std::unique_ptr<CompiledScenario> machine;
  std::map<std::string, ControllerSelection> selections;  // by namespace
  std::shared_ptr<const Running> running;                 // the machine for which it was made
};

struct Twin::JoiningRobot {
  std::shared_ptr<const CompiledRobot> machine;
  std::shared_ptr<const CompiledWorld> without, with;  // the world before, and the same with this robot

  // On any thread. Throws InputError.
  void compile_into(std::shared_ptr<const CompiledWorld> world);
};

// A rehearsal on a separate bus and in a separate world, in which errors of controllers and publishers occur
// before the running machine is changed. Throws InputError.
void rehearse(const CompiledRobot& machine, Instance instance, const Scenario& scenario,
              const ControllerRegistry& controllers, const HardwareRegistry& hardware,
              const std::function<void(ControlStack&, const Log&)>& start, Diagnostics& diagnostics);

}  // namespace doppel
