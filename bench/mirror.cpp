// Alarms of the mirror: an arm with emulated servos and a simulated twin get the same commands in simulated
// time, and their residuals go through the algorithm that /doppel/mirror uses. Prints the time until a stall,
// a payload of 200 g and a horn that slips by 5 degrees are found, and false alarms of quiet motion. The
// numbers are those of emulated servos: a real arm has other noise.
//
//   bench_mirror [--seeds 50] [--first 1] [--quiet 600] [--losses] [--loads] [--no-sigma]
//
// --first: the first of the seeds; the detector was made with those to 25. --quiet: simulated seconds.
// --no-sigma: as joints that were not identified.
// --losses: in the quiet motion one answer of a hundred is lost, and one of a thousand damaged.
// --loads: every 20 s the hand carries another load to 200 g, which the twin knows but for 10 g.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "doppel/control/residuals/joint_residual.h"
#include "doppel/twin/assembly/twin.h"

namespace {

using namespace doppel;

constexpr const char* kArm = R"(<robot name="desk_arm"><link name="world"/>
<link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0"
 iyz="0"/></inertial></link>
<link name="upper"><inertial><origin xyz="0.06 0 0"/><mass value="0.15"/><inertia ixx="1e-4" iyy="3e-4"
 izz="3e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.06 0 0"/><mass value="0.12"/><inertia ixx="1e-4" iyy="3e-4"
 izz="3e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 0.6"/></joint>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 -1 0"/>
<limit lower="-1.9" upper="1.9" effort="1.9" velocity="5"/><dynamics damping="0.05" friction="0.02"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.12 0 0"/>
<axis xyz="0 -1 0"/>
<limit lower="-1.9" upper="1.9" effort="1.9" velocity="5"/><dynamics damping="0.05" friction="0.02"/></joint>
<ros2_control name="Arm" type="system"><hardware><plugin>doppel/FeetechSts</plugin><param
 name="gentle">never</param></hardware>
<joint name="shoulder"><param name="id">1</param><param name="offset_deg">0</param><command_interface
 name="position"/><state_interface name="position"/><state_interface name="velocity"/></joint>
<joint name="elbow"><param name="id">2</param><param name="offset_deg">0</param><command_interface
 name="position"/><state_interface name="position"/><state_interface name="velocity"/></joint>
</ros2_control></robot>)";

constexpr std::array<const char*, 2> kJoints{"shoulder", "elbow"};
constexpr double kEffort = 1.9;    // N m, of both joints
constexpr double kGravity = 9.81;  // m/s^2
constexpr double kWeight = 1.962;  // N, of 200 g
constexpr double kReach = 0.12;    // m, from the elbow to the hand
constexpr double kLearning = 14;   // s until the delay is known
constexpr double kWatching = 3;    // s after a fault
constexpr double kCarried = 20;    // s with a load
constexpr int kLookSamples = 5;    // that a load is kept, as in /doppel/mirror

struct Finding {
  double after = -1;  // s; negative: not found
  ResidualCause cause = ResidualCause::none;
};

class Pair {
 public:
  // faults: the content of a faults file, "" without.
  Pair(const std::filesystem::path& folder, const std::string& faults, double sigma, std::uint64_t seed)
      : random_(seed) {
    std::ofstream(folder / "arm.urdf") << kArm;
    std::ofstream(folder / "faults.yaml") << "faults: [" << faults << "]\n";
    Scenario scenario;
    scenario.robots = {{.target = (folder / "arm.urdf").string()}};
    twin_ = std::make_unique<Twin>(scenario, quiet_, diagnostics_);
    scenario.hardware = HardwareUse::emulated;
    scenario.emulation.faults = folder / "faults.yaml";
    scenario.emulation.seed = seed;
    arm_ = std::make_unique<Twin>(scenario, quiet_, diagnostics_);
    for (Twin* one : {arm_.get(), twin_.get()}) edges_.push_back(one->bus().attach("bench"));
    residuals_.assign(kJoints.size(), JointResidual({.sigma = sigma}));
  }

