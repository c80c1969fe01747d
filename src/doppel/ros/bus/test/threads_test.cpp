// The loop's guarantees while edges run on their own threads: nothing is lost, torn or allocated.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using sensor_msgs::msg::JointState;
using std::chrono::milliseconds;
using std_msgs::msg::Int32;
using std_srvs::srv::SetBool;

JointState joint_state() {
  JointState state;
  state.header.frame_id = "world";
  for (int i = 0; i < 12; ++i) state.name.push_back("a joint with a long name " + std::to_string(i));
  state.position.assign(12, 1.0);
  state.velocity.assign(12, 2.0);
  state.effort.assign(12, 3.0);
  return state;
}

TEST(Allocation, PublishingNeverAllocates) {
  Bus bus;
  Node node(bus, "/n");
  const auto unheard = node.advertise<JointState>("unheard"), listened = node.advertise<JointState>("heard");
  const auto latched = node.advertise<JointState>("latched", {.depth = 1, .latched = true});
  double sum = 0;
  node.subscribe<JointState>("heard", [&sum](const JointState& m) { sum += m.position[0]; });
  const auto one = bus.attach("one"), two = bus.attach("two");
  for (const TopicInfo& topic : bus.topics()) {
    if (topic.name == "/unheard") continue;
    one->subscribe(topic.id);
    two->subscribe(topic.id);
  }
  bus.spin();
  const JointState state = joint_state();
  latched.publish(state, {});  // allocates once
  const auto publish = [&] {
    for (int i = 0; i < 100; ++i) {
      unheard.publish(state, Time(milliseconds(i)));
      listened.publish(state, Time(milliseconds(i)));
      latched.publish(state, Time(milliseconds(i)));
      bus.spin();
    }
  };
  EXPECT_EQ(test::heap_touches_of(publish), 0U);
  EXPECT_EQ(sum, 100.0);
  Edge::Incoming incoming;
  int count = 0;
  while (two->next(incoming)) ++count;
  EXPECT_EQ(count, 201);
}

TEST(BusThreads, EdgesReceiveInOrderWhilePublishing) {
  constexpr int kEdges = 4, kMessages = 5000, kTalks = 500;
  Bus bus;
  Node node(bus, "/n");
  const auto publisher = node.advertise<Int32>("down");
  std::vector<int> last_heard(kEdges, -1);
  bool in_order = true;
  int listened = 0;
  node.subscribe<Int32>("up", [&](const Int32& m) {
    int& last = last_heard[static_cast<std::size_t>(m.data / kTalks)];
    in_order = in_order && m.data % kTalks == last + 1;
    last = m.data % kTalks;
    ++listened;
  });
  node.serve<SetBool>("~/set", [](const auto& request, const auto& respond) {
    respond({request.data, "yes"});
  });
  const TopicId id = bus.topics().at(0).id;
  std::atomic<int> ready{0}, done{0};
  std::atomic<int> answers{0}, received{0}, out_of_order{0};

  const auto run_edge = [&](int number) {
    const auto edge = bus.attach("edge" + std::to_string(number));
    edge->subscribe(id);
    edge->call("/n/set", to_cdr(SetBool::Request{}), [&](const Status&, const Bytes&) { ++ready; });
    Edge::Incoming incoming;
    int expected = 0, talked = 0;
    while (expected < kMessages) {
      if (!edge->next(incoming)) {
        edge->wait(milliseconds(1000));
        continue;
      }
      Int32 message;
      if (!from_cdr(incoming.cdr, message) || message.data != expected) ++out_of_order;
      ++expected;
      ++received;
      if (talked < kTalks) {
        if (!edge->publish("/cli", "/up", "std_msgs/msg/Int32", to_cdr(Int32{number * kTalks + talked++})))
          ++out_of_order;
        edge->call("/n/set", to_cdr(SetBool::Request{true}),
                   [&](const Status& s, const Bytes&) { answers += s.ok(); });
      }
    }
    while (answers < kEdges * kTalks) std::this_thread::yield();
    ++done;
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < kEdges; ++i) threads.emplace_back(run_edge, i);
  while (ready < kEdges) bus.spin();
  for (int i = 0; i < kMessages; ++i) {
    publisher.publish({i}, {});
    bus.spin();
  }
  while (done < kEdges) bus.spin();
  for (std::thread& thread : threads) thread.join();
  bus.spin();
  EXPECT_EQ(received, kEdges * kMessages);
  EXPECT_EQ(out_of_order, 0);
  EXPECT_TRUE(in_order);
  EXPECT_EQ(listened, kEdges * kTalks);
  EXPECT_TRUE(bus.topics().at(0).subscribers.empty()) << "expected removed edges to be forgotten";
}

TEST(BusThreads, EdgesAndNodesCanBeCreatedAndDestroyedUnderLoad) {
  Bus bus;
  std::atomic<bool> stop{false};
  std::atomic<int> rounds{0};
  const auto come_and_go = [&] {
    while (!stop) {
      auto state = std::make_unique<std::atomic<int>>(0);
      const auto edge = bus.attach("edge", {.ring_bytes = 4096});
      for (const TopicInfo& topic : bus.topics()) edge->subscribe(topic.id);
      for (const ServiceInfo& service : bus.services()) {
        // Accesses memory that is freed after this round: the sanitizers would report a reply that arrives
        // after its edge is gone.
        edge->call(service.name, to_cdr(SetBool::Request{}),
                   [&touched = *state](const Status&, const Bytes&) { ++touched; });
      }
      edge->get_parameters([&touched = *state](const auto&) { ++touched; });
      Edge::Incoming incoming;
      for (int i = 0; i < 20; ++i) {
        if (!edge->next(incoming)) edge->wait(milliseconds(1));
      }
      ++rounds;
    }
  };
  std::thread first(come_and_go), second(come_and_go);
  std::vector<Responder<SetBool::Response>> open;
  for (int round = 0; rounds < 60; ++round) {
    Node node(bus, "/n");
    node.parameters().declare("p", 1.0);
    const auto publisher = node.advertise<JointState>("x");
    node.advertise<Int32>("latched", {.depth = 1, .latched = true}).publish({round}, {});
    node.serve<SetBool>("~/set", [&open](const auto&, const auto& respond) { open.push_back(respond); });
    for (int i = 0; i < 50; ++i) {
      publisher.publish(joint_state(), {});
      bus.spin();
    }
    for (const auto& respond : open) {
      if (round % 2 == 0) respond({});
    }
    open.clear();
  }
  stop = true;
  first.join();
  second.join();
  bus.spin();
  EXPECT_TRUE(bus.topics().empty());
}

TEST(BusThreads, WaitEndsOnMessageWakeOrTimeout) {
  Bus bus;
  Node node(bus, "/n");
  const auto publisher = node.advertise<Int32>("x");
  const auto edge = bus.attach("edge");
  edge->subscribe(bus.topics().at(0).id);
  bus.spin();
  edge->wait(milliseconds(1));
  std::thread waker([&] { edge->wake(); });
  edge->wait(milliseconds(60000));
  waker.join();
  publisher.publish({1}, {});
  edge->wait(milliseconds(60000));
  Edge::Incoming incoming;
  EXPECT_TRUE(edge->next(incoming));
}

}  // namespace
}  // namespace doppel
