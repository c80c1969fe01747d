#include "doppel/ros/network/context.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "doppel/ros/messages/printable.h"

namespace doppel::ros2 {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kSignalCheck = 50ms;  // a signal's handler cannot wake a waiting thread
constexpr auto kForever = 24h * 365 * 100;

std::atomic<bool> signalled = false;

std::vector<std::string> words_of(int argc, const char* const* argv) {
  return argc > 1 ? std::vector<std::string>(argv + 1, argv + argc) : std::vector<std::string>();
}

ContextOptions read_options(std::vector<std::string>& words) {
  ContextOptions options;
  options.arguments = take_ros_arguments(words, NameRules(true));
  Diagnostics diagnostics;
  options.network = from_environment([](const char* name) { return std::getenv(name); }, diagnostics);
  if (const auto distro = distro_from_environment(std::getenv, diagnostics)) set_ros_distro(*distro);
  for (const Diagnostic& diagnostic : diagnostics.all()) fmt::print(stderr, "{}\n", diagnostic.str());
  return options;
}

// Sets the flag as long as this object exists.
class SpinGuard {
 public:
  explicit SpinGuard(bool& turns) : turns_(turns) { turns_ = true; }
  ~SpinGuard() { turns_ = false; }
  SpinGuard(const SpinGuard&) = delete;
  SpinGuard& operator=(const SpinGuard&) = delete;

 private:
  bool& turns_;
};

std::string_view severity_text(Severity severity) {
  return severity == Severity::note ? "INFO" : severity == Severity::warning ? "WARN" : "ERROR";
}

}  // namespace

// SIGINT and SIGTERM end the program's spinning as long as this object exists. Outside of the anonymous
// namespace, because Context::Impl, which contains it, has external linkage.
class SignalHandlers {
 public:
  SignalHandlers() {
    struct sigaction action {};
    action.sa_handler = [](int) { signalled = true; };
    sigaction(SIGINT, &action, &interrupt_);
    sigaction(SIGTERM, &action, &terminate_);
  }
  ~SignalHandlers() {
    sigaction(SIGINT, &interrupt_, nullptr);
    sigaction(SIGTERM, &terminate_, nullptr);
  }
  SignalHandlers(const SignalHandlers&) = delete;
  SignalHandlers& operator=(const SignalHandlers&) = delete;

 private:
  struct sigaction interrupt_ {
  }, terminate_{};
};

Timer::Timer(std::chrono::nanoseconds period, bool by_wall, Time ros_now, std::function<void()> callback)
    : period_(std::max(period, 1ns)), by_wall_(by_wall), callback_(std::move(callback)) {
  reset(ros_now);
}

void Timer::reset(Time ros_now) {
  canceled_ = false;
  next_wall_ = Clock::now() + period_;
  next_ros_ = ros_now + period_;
}

bool Timer::take_due(Time ros_now) {
  // Simulated time may begin again, or first be reported.
  if (!by_wall_ && next_ros_ - ros_now > period_) next_ros_ = ros_now + period_;
  const auto late = -left(ros_now);
  if (canceled_ || late < 0ns) return false;
  const auto ahead = (late / period_ + 1) * period_;
  next_wall_ += std::chrono::duration_cast<Clock::duration>(ahead);
  next_ros_ += ahead;
  return true;
}

std::chrono::nanoseconds Timer::left(Time ros_now) const {
  if (canceled_) return kForever;
  return by_wall_ ? std::chrono::nanoseconds(next_wall_ - Clock::now()) : next_ros_ - ros_now;
}