  // Until `end` of simulated time, with a new goal about once a second, and with loads.
  void run(double end, bool loaded = false) {
    while (now() < end) {
      if (loaded && now() >= next_load_) change_load();
      if (now() >= next_goal_) send_goal();
      for (Twin* one : {arm_.get(), twin_.get()}) {
        one->between_steps();
        one->step();
      }
      if (++steps_ % 10 == 0) sample();
    }
  }
  [[nodiscard]] double now() const { return to_seconds(arm_->now()); }
  void add_weight() { load(*arm_, kWeight); }
  [[nodiscard]] std::uint64_t alarms() const {
    std::uint64_t out = 0;
    for (const JointResidual& one : residuals_) out += one.alarms();
    return out;
  }
  [[nodiscard]] const std::vector<JointResidual>& residuals() const { return residuals_; }
  // The first alarm since; its cause as it is at the end.
  [[nodiscard]] Finding finding(double since) const {
    if (alarm_at_ < 0) return {};
    return {alarm_at_ - since,
            residuals_[alarmed_].alarm() != ResidualCause::none ? residuals_[alarmed_].alarm() : last_cause_};
  }

 private:
  static void load(Twin& twin, double weight) {
    Instance robot = twin.robot().instance();
    robot.apply_wrench(robot.model().find_link("fore"), {kReach, 0, 0}, {0, 0, -weight}, {0, 0, 0});
  }
  void change_load() {
    std::uniform_real_distribution described(0.0, 0.2), unknown(-0.01, 0.01);  // kg
    const double mass = described(random_);
    load(*twin_, mass * kGravity);
    load(*arm_, (mass + unknown(random_)) * kGravity);
    next_load_ = now() + kCarried;
  }
  void send_goal() {
    std::uniform_real_distribution position(-1.2, 1.2), time(0.8, 2.0);
    const double seconds = time(random_);
    const std::string yaml = fmt::format(
        "{{joint_names: [shoulder, elbow], points: [{{positions: [{}, {}], time_from_start: {{sec: {}, "
        "nanosec: {}}}}}]}}",
        position(random_), position(random_), static_cast<int>(seconds),
        static_cast<int>(1e9 * (seconds - std::floor(seconds))));
    const TypeSupport* type = find_type("trajectory_msgs/msg/JointTrajectory");
    Bytes cdr;
    if (!type->yaml_to_cdr(yaml, cdr)) throw std::runtime_error("trajectory");
    for (const auto& edge : edges_)
      if (!edge->publish("/bench", "/joint_trajectory_controller/joint_trajectory", type->name, cdr))
        throw std::runtime_error("publish");
    next_goal_ = now() + seconds + 0.3;
  }
  void sample() {
    const ControllerManager& manager = arm_->robot().controller_manager();
    if (samples_++ % kLookSamples == 0) static_cast<void>(manager.report(0, report_));
    const Instance twin = twin_->robot().instance();
    for (std::size_t i = 0; i < kJoints.size(); ++i) {
      const int joint = twin.model().find_joint(kJoints[i]);
      residuals_[i].add({manager.state(std::string(kJoints[i]) + "/position"), twin.q()[i],
                         report_.joints[i].load,
                         twin.drive_effort()[static_cast<std::size_t>(joint)] / kEffort, false});
      if (residuals_[i].alarm() == ResidualCause::none) continue;
      if (alarm_at_ < 0) {
        alarm_at_ = now();
        alarmed_ = i;
      }
      if (alarmed_ == i) last_cause_ = residuals_[i].alarm();
    }
  }

  Log quiet_;
  Diagnostics diagnostics_;
  std::mt19937_64 random_;
  std::unique_ptr<Twin> arm_, twin_;
  std::vector<std::unique_ptr<Edge>> edges_;
  std::vector<JointResidual> residuals_;
  DeviceReport report_;
  double next_goal_ = 2.5, next_load_ = 2.5, alarm_at_ = -1;
  std::uint64_t steps_ = 0, samples_ = 0;
  std::size_t alarmed_ = 0;
  ResidualCause last_cause_ = ResidualCause::none;
};

struct Case {
  const char* name;
  const char* fault;  // of the faults file; "": a weight
  ResidualCause cause;
};

