// The loop neither allocates nor frees, at rest or on a trajectory, with listeners or without: every operator
// new and delete of this program is counted.
#include "doppel/core/test/heap_touches.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

class Allocation : public TwinFixture {
 protected:
  std::size_t count(double seconds) {
    return heap_touches_of([&] { run(seconds); });
  }
};

TEST_F(Allocation, TheCounterCounts) {
  EXPECT_EQ(heap_touches_of([] {
              int* volatile escaped = new int(1);  // or the compiler leaves both out
              delete escaped;
            }),
            2u);
}

TEST_F(Allocation, NoneInTheLoop) {
  for (const char* robot : {"omarm_one", "lab_arm"}) {
    SCOPED_TRACE(robot);
    bring_up(robot);
    run(0.3);
    EXPECT_EQ(count(2.0), 0u) << "at rest, nobody listening";
  }
}

TEST_F(Allocation, NoneOnATrajectoryWithAListener) {
  bring_up("omarm_one");
  for (const TopicInfo& topic : twin_->bus().topics()) edge_->subscribe(topic.id);
  publish("/omarm_arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
          R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [1.0, 1.2, 1.57, 1.57, 1.57, 1.57], time_from_start: {sec: 2}}]})");
  run(0.3);
  EXPECT_EQ(count(1.0), 0u);
  EXPECT_EQ(edge_->dropped(), 0u);
}

}  // namespace
}  // namespace doppel::test
