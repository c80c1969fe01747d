// Drivers of servos on emulated buses, in simulated time with the pacing of the real bytes: parsers, the rate
// of a cycle, lost answers, activation and stop. All numbers are those of emulated servos.
//
//   bench_bus [--runs 500] [--stops 200] [--minutes 10]
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "doppel/devices/emulation/emulated_link.h"
#include "doppel/devices/frames/dynamixel_frame.h"
#include "doppel/devices/frames/feetech_frame.h"
#include "doppel/devices/frames/servo_line.h"
#include "servo_rig.h"

namespace {

using namespace doppel;
using bench::kArmJoints;
using bench::ServoRig;

// -- parsers

// MB/s of a reader over a stream of frames, and how many it has found.
template <typename Reader>
void measure_reader(const char* name, std::span<const std::uint8_t> stream) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> rates;
  std::uint64_t frames = 0;
  for (int round = 0; round < 9; ++round) {
    Reader reader;
    const auto begin = Clock::now();
    for (std::size_t pushed = 0; pushed < stream.size();) {
      pushed += reader.push(stream.subspan(pushed, std::min<std::size_t>(512, stream.size() - pushed)));
      while (reader.next()) {
      }
    }
    rates.push_back(static_cast<double>(stream.size()) / 1e6 /
                    std::chrono::duration<double>(Clock::now() - begin).count());
    frames = reader.counts().frames;
  }
  std::ranges::sort(rates);
  fmt::print("  {:<12} {:7.0f} MB/s, {} frames in {:.1f} MB\n", name, rates[rates.size() / 2], frames,
             static_cast<double>(stream.size()) / 1e6);
}

// Answers to sync reads: 6 bytes of an STS, 10 of a Dynamixel; states of a board with six servos.
template <typename Add>
std::vector<std::uint8_t> stream_of(const Add& add) {
  constexpr std::size_t kStreamBytes = 16'000'000;
  std::vector<std::uint8_t> out;
  std::mt19937 random(1);
  while (out.size() < kStreamBytes) {
    FrameBytes frame;
    add(random, frame);
    out.insert(out.end(), frame.bytes().begin(), frame.bytes().end());
  }
  return out;
}

void measure_parsers() {
  fmt::print("parsers, 512 bytes at once, median of 9\n");
  std::array<std::uint8_t, 10> data{};
  measure_reader<FeetechReader>("feetech", stream_of([&](auto& random, FrameBytes& out) {
                                  for (auto& one : data) one = static_cast<std::uint8_t>(random());
                                  add_feetech_frame({1, 0, std::span(data).first(6)}, out);
                                }));
  measure_reader<DynamixelReader>(
      "dynamixel", stream_of([&](auto& random, FrameBytes& out) {
        for (auto& one : data) one = static_cast<std::uint8_t>(random());
        add_dynamixel_frame({1, static_cast<std::uint8_t>(DynamixelInstruction::status), data}, out);
      }));
  measure_reader<ServoLineReader>("servo line", stream_of([&](auto& random, FrameBytes& out) {
                                    std::string line =
                                        fmt::format("T {} {} 1 5000", random() % 10000, random());
                                    for (int i = 0; i < 6; ++i)
                                      line += fmt::format(" {}", 500 + random() % 2000);
                                    add_servo_line(line, out);
                                  }));
}

// -- the rate of a cycle

struct CycleCase {
  const char* model;
  int rate;   // bit/s
  int delay;  // of the register, 2 us each
  bool fast;
};

void measure_cycle(const CycleCase& one) {
  const ServoModel& model = *find_servo_model(one.model);
  std::vector<RegisterServo> servos;
  std::vector<BusServo> ids;
  for (int id = 1; id <= static_cast<int>(kArmJoints); ++id) {
    RegisterServo& servo = servos.emplace_back(model, id);
    for (const auto& [index, rate] : model.baud_rates) {
      if (rate == one.rate) servo.set(ServoRole::baud_rate, index);
    }
    servo.set(ServoRole::return_delay, one.delay);
    ids.push_back({id, &model});
  }
  BusEmulator devices(model.protocol, std::move(servos));
  EmulatedLink link(devices, "emulated", one.rate);
  ServoBus bus(link, model.protocol, one.rate);
  bus.begin_cycle(ids, one.fast);
  std::vector<ServoReading> readings(kArmJoints);
  const std::vector<ServoGoal> goals(kArmJoints, ServoGoal{0, 1});
  constexpr int kCycles = 2000;
  std::size_t fresh = 0;
  const Time begin = link.now();
  for (int i = 0; i < kCycles; ++i) {
    fresh += bus.read_all(readings);
    static_cast<void>(bus.write_goals(goals));
  }
  // The goals of the last cycle are still on the line; the rate counts their bytes as those of the others.
  fmt::print("  {:<12} {:>8} bit/s, return delay {:>3} us{}: {:6.0f} Hz, {} of {} answers\n", one.model,
             one.rate, 2 * one.delay, one.fast ? ", fast" : "      ",
             kCycles / to_seconds(link.now() - begin), fresh, kCycles * kArmJoints);
}