struct Context::Impl {
  explicit Impl(ContextOptions chosen)
      : options(std::move(chosen)), bus(BusOptions{.names = options.arguments.names}) {
    forget_statistics();
    add_ros_parameters(options.arguments, parameters);
    if (options.log_to_stderr) {
      lines.add_sink([](const LogLine& line) {
        const auto now = nanoseconds_of(system_time());
        fmt::print(stderr, "[{}] [{}.{:09}] [{}]: {}\n", severity_text(line.severity), now / 1'000'000'000,
                   now % 1'000'000'000, line.origin, printable(line.text));
      });
    }
    if (options.catch_signals) {
      signalled = false;
      signals.emplace();
    }
    BridgeOptions joined;
    joined.network = options.network;
    if (options.arguments.enclave) joined.network.enclave = *options.arguments.enclave;
    bridge = std::make_unique<Bridge>(bus, joined, lines);
  }

  [[nodiscard]] Time ros_now() const { return sim_time ? *sim_time : system_time(); }

  // Handles received messages and timers that are due.
  void turn() {
    if (spins) throw std::logic_error("a callback cannot spin its context; use async_send_request()");
    const SpinGuard turning(spins);
    bus.set_now(ros_now());
    bus.spin();
    const auto all = timers;  // callbacks may make timers
    for (const auto& weak : all) {
      const auto timer = weak.lock();
      if (timer != nullptr && timer->take_due(ros_now())) timer->call();
      if (failure) break;
    }
    std::erase_if(timers, [](const auto& weak) { return weak.expired(); });
    if (failure) std::rethrow_exception(std::exchange(failure, nullptr));
  }

  [[nodiscard]] std::chrono::nanoseconds longest_wait() const {
    std::chrono::nanoseconds longest = kSignalCheck;
    for (const auto& weak : timers) {
      if (const auto timer = weak.lock()) longest = std::min(longest, timer->left(ros_now()));
    }
    return std::max(longest, 0ns);
  }

  ContextOptions options;
  std::vector<std::string> words;
  ParameterFile parameters;
  Log lines;
  std::optional<SignalHandlers> signals;
  Bus bus;
  std::unique_ptr<Bridge> bridge;
  std::vector<std::weak_ptr<Timer>> timers;
  std::optional<Time> sim_time;
  std::exception_ptr failure;
  bool spins = false;
  std::atomic<bool> is_shut_down{false};
};

Context::Context(ContextOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}

Context::Context(int argc, const char* const* argv) {
  std::vector<std::string> words = words_of(argc, argv);
  ContextOptions options = read_options(words);
  impl_ = std::make_unique<Impl>(std::move(options));
  impl_->words = std::move(words);
}

Context::~Context() = default;

bool Context::ok() const {
  return !impl_->is_shut_down && !(impl_->signals && signalled);
}

void Context::shutdown() {
  impl_->is_shut_down = true;
  impl_->bus.post([] {});  // wakes the waiting thread
}

const std::vector<std::string>& Context::arguments() const {
  return impl_->words;
}

bool Context::spin_until(const std::function<bool()>& condition, std::chrono::nanoseconds at_most) {
  const auto begin = Clock::now();
  while (true) {
    impl_->turn();
    if (condition()) return true;
    const auto left = at_most - (Clock::now() - begin);
    if (!ok() || left <= 0ns) return false;
    impl_->bus.wait(std::min<std::chrono::nanoseconds>(left, impl_->longest_wait()));
  }
}

void Context::spin() {
  while (ok()) spin_for(kForever);
}
void Context::spin_some() {
  impl_->turn();
}
void Context::spin_for(std::chrono::nanoseconds time) {
  spin_until([] { return false; }, time);
}

std::shared_ptr<const GraphSnapshot> Context::graph() const {
  return impl_->bridge->graph();
}
NetworkStatus Context::network() const {
  return impl_->bridge->status();
}

Bus& Context::bus() {
  return impl_->bus;
}
Bridge& Context::bridge() {
  return *impl_->bridge;
}
bool Context::is_logged(Severity severity) const {
  return severity >= impl_->options.arguments.log_level.value_or(Severity::note);
}
void Context::log(Severity severity, const std::string& node, const std::string& text) const {
  impl_->lines.line(severity, node, text);
}

ParameterOverrides Context::overrides_for(const doppel::Node& node) const {
  return impl_->parameters.overrides_for(node.name(), node.given_name());
}

void Context::keep(std::exception_ptr failure) {
  if (!impl_->failure) impl_->failure = std::move(failure);
}
void Context::add(const std::shared_ptr<Timer>& timer) {
  impl_->timers.push_back(timer);
}
void Context::set_sim_time(Time now) {
  impl_->sim_time = now;
  impl_->bus.set_now(now);
}
std::optional<Time> Context::sim_time() const {
  return impl_->sim_time;
}

}  // namespace doppel::ros2
