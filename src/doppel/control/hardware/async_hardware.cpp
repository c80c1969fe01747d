#include "doppel/control/hardware/async_hardware.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/thrown.h"

namespace doppel {

namespace {

// An action that is left while the thread falls asleep does not wake it.
constexpr std::chrono::milliseconds kIdle{50};

}  // namespace

AsyncHardware::AsyncHardware(std::unique_ptr<HardwareComponent> device, double rate)
    : device_(std::move(device)), period_(from_seconds(1.0 / rate)) {}

AsyncHardware::~AsyncHardware() {
  {
    const auto lock = lock_device();
    ends_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Status AsyncHardware::on_init(const HardwareInfo& info) {
  Status status = device_->on_init(info);
  if (!status) return status;
  std::vector<double> initial_states;
  for (const InterfaceDescription& i : device_->state_interfaces()) initial_states.push_back(i.initial);
  for (const InterfaceDescription& i : device_->command_interfaces()) {
    command_names_.push_back(i.full_name());
    initial_commands_.push_back(i.initial);
  }
  states_ = std::make_unique<LatestCopy>(initial_states);
  commands_ = std::make_unique<LatestCopy>(initial_commands_);
  thread_ = guarded_thread([this] { run(); },
                           [this](const std::string& why) {
                             const std::lock_guard lock(mutex_);
                             fault_ = why;
                             answer_.store(HardwareReturn::error);
                           });
  return status;
}

std::vector<InterfaceDescription> AsyncHardware::state_interfaces() const {
  return device_->state_interfaces();
}
std::vector<InterfaceDescription> AsyncHardware::command_interfaces() const {
  return device_->command_interfaces();
}

std::unique_lock<std::mutex> AsyncHardware::lock_device() {
  std::unique_lock lock(mutex_);
  act_now();
  return lock;
}

void AsyncHardware::act_soon(std::function<void()> action) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (lock) {
    act_now();
    action();
    return;
  }
  {
    const std::lock_guard actions(actions_mutex_);
    actions_.push_back(std::move(action));
  }
  changed_.notify_all();
}

bool AsyncHardware::has_action() const {
  const std::lock_guard lock(actions_mutex_);
  return !actions_.empty();
}

void AsyncHardware::act_now() {
  std::vector<std::function<void()>> actions;
  {
    const std::lock_guard lock(actions_mutex_);
    actions.swap(actions_);
  }
  for (const auto& action : actions) {
    try {
      action();
    } catch (...) {
      fault_ = thrown_text();
      answer_.store(HardwareReturn::error, std::memory_order_release);
    }
  }
}

void AsyncHardware::set_work(Work work) {
  work_ = work;
  answer_.store(HardwareReturn::ok);
  changed_.notify_all();
}

void AsyncHardware::begin(Work work) {
  commands_->reset(initial_commands_);
  set_work(work);
  answer_.store(read_states(), std::memory_order_release);
}

Status AsyncHardware::on_configure() {
  const auto lock = lock_device();
  Status status = device_->on_configure();
  if (status) begin(Work::read);
  return status;
}

Status AsyncHardware::on_activate() {
  const auto lock = lock_device();
  Status status = device_->on_activate();
  if (status) begin(Work::read_and_write);
  return status;
}

Status AsyncHardware::on_deactivate() {
  const auto lock = lock_device();
  // The last commands of the loop may not be written yet, and may be a zero velocity.
  if (work_ == Work::read_and_write && answer_.load() == HardwareReturn::ok)
    static_cast<void>(device_->write(time_from_nanoseconds(now_.load()), period_, commands_->newest()));
  Status status = device_->on_deactivate();
  if (status) set_work(Work::read);
  return status;
}

Status AsyncHardware::on_cleanup() {
  const auto lock = lock_device();
  Status status = device_->on_cleanup();
  if (status) set_work(Work::none);
  return status;
}

Status AsyncHardware::relax() {
  const auto lock = lock_device();
  return device_->relax();
}

Status AsyncHardware::release_joint(const JointRelease& release) {
  const auto lock = lock_device();
  return device_->release_joint(release);
}

Status AsyncHardware::confirm_pose(std::span<const std::pair<std::string, double>> positions) {
  const auto lock = lock_device();
  return device_->confirm_pose(positions);
}

Status AsyncHardware::on_shutdown() {
  const auto lock = lock_device();
  set_work(Work::none);
  return device_->on_shutdown();
}

Status AsyncHardware::on_error() {
  const auto lock = lock_device();
  set_work(Work::none);
  return device_->on_error();
}

Status AsyncHardware::prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  const auto lock = lock_device();
  return device_->prepare_switch(start, stop);
}

void AsyncHardware::perform_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  // A stop releases commands only, which no one has to wait for.
  if (start.empty()) {
    act_soon(
        [this, released = std::vector<std::string>(stop.begin(), stop.end())] { switch_now({}, released); });
    return;
  }
  const auto lock = lock_device();
  switch_now(start, stop);
}