// -- motion

std::vector<double> random_pose(std::mt19937_64& random) {
  std::uniform_real_distribution angle(-1.7, 1.7);
  std::vector<double> out(kArmJoints);
  for (double& one : out) one = angle(random);
  return out;
}

void sine_command(ServoRig& rig, double t) {
  for (std::size_t i = 0; i < kArmJoints; ++i)
    rig.command[i] = 0.8 * std::sin((0.7 + 0.1 * static_cast<double>(i)) * t);
}

// One percent of the answers is lost; the same motion without loss runs beside it.
void measure_loss(double minutes) {
  ServoRig clean("doppel/FeetechSts"), lossy("doppel/FeetechSts");
  const std::vector<double> zero(kArmJoints);
  for (ServoRig* one : {&clean, &lossy}) {
    one->place(zero);
    bench::require(one->start());
  }
  lossy.bus().add_fault({.kind = FaultKind::drop, .share = 0.01});
  double largest = 0, fastest = 0;
  int faults = 0;
  const int cycles = static_cast<int>(minutes * 6000);
  for (int i = 0; i < cycles && faults == 0; ++i) {
    for (ServoRig* one : {&clean, &lossy}) {
      sine_command(*one, 0.01 * i);
      if (one->cycle() != HardwareReturn::ok) ++faults;
    }
    if (i < 200) continue;  // the ramp of the torque
    for (std::size_t j = 0; j < kArmJoints; ++j) {
      largest = std::max(largest, std::abs(lossy.q(j) - clean.q(j)));
      fastest = std::max(fastest, std::abs(clean.v(j)));
    }
  }
  DeviceReport report;
  static_cast<void>(lossy.driver->report(report));
  fmt::print(
      "  {:.1f} simulated minutes, {} answers lost of {}: {} faults; largest difference to the motion\n"
      "  without loss {:.5f} rad, a cycle of the fastest motion is {:.5f} rad\n",
      minutes, report.lost, report.cycles * kArmJoints, faults, largest, 0.01 * fastest);
}

void measure_activation(int runs) {
  int refused = 0, moved = 0;
  double largest = 0, largest_passing = 0;
  std::vector<double> motions;
  for (int seed = 1; seed <= runs; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    ServoRig rig(seed % 2 == 0 ? "doppel/DynamixelX" : "doppel/FeetechSts");
    const std::vector<double> pose = random_pose(random);
    rig.place(pose);
    std::uniform_real_distribution load(-0.3, 0.3), gain(0.5, 2.0);
    for (std::size_t i = 0; i < kArmJoints; ++i) {
      rig.engine->instance(0).apply_joint_effort(
          static_cast<int>(rig.model->find_joint(fmt::format("j{}", i + 1))), load(random));
      RegisterServo& servo = rig.bus().servos()[i];
      servo.set(ServoRole::position_gain,
                std::llround(gain(random) * static_cast<double>(servo.value(ServoRole::position_gain))));
      // The goal of an earlier run, far from here.
      servo.set(ServoRole::goal_position, static_cast<std::int64_t>(random() % 4096));
    }
    if (!rig.start()) {
      ++refused;
      continue;
    }
    double motion = 0, lasting = 0;
    for (int i = 0; i < 200 && rig.cycle() == HardwareReturn::ok; ++i) {
      for (std::size_t j = 0; j < kArmJoints; ++j) motion = std::max(motion, std::abs(rig.q(j) - pose[j]));
    }
    for (std::size_t j = 0; j < kArmJoints; ++j) lasting = std::max(lasting, std::abs(rig.q(j) - pose[j]));
    motions.push_back(motion);
    largest_passing = std::max(largest_passing, motion - lasting);
    if (motion > 0.01) ++moved;
    largest = std::max(largest, motion);
  }
  std::ranges::sort(motions);
  fmt::print(
      "  {} of {} poses activated ({} refused): motion median {:.4f} rad, p95 {:.4f}, largest {:.4f}; {} "
      "above 0.01\n"
      "  (the drives' sag under their loads; beyond it, passing: {:.4f} rad at most)\n",
      motions.size(), runs, refused, motions.empty() ? NAN : motions[motions.size() / 2],
      motions.empty() ? NAN : motions[motions.size() * 95 / 100], largest, moved, largest_passing);
}

