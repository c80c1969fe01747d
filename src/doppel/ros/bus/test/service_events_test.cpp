// Service introspection: the topics <service>/_service_event of a bus.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/stage.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/service_event.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using std_srvs::srv::SetBool;
using std_srvs::srv::Trigger;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ServiceEventsTest : public testing::Test {
 protected:
  ServiceEventsTest() : edge_(bus_.attach("edge")) {
    node_.serve<SetBool>("~/set", [](const SetBool::Request& request, const auto& respond) {
      if (request.data) respond({true, "done"});  // otherwise the call is never answered
    });
  }

  std::vector<std::string> event_topics() {
    std::vector<std::string> names;
    for (const TopicInfo& topic : bus_.topics()) {
      if (topic.name.ends_with("/_service_event") && !topic.publishers.empty()) names.push_back(topic.name);
    }
    return names;
  }
  void follow(const std::string& name) {
    for (const TopicInfo& topic : bus_.topics()) {
      if (topic.name == name) edge_->subscribe(topic.id);
    }
    bus_.spin();
  }
  void call(bool data) {
    edge_->call_from({.client = {1, 2, 3}, .sequence = 42}, "/n/set", to_cdr(SetBool::Request{data}),
                     [](const Status&, const Bytes&) {});
    bus_.spin();
  }
  std::vector<std::string> events() {
    const TypeSupport& type = *find_type("std_srvs/srv/SetBool_Event");
    std::vector<std::string> texts;
    Edge::Incoming message;
    while (edge_->next(message)) {
      const Status status = type.cdr_to_yaml(message.cdr, texts.emplace_back());
      EXPECT_TRUE(status) << status.why();
    }
    return texts;
  }

  Bus bus_;
  Node node_{bus_, "/n"};
  std::unique_ptr<Edge> edge_;
};

TEST_F(ServiceEventsTest, TopicsExistWhileEventsAreOn) {
  EXPECT_THAT(event_topics(), IsEmpty());
  bus_.set_service_events(ServiceEvents::metadata);
  EXPECT_THAT(event_topics(), ElementsAre("/n/set/_service_event"));
  Node later(bus_, "/later");
  later.serve<Trigger>("~/go", [](const auto&, const auto&) {});
  EXPECT_THAT(event_topics(), ElementsAre("/later/go/_service_event", "/n/set/_service_event"));
  bus_.set_service_events(ServiceEvents::off);
  EXPECT_THAT(event_topics(), IsEmpty());
}

TEST_F(ServiceEventsTest, TopicEndsWithNodeOfService) {
  bus_.set_service_events(ServiceEvents::contents);
  {
    Node later(bus_, "/later");
    later.serve<Trigger>("~/go", [](const auto&, const auto&) {});
  }
  EXPECT_THAT(event_topics(), ElementsAre("/n/set/_service_event"));
}

TEST_F(ServiceEventsTest, ContentsHaveCallerRequestAndResponse) {
  bus_.set_now(Time(std::chrono::milliseconds(1500)));
  bus_.set_service_events(ServiceEvents::contents);
  follow("/n/set/_service_event");
  call(true);
  const auto texts = events();
  ASSERT_EQ(texts.size(), 2U);
  for (const std::string& text : texts) {
    EXPECT_THAT(text, HasSubstr("sequence_number: 42"));
    EXPECT_THAT(text, HasSubstr("sec: 1\n    nanosec: 500000000"));
    EXPECT_THAT(text, HasSubstr("- 1\n  - 2\n  - 3\n  - 0"));
  }
  EXPECT_THAT(texts[0], HasSubstr("event_type: 1"));
  EXPECT_THAT(texts[0], HasSubstr("request:\n- data: true\nresponse: []"));
  EXPECT_THAT(texts[1], HasSubstr("event_type: 2"));
  EXPECT_THAT(texts[1], HasSubstr("request: []\nresponse:\n- success: true\n  message: done"));
}

TEST_F(ServiceEventsTest, TopicOfAnotherTypeGetsNoEvents) {
  ASSERT_TRUE(edge_->publish("/client", "/n/set/_service_event", "std_msgs/msg/String",
                             to_cdr(std_msgs::msg::String{"mine"})));
  bus_.spin();
  bus_.set_service_events(ServiceEvents::contents);
  follow("/n/set/_service_event");
  call(true);
  Edge::Incoming message;
  EXPECT_FALSE(edge_->next(message)) << "expected no bytes of an event where a text is read";
}

TEST_F(ServiceEventsTest, MetadataHaveNoContents) {
  bus_.set_service_events(ServiceEvents::metadata);
  follow("/n/set/_service_event");
  call(true);
  const auto texts = events();
  ASSERT_EQ(texts.size(), 2U);
  for (const std::string& text : texts) EXPECT_THAT(text, HasSubstr("request: []\nresponse: []"));
}

TEST_F(ServiceEventsTest, UnansweredCallHasNoResponseEvent) {
  bus_.set_service_events(ServiceEvents::contents);
  follow("/n/set/_service_event");
  call(false);
  EXPECT_EQ(events().size(), 1U);
}

TEST_F(ServiceEventsTest, NodesOfStageHaveTheirTopics) {
  bus_.set_service_events(ServiceEvents::contents);
  auto former = std::make_unique<Node>(bus_, "/arm");
  former->serve<Trigger>("~/go", [](const auto&, const auto&) {});
  BusStage stage(bus_);
  Node next(bus_, "/arm");
  next.serve<Trigger>("~/go", [](const auto&, const auto&) {});
  stage.commit();
  former.reset();
  EXPECT_THAT(event_topics(), ElementsAre("/arm/go/_service_event", "/n/set/_service_event"));
}

TEST_F(ServiceEventsTest, ServicesOfActionHaveEvents) {
  using control_msgs::action::FollowJointTrajectory;
  bus_.set_service_events(ServiceEvents::contents);
  const ActionServer<FollowJointTrajectory> server(node_, "~/follow", {});
  EXPECT_THAT(event_topics(),
              ElementsAre("/n/follow/_action/cancel_goal/_service_event",
                          "/n/follow/_action/get_result/_service_event",
                          "/n/follow/_action/send_goal/_service_event", "/n/set/_service_event"));
}

TEST(ServiceEvent, RequestIsWrittenAtItsAlignment) {
  // A double is aligned to eight bytes: in the event it begins at another place than in the request.
  const auto& service = *find_service("gazebo_msgs/srv/ApplyJointEffort");
  Bytes request, event;
  ASSERT_TRUE(service.request->yaml_to_cdr("{joint_name: elbow, effort: 2.5}", request));
  ASSERT_TRUE(write_event(service, {}, request, {}, event));
  std::string text;
  ASSERT_TRUE(event_type(service).cdr_to_yaml(event, text));
  EXPECT_THAT(text, HasSubstr("joint_name: elbow\n  effort: 2.5"));
  request.resize(request.size() / 2);
  EXPECT_FALSE(write_event(service, {}, request, {}, event)) << "expected truncated bytes to be refused";
}

}  // namespace
}  // namespace doppel
