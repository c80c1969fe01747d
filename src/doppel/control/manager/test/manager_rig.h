#pragma once
// A controller manager with a fake robot and fake hardware, driven tick by tick; all its messages are
// recorded.

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "doppel/control/controllers/builtin.h"
#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/control/manager/controller_manager.h"
#include "doppel/control/manager/test/fake_hardware.h"
#include "doppel/control/manager/test/fake_robot.h"

namespace doppel {

// The YAML of one controller.
inline std::string controller_yaml(const std::string& name, const std::string& type,
                                   const std::string& parameters) {
  return "controller_manager: {ros__parameters: {" + name + ": {type: " + type + "}}}\n" + name +
         ": {ros__parameters: {" + parameters + "}}\n";
}

// All messages of one type on one topic.
template <class M>
struct Recorder {
  Recorder(Bus& bus, const std::string& topic) : node(bus, "/listener") {
    node.subscribe<M>(topic, [this](const M& message) { messages.push_back(message); });
  }
  Node node;
  std::vector<M> messages;
};

struct ManagerRig {
  using Names = std::vector<std::string>;

  explicit ManagerRig(const std::string& yaml, std::vector<FakeJoint> joints = {{"a"}, {"b"}},
                      FakeHardwareOptions hardware_options = {}, ControllerManagerOptions options = {})
      : model(fake_robot(joints)), registry(builtin_controllers()) {
    log.add_sink([this](const LogLine& line) { lines.push_back(line); });
    if (!yaml.empty()) file = ParameterFile::parse(yaml, "test.yaml");
    if (hardware_options.joints.empty()) {
      for (const FakeJoint& joint : joints) {
        auto& list = joint.mimics.empty() ? hardware_options.joints : hardware_options.state_only_joints;
        if (joint.type != JointType::fixed) list.push_back(joint.name);
      }
    }
    manager = std::make_unique<ControllerManager>(bus, model, registry, yaml.empty() ? nullptr : &file,
                                                  options, log, diagnostics);
    auto fake = std::make_unique<FakeHardware>(std::move(hardware_options));
    hardware = fake.get();
    EXPECT_TRUE(manager->add_hardware(std::move(fake), hardware->description(), diagnostics));
  }

  // Ticks, with actions between them.
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      bus.set_now(now);
      bus.spin();
      manager->housekeeping(now);
      manager->tick(now);
      manager->settle(now);
      now += manager->period();
    }
  }

  // Loads, configures and activates.
  void start(const Names& names) {
    bus.set_now(now);
    manager->start(names);
  }
  Status switch_to(const Names& on, const Names& off = {}) {
    return manager->switch_controllers(on, off, Strictness::strict);
  }
  // Publishes and delivers a message.
  template <class M>
  void say(const std::string& topic, const M& message) {
    if (!speaker) speaker = std::make_unique<Node>(bus, "/speaker");
    speaker->advertise<M>(topic).publish(message, now);
    bus.set_now(now);
    bus.spin();
  }
  // Calls a service through an edge, as an external client. Throws without a response.
  template <class S>
  typename S::Response call(const std::string& service, const typename S::Request& request) {
    if (!edge) edge = bus.attach("client");
    std::optional<typename S::Response> response;
    edge->call(service, to_cdr(request), [&](const Status& status, const Bytes& cdr) {
      if (!status) throw std::runtime_error(status.why());
      if (const Status read = from_cdr(cdr, response.emplace()); !read) throw std::runtime_error(read.why());
    });
    bus.set_now(now);
    bus.spin();
    if (!response) throw std::runtime_error("expected a response from " + service);
    return *response;
  }

  [[nodiscard]] std::size_t count(Severity severity, const std::string& part) const {
    std::size_t n = 0;
    for (const LogLine& line : lines) {
      if (line.severity == severity && line.text.find(part) != std::string::npos) ++n;
    }
    return n;
  }
  [[nodiscard]] std::string said() const {
    std::string all;
    for (const LogLine& line : lines) all += line.origin + ": " + line.text + "\n";
    return all;
  }
  [[nodiscard]] ControllerState state_of(const std::string& name) const {
    for (const auto& view : manager->controllers()) {
      if (view.name == name) return view.state;
    }
    throw std::logic_error("no controller " + name);
  }

  Bus bus;
  Model model;
  ControllerRegistry registry;
  HardwareRegistry hardware_types;
  Log log;
  std::vector<LogLine> lines;
  Diagnostics diagnostics;
  ParameterFile file;
  std::unique_ptr<ControllerManager> manager;
  FakeHardware* hardware = nullptr;
  Time now{};
  std::unique_ptr<Node> speaker;
  std::unique_ptr<Edge> edge;
};

// The text of what the call throws; "" if it does not throw.
template <class F>
std::string input_error_of(F&& call) {
  try {
    call();
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "";
}

}  // namespace doppel
