#pragma once
// A component that is read and written by a separate thread (<ros2_control is_async="true">): the loop takes
// the newest states, leaves the newest commands, and never waits for the device. Nor does the emergency stop
// wait for a cycle of a slow bus: the thread stops the device at its next turn, before it writes anything.

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/latest_copy.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API AsyncHardware : public HardwareComponent {
 public:
  // `device` is read and written at `rate` Hz; its life cycle runs on the caller's thread, between two of its
  // reads and writes.
  AsyncHardware(std::unique_ptr<HardwareComponent> device, double rate);
  ~AsyncHardware() override;

  Status on_init(const HardwareInfo& info) override;
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override;
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override;
  Status on_configure() override;
  Status on_activate() override;
  Status on_deactivate() override;
  Status on_cleanup() override;
  Status on_shutdown() override;
  Status on_error() override;
  Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  [[nodiscard]] PassiveJoint when_unclaimed() const override { return device_->when_unclaimed(); }
  [[nodiscard]] PassiveJoint when_failed() const override { return device_->when_failed(); }
  void on_stop() override;
  void on_stop_reset() override;
  HardwareReturn read(Time now, Duration period, std::span<double> states) override;
  HardwareReturn write(Time now, Duration period, std::span<const double> commands) override;
  void on_stall() noexcept override { device_->on_stall(); }
  Status relax() override;
  Status release_joint(const JointRelease& release) override;
  Status confirm_pose(std::span<const std::pair<std::string, double>> positions) override;
  // Without a lock: a device has these three ready for another thread than that of its bus.
  void attend() override { device_->attend(); }
  [[nodiscard]] bool report(DeviceReport& out) override { return device_->report(out); }
  [[nodiscard]] std::string awaits() const override { return device_->awaits(); }
  [[nodiscard]] std::string fault() const override;

 private:
  enum class Work { none, read, read_and_write };
  // Holds mutex_, after what was left for the next turn was done.
  [[nodiscard]] std::unique_lock<std::mutex> lock_device();
  // Acts at once, or on the thread as soon as it has ended its present read or write.
  void act_soon(std::function<void()> action);
  void act_now();  // does what was left; mutex_ is held
  [[nodiscard]] bool has_action() const;
  void set_work(Work work);  // mutex_ is held
  // Starts to read after a change of state: no command from before it is written, and no state is older.
  void begin(Work work);                                                                   // mutex_ is held
  void switch_now(std::span<const std::string> start, std::span<const std::string> stop);  // mutex_ is held
  void run();
  HardwareReturn exchange();     // mutex_ is held
  HardwareReturn read_states();  // mutex_ is held

  const std::unique_ptr<HardwareComponent> device_;
  const Duration period_;
  std::vector<std::string> command_names_;  // full names
  std::vector<double> initial_commands_;
  std::unique_ptr<LatestCopy> states_, commands_;
  std::atomic<HardwareReturn> answer_{HardwareReturn::ok};
  std::atomic<std::int64_t> now_{0};  // ns, the loop's time

  mutable std::mutex mutex_;  // held by the thread that calls the device
  std::condition_variable changed_;
  Work work_ = Work::none;
  bool ends_ = false;
  std::string fault_;
  mutable std::mutex actions_mutex_;
  std::vector<std::function<void()>> actions_;  // of the next turn, in their order
  std::thread thread_;
};

}  // namespace doppel
