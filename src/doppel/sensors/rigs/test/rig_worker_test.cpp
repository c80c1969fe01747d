// Sensors that fail on the thread of the worker.
#include "doppel/sensors/rigs/detail/rig_worker.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <stdexcept>
#include <system_error>

#include "doppel/base/core/test/system_faults.h"
#include "doppel/sensors/rigs/detail/world_scene.h"
#include "light_fixture.h"

namespace doppel {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class FailingSensor : public LightSensor {
 public:
  explicit FailingSensor(const RigSensor& sensor) : LightSensor(sensor, RigOptions{}) {}
  void make(const RayCaster& /*caster*/, const LightSample& /*sample*/, Time /*stamp*/,
            std::vector<LightMessage>& out) override {
    out.push_back({0, std::make_shared<const Bytes>()});
    if (!why.empty()) throw std::runtime_error(why);
  }
  std::string why;
};

struct Working {
  explicit Working(int threads, RigWorker::MakeScene make_scene = make_world_scene) {
    for (const char* name : {"eye", "ear"}) {
      RigSensor sensor = test::sensor_named(name, 10);
      sensor.description.source = make_location("pole.urdf", 4 + static_cast<int>(sensors.size()), 2);
      failing.push_back(std::make_shared<FailingSensor>(sensor));
      sensors.push_back(failing.back());
    }
    worker = std::make_unique<RigWorker>(sensors, threads, std::move(make_scene));
    worker->reserve(2, 8);
  }
  // What a job with a sample of each reports; `made`: the number of its messages.
  std::vector<std::string> reports(std::size_t made) {
    RigJob* job = worker->free_slot();
    job->samples.clear();
    for (std::size_t i = 0; i < sensors.size(); ++i) job->samples.push_back({i, 0, 1, {}, 1});
    job->world = world_of_jobs;
    read_poses(*world.engine, job->poses);
    worker->submit();
    worker->wait_idle();
    job = worker->done();
    std::vector<std::string> out;
    for (const Diagnostic& one : job->reports.all()) out.push_back(one.str());
    std::size_t messages = 0;
    for (const auto& of_sample : job->messages) messages += of_sample.size();
    EXPECT_EQ(messages, made);
    EXPECT_EQ(std::ranges::count(job->failures, ""), static_cast<std::ptrdiff_t>(made));
    worker->release();
    return out;
  }

  test::Rig world{test::pole(), test::room()};
  std::shared_ptr<const CompiledWorld> world_of_jobs = world.engine->compiled();
  std::vector<std::shared_ptr<FailingSensor>> failing;
  std::vector<std::shared_ptr<LightSensor>> sensors;
  std::unique_ptr<RigWorker> worker;
};

TEST(RigWorker, FailureIsReportedWithSensorAndPlaceOnceForEach) {
  for (const int threads : {1, 3}) {
    Working rig(threads);
    EXPECT_THAT(rig.reports(2), IsEmpty());
    rig.failing[1]->why = "no memory";
    EXPECT_THAT(rig.reports(1), ElementsAre(AllOf(HasSubstr("pole.urdf:5:2"), HasSubstr("'pole/head/ear'"),
                                                  HasSubstr("no memory"))));
    EXPECT_THAT(rig.reports(1), IsEmpty());
    rig.failing[0]->why = "no memory";
    EXPECT_THAT(rig.reports(0), ElementsAre(AllOf(HasSubstr("pole.urdf:4:2"), HasSubstr("'pole/head/eye'"))));
    rig.failing[0]->why = "no lens";
    EXPECT_THAT(rig.reports(0), ElementsAre(HasSubstr("no lens")));
    rig.failing[0]->why = rig.failing[1]->why = "";
    EXPECT_THAT(rig.reports(2), IsEmpty());
  }
}

TEST(RigWorker, ThreadThatCannotStartEndsConstructionWithError) {
  const std::vector<std::shared_ptr<LightSensor>> sensors;
  for (const int allowed : {0, 1, 2}) {
    const ThreadShortage shortage(allowed);
    EXPECT_THROW(RigWorker(sensors, 3), std::system_error);
  }
}

TEST(RigWorker, SceneThatFailsIsTriedOnceForItsWorld) {
  int tried = 0;
  Working rig(1, [&](const CompiledWorld& world, Diagnostics& diagnostics) {
    if (++tried == 1) throw std::runtime_error("no device");
    return make_world_scene(world, diagnostics);
  });
  EXPECT_THAT(rig.reports(0), ElementsAre(AllOf(HasSubstr("no scene"), HasSubstr("no device"))));
  EXPECT_THAT(rig.reports(0), IsEmpty());
  EXPECT_EQ(tried, 1);
  const test::Rig other{test::pole(), test::room()};
  rig.world_of_jobs = other.engine->compiled();
  EXPECT_THAT(rig.reports(2), IsEmpty());
  EXPECT_EQ(tried, 2);
}

}  // namespace
}  // namespace doppel
