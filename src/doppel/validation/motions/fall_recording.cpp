#include "doppel/validation/motions/detail/fall_recording.h"

#include "doppel/base/core/log.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/twin/loop/state_publisher.h"

namespace doppel {
namespace {

constexpr double kPeriod = 0.01;  // s between states

}  // namespace

struct FallRecording::Impl {
  Engine& engine;
  Instance robot;
  Log log = {};
  Bus bus = Bus();
  Node node{bus, "/doppel_validate"};
  Publisher<sensor_msgs::msg::JointState> joints =
      node.advertise<sensor_msgs::msg::JointState>("/joint_states");
  Publisher<std_msgs::msg::Float64> energy = node.advertise<std_msgs::msg::Float64>("/mechanical_energy");
  StatePublisher state{bus, *robot.made_of().description, robot.made_of().model, {}};
  sensor_msgs::msg::JointState message = {};
  MotionRecording recording{bus, engine.world(), log};
  Time next{};

  explicit Impl(Engine& falls) : engine(falls), robot(falls.instance(0)) {
    for (const ModelJoint& joint : robot.model().joints) {
      if (joint.scalar()) message.name.push_back(joint.name);
    }
    next = engine.time();
    state.publish_latched(engine.time());
    take();
  }

  void publish() {
    const Time now = engine.time();
    const Eigen::Map<const Eigen::VectorXd> q(robot.q().data(), static_cast<Eigen::Index>(robot.q().size()));
    state.publish_transforms(now, q);
    message.header.stamp = to_time_msg(now);
    message.position.clear();
    message.velocity.clear();
    for (const ModelJoint& joint : robot.model().joints) {
      if (!joint.scalar()) continue;
      message.position.push_back(robot.q()[static_cast<std::size_t>(joint.q)]);
      message.velocity.push_back(robot.v()[static_cast<std::size_t>(joint.v)]);
    }
    joints.publish(message, now);
    energy.publish({engine.kinetic_energy() + engine.potential_energy()}, now);
  }

  void take() {
    if (engine.time() < next) return;
    next += from_seconds(kPeriod);
    bus.set_now(engine.time());
    bus.spin();
    publish();
    recording.take();
  }
};

FallRecording::FallRecording(Engine& engine) : impl_(std::make_unique<Impl>(engine)) {}
FallRecording::~FallRecording() = default;

void FallRecording::take() {
  impl_->take();
}

RecordedMotion FallRecording::finish() {
  return impl_->recording.finish();
}

}  // namespace doppel