void measure(const Case& one, const std::filesystem::path& folder, double sigma, int first, int seeds) {
  std::vector<double> times;
  int early = 0, missed = 0, right = 0;
  std::map<std::string, int> causes;
  for (int seed = first; seed < first + seeds; ++seed) {
    const double begin = kLearning + 0.037 * (seed % 60);
    const bool weight = *one.fault == '\0';
    const std::string fault = weight ? "" : fmt::format("{{{}, begin: {} s}}", one.fault, begin);
    Pair pair(folder, fault, sigma, static_cast<std::uint64_t>(seed));
    pair.run(begin);
    if (weight) pair.add_weight();
    pair.run(begin + kWatching);
    const Finding found = pair.finding(begin);
    if (found.cause == ResidualCause::none) {
      ++missed;
    } else if (found.after < 0) {
      ++early;
    } else {
      times.push_back(found.after);
      ++causes[std::string(to_string(found.cause))];
      if (found.cause == one.cause) ++right;
    }
  }
  std::ranges::sort(times);
  const auto share = [&](double p) {
    return times.empty() ? NAN : times[static_cast<std::size_t>(p * static_cast<double>(times.size() - 1))];
  };
  std::string named;
  for (const auto& [cause, count] : causes) named += fmt::format(" {} {}", count, cause);
  fmt::print(
      "{:<16} found {:>3} of {}, median {:.2f} s, p90 {:.2f} s, latest {:.2f} s; missed {}, before the fault "
      "{}; cause right {} of {} ({} )\n",
      one.name, times.size(), seeds, share(0.5), share(0.9), share(1), missed, early, right, times.size(),
      named);
}

}  // namespace

int main(int argc, char** argv) {
  int seeds = 50, first = 1;
  double quiet = 600;
  bool uses_sigma = true, loaded = false, lossy = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--seeds") == 0 && i + 1 < argc) seeds = std::stoi(argv[++i]);
    if (std::strcmp(argv[i], "--first") == 0 && i + 1 < argc) first = std::stoi(argv[++i]);
    if (std::strcmp(argv[i], "--quiet") == 0 && i + 1 < argc) quiet = std::stod(argv[++i]);
    if (std::strcmp(argv[i], "--no-sigma") == 0) uses_sigma = false;
    if (std::strcmp(argv[i], "--loads") == 0) loaded = true;
    if (std::strcmp(argv[i], "--losses") == 0) lossy = true;
  }
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("mirror_{}", getpid());
  std::filesystem::create_directories(folder);
  double sigma = 0;
  {
    Pair calm(folder, "", 0, static_cast<std::uint64_t>(990 + first));
    calm.run(kLearning + 30);
    for (const JointResidual& one : calm.residuals()) {
      sigma = std::max(sigma, one.rms());
      fmt::print("quiet joint: delay {:.1f} ms, rms {:.5f} rad, learned sigma {:.5f} rad\n",
                 1e3 * one.delay(), one.rms(), one.sigma());
    }
  }
  if (!uses_sigma) sigma = 0;
  fmt::print("{}, emulated STS servos, {} seeds from {}\n",
             uses_sigma ? fmt::format("sigma at least {:.5f} rad", sigma) : std::string("sigma not known"),
             seeds, first);
  Pair calm(folder, lossy ? "{fault: drop, share: 1 %}, {fault: corrupt, share: 0.1 %}" : "", sigma,
            static_cast<std::uint64_t>(991 + first));
  calm.run(quiet, loaded);
  fmt::print("quiet{}{}: {} alarms in {:.2f} simulated hours\n", loaded ? ", loads" : "",
             lossy ? ", losses" : "", calm.alarms(), quiet / 3600);
  if (seeds > 0) {
    measure({"stall", "fault: stuck, servo: 2", ResidualCause::stall}, folder, sigma, first, seeds);
    measure({"payload 200 g", "", ResidualCause::payload}, folder, sigma, first, seeds);
    measure({"slip 5 deg", "fault: slip, servo: 2, amount: 5 deg", ResidualCause::slipped_horn}, folder,
            sigma, first, seeds);
  }
  std::filesystem::remove_all(folder);
  return 0;
}