void AsyncHardware::switch_now(std::span<const std::string> start, std::span<const std::string> stop) {
  if (work_ == Work::read_and_write && answer_.load() == HardwareReturn::ok && !stop.empty())
    static_cast<void>(device_->write(time_from_nanoseconds(now_.load()), period_, commands_->newest()));
  device_->perform_switch(start, stop);
  if (start.empty()) return;
  // A command that is claimed anew has no value until the loop writes one; one that is handed over from one
  // controller to the next keeps its value.
  const std::span<const double> newest = commands_->newest();
  std::vector<double> row(newest.begin(), newest.end());
  for (std::size_t i = 0; i < row.size(); ++i) {
    const bool claimed = std::ranges::find(start, command_names_[i]) != start.end();
    const bool handed_over = std::ranges::find(stop, command_names_[i]) != stop.end();
    if (claimed && !handed_over) row[i] = initial_commands_[i];
  }
  commands_->reset(row);
}

void AsyncHardware::on_stop() {
  act_soon([this] {
    if (work_ == Work::read_and_write) set_work(Work::read);
    device_->on_stop();
  });
}

void AsyncHardware::on_stop_reset() {
  const auto lock = lock_device();
  device_->on_stop_reset();
  if (work_ == Work::read) begin(Work::read_and_write);
}

HardwareReturn AsyncHardware::read(Time now, Duration /*period*/, std::span<double> states) {
  now_.store(nanoseconds_of(now), std::memory_order_relaxed);
  std::ranges::copy(states_->newest(), states.begin());
  return answer_.load(std::memory_order_acquire);
}

HardwareReturn AsyncHardware::write(Time /*now*/, Duration /*period*/, std::span<const double> commands) {
  std::ranges::copy(commands, commands_->row().begin());
  commands_->leave();
  return answer_.load(std::memory_order_acquire);
}

std::string AsyncHardware::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

// Any exception of the device becomes an error.
HardwareReturn AsyncHardware::read_states() {
  try {
    const Time now = time_from_nanoseconds(now_.load(std::memory_order_relaxed));
    const HardwareReturn answer = device_->read(now, period_, states_->row());
    if (answer == HardwareReturn::ok) {
      states_->leave();
    } else {
      fault_ = device_->fault();
    }
    return answer;
  } catch (...) {
    fault_ = thrown_text();
    return HardwareReturn::error;
  }
}

HardwareReturn AsyncHardware::exchange() {
  if (const HardwareReturn answer = read_states(); answer != HardwareReturn::ok) return answer;
  act_now();
  if (work_ != Work::read_and_write || answer_.load() != HardwareReturn::ok) return answer_.load();
  try {
    const Time now = time_from_nanoseconds(now_.load(std::memory_order_relaxed));
    const HardwareReturn answer = device_->write(now, period_, commands_->newest());
    if (answer != HardwareReturn::ok) fault_ = device_->fault();
    return answer;
  } catch (...) {
    fault_ = thrown_text();
    return HardwareReturn::error;
  }
}

void AsyncHardware::run() {
  std::unique_lock lock(mutex_);
  auto due = std::chrono::steady_clock::now();
  while (!ends_) {
    act_now();
    if (work_ == Work::none || answer_.load() != HardwareReturn::ok) {
      changed_.wait_for(lock, kIdle);
      due = std::chrono::steady_clock::now();
      continue;
    }
    answer_.store(exchange(), std::memory_order_release);
    due = std::max(due + period_, std::chrono::steady_clock::now());
    changed_.wait_until(lock, due, [this] { return ends_ || has_action(); });
  }
}

}  // namespace doppel
