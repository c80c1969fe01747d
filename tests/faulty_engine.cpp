// MuJoCo behind calls that may fail, like an engine with errors.

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "doppel/physics/contract/engine_modules.h"
#include "faults.h"

namespace doppel::test {
namespace {

thread_local std::uint64_t compiled_here = 0;
std::atomic<std::thread::id> only_thread;  // that may compile; none: all

void call() {
  if (strikes(Fault::engine)) throw std::runtime_error("injected fault in a call of the engine");
}

class FaultyWorld;

class FaultyEngine final : public Engine {
 public:
  FaultyEngine(std::shared_ptr<const CompiledWorld> world, std::unique_ptr<Engine> inner)
      : Engine(std::move(world)), inner_(std::move(inner)) {}

  [[nodiscard]] std::unique_ptr<Engine> clone() const override {
    call();
    return std::make_unique<FaultyEngine>(world_, inner_->clone());
  }
  void copy_state(const Engine& from) override {
    call();
    inner_->copy_state(*static_cast<const FaultyEngine&>(from).inner_);
  }
  void reset() override { struck(*inner_).reset(); }
  void step() override { struck(*inner_).step(); }
  [[nodiscard]] Time time() const override { return inner_->time(); }
  void set_time(Time now) override { struck(*inner_).set_time(now); }
  [[nodiscard]] bool diverged() const override { return inner_->diverged(); }
  void clear_applied() override { struck(*inner_).clear_applied(); }
  [[nodiscard]] double kinetic_energy() const override { return inner_->kinetic_energy(); }
  [[nodiscard]] double potential_energy() const override { return inner_->potential_energy(); }
  void contacts(std::vector<Contact>& out) const override { inner_->contacts(out); }
  [[nodiscard]] RayHit cast_ray(const Eigen::Vector3d& from_W,
                                const Eigen::Vector3d& direction_W) const override {
    return inner_->cast_ray(from_W, direction_W);
  }

 private:
  static Engine& struck(Engine& engine) {
    call();
    return engine;
  }
  [[nodiscard]] Instance at(int instance) const { return inner_->instance(instance); }
  Instance struck_at(int instance) {
    call();
    return inner_->instance(instance);
  }
  void become(std::shared_ptr<const CompiledWorld> world, std::span<const int> kept) override;
  [[nodiscard]] std::span<const double> q_of(int i) const override { return at(i).q(); }
  [[nodiscard]] std::span<const double> v_of(int i) const override { return at(i).v(); }
  [[nodiscard]] std::span<const double> drive_effort_of(int i) const override { return at(i).drive_effort(); }
  void write_state(int i, std::span<const double> q, std::span<const double> v) override {
    struck_at(i).set_state(q, v);
  }
  [[nodiscard]] const Pose& root_pose_of(int i) const override { return at(i).root_pose(); }
  void write_root_pose(int i, const Pose& X_WR) override { struck_at(i).set_root_pose(X_WR); }
  void start_drive(int i, int joint, DriveMode mode) override { struck_at(i).set_drive(joint, mode); }
  [[nodiscard]] DriveState drive_of(int i, int joint) const override { return at(i).drive_state(joint); }
  void write_target(int i, int joint, double target) override { struck_at(i).set_target(joint, target); }
  void write_servo(int i, int joint, const ServoParameters& servo) override {
    struck_at(i).set_servo(joint, servo);
  }
  void write_reference(int i, int joint, double reference) override {
    struck_at(i).set_drive_reference(joint, reference);
  }
  void write_joint_effort(int i, int joint, double effort) override {
    struck_at(i).apply_joint_effort(joint, effort);
  }
  void write_wrench(int i, int link, const Eigen::Vector3d& p_LoP_L, const Eigen::Vector3d& force_W,
                    const Eigen::Vector3d& torque_W) override {
    struck_at(i).apply_wrench(link, p_LoP_L, force_W, torque_W);
  }
  [[nodiscard]] Pose pose_of(int i, int link) const override { return at(i).link_pose(link); }
  [[nodiscard]] FrameVelocity velocity_of(int i, int link) const override {
    return at(i).link_velocity(link);
  }

  std::unique_ptr<Engine> inner_;
};

class FaultyWorld final : public CompiledWorld {
 public:
  explicit FaultyWorld(std::shared_ptr<const CompiledWorld> inner)
      : CompiledWorld(inner->settings(), inner->instances()),
        inner_(std::move(inner)),
        capabilities_(inner_->capabilities()) {
    excluded_ = inner_->excluded_pairs();
    capabilities_.name = "faulty";
  }
  [[nodiscard]] const EngineCapabilities& capabilities() const override { return capabilities_; }
  [[nodiscard]] std::unique_ptr<Engine> make_engine() const override {
    call();
    return std::make_unique<FaultyEngine>(shared_from_this(), inner_->make_engine());
  }
  [[nodiscard]] std::shared_ptr<const CompiledWorld> with(std::vector<ModelInstance> instances,
                                                          Diagnostics& diagnostics) const override {
    call();
    ++compiled_here;
    return std::make_shared<const FaultyWorld>(inner_->with(std::move(instances), diagnostics));
  }
  [[nodiscard]] const std::shared_ptr<const CompiledWorld>& inner() const { return inner_; }

 private:
  std::shared_ptr<const CompiledWorld> inner_;
  EngineCapabilities capabilities_;
};

void FaultyEngine::become(std::shared_ptr<const CompiledWorld> world, std::span<const int> /*kept*/) {
  call();
  inner_->continue_with(static_cast<const FaultyWorld&>(*world).inner());
  world_ = std::move(world);
}

std::shared_ptr<const CompiledWorld> compile(WorldSettings settings, std::vector<ModelInstance> instances,
                                             Diagnostics& diagnostics) {
  call();
  while (only_thread.load() != std::thread::id() && only_thread.load() != std::this_thread::get_id())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ++compiled_here;
  return std::make_shared<const FaultyWorld>(
      engine_module(kDefaultEngine).compile(std::move(settings), std::move(instances), diagnostics));
}

}  // namespace

std::uint64_t compilations_here() {
  return compiled_here;
}

void hang_compilations(bool hang) {
  only_thread = hang ? std::this_thread::get_id() : std::thread::id();
}

void register_faulty_engine() {
  EngineModule module{engine_module(kDefaultEngine).capabilities, &compile};
  module.capabilities.name = "faulty";
  register_engine(std::move(module));
}

}  // namespace doppel::test
