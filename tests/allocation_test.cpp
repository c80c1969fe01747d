// The loop neither allocates nor frees, at rest or on a trajectory, with listeners or without: every operator
// new and delete of this program is counted.
#include <cstdlib>
#include <new>

#include "twin_fixture.h"

namespace {
thread_local bool counting = false;
thread_local std::size_t counted = 0;

void release(void* memory) {
  if (counting && memory != nullptr) ++counted;
  std::free(memory);
}
}  // namespace

void* operator new(std::size_t size) {
  if (counting) ++counted;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  if (counting) ++counted;
  const auto to = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(to, (size + to - 1) / to * to)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  release(memory);
}

namespace doppel::test {
namespace {

class Allocation : public TwinFixture {
 protected:
  std::size_t count(double seconds) {
    counted = 0;
    counting = true;
    run(seconds);
    counting = false;
    return counted;
  }
};

TEST_F(Allocation, TheCounterCounts) {
  counted = 0;
  counting = true;
  delete new int(1);
  counting = false;
  EXPECT_EQ(counted, 2u);
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