// The bound of a stop at speed v: 0.05 rad + v^2 / 2a, with the deceleration that the servo reaches.
void measure_stop(int runs) {
  int late = 0, beyond = 0;
  double largest = 0, fastest = 0;
  int slowest = 0;
  for (int seed = 1; seed <= runs; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    ServoRig rig(seed % 2 == 0 ? "doppel/DynamixelX" : "doppel/FeetechSts");
    const std::vector<double> zero(kArmJoints);
    rig.place(zero);
    bench::require(rig.start());
    const double rate = std::uniform_real_distribution(1.0, 3.5)(random);
    const int end = std::uniform_int_distribution(150, 400)(random);
    for (int i = 0; i < end; ++i) {
      for (std::size_t j = 0; j < kArmJoints; ++j)
        rig.command[j] = 0.8 * std::sin(0.01 * rate * i * (1 + 0.05 * static_cast<double>(j)));
      if (rig.cycle() != HardwareReturn::ok) throw std::runtime_error("a fault without a cause");
    }
    std::array<double, kArmJoints> before{}, speed{}, goals{};
    for (std::size_t j = 0; j < kArmJoints; ++j) {
      before[j] = rig.q(j);
      speed[j] = rig.v(j);
      fastest = std::max(fastest, std::abs(speed[j]));
    }
    rig.driver->on_stop();
    int frozen = 0;
    for (int i = 1; i <= 100; ++i) {
      static_cast<void>(rig.cycle());
      for (std::size_t j = 0; j < kArmJoints; ++j) {
        if (rig.goal(j) != goals[j]) frozen = i;
        goals[j] = rig.goal(j);
      }
    }
    slowest = std::max(slowest, frozen);
    if (frozen > 2) ++late;
    for (std::size_t j = 0; j < kArmJoints; ++j) {
      constexpr double kDeceleration = 100;  // rad/s^2
      const double moved = std::abs(rig.q(j) - before[j]);
      largest = std::max(largest, moved);
      if (moved > 0.05 + speed[j] * speed[j] / (2 * kDeceleration)) {
        ++beyond;
        break;
      }
    }
  }
  fmt::print(
      "  {} stops at up to {:.2f} rad/s: goals frozen after {} cycles at most ({} runs later than 2);\n"
      "  largest motion after the stop {:.4f} rad, {} runs beyond 0.05 rad + v^2 / 2a with a = 100 rad/s^2\n",
      runs, fastest, slowest, late, largest, beyond);
}

}  // namespace

int main(int argc, char** argv) {
  int runs = 500, stops = 200;
  double minutes = 10;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--runs") == 0) runs = std::stoi(argv[i + 1]);
    if (std::strcmp(argv[i], "--stops") == 0) stops = std::stoi(argv[i + 1]);
    if (std::strcmp(argv[i], "--minutes") == 0) minutes = std::stod(argv[i + 1]);
  }
  measure_parsers();
  fmt::print("a cycle of six servos, read and write, emulated bytes at their rate\n");
  for (const CycleCase& one : {CycleCase{"STS3215", 1'000'000, 0, false},
                               {"STS3215", 1'000'000, 250, false},
                               {"XL430-W250", 57'600, 0, false},
                               {"XL430-W250", 1'000'000, 0, false},
                               {"XL430-W250", 1'000'000, 0, true},
                               {"XL430-W250", 1'000'000, 125, false},
                               {"XL430-W250", 4'000'000, 0, false},
                               {"XL430-W250", 4'000'000, 0, true}})
    measure_cycle(one);
  fmt::print("one percent of the answers is lost, emulated\n");
  measure_loss(minutes);
  fmt::print("activation, emulated: random poses, loads up to 0.3 N m, gains from 0.5 to 2\n");
  measure_activation(runs);
  fmt::print("stop, emulated\n");
  measure_stop(stops);
  return 0;
}
