// Whatever fails while a replacement is prepared or applied, the running machine continues bit-identically:
// the nth allocation, the nth file, the nth call of the engine.

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <set>

#include "doppel/base/core/thrown.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "faults.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kSeed = 14;
constexpr std::uint64_t kFirst = 60;     // faults that are all tried, one after the other
constexpr std::uint64_t kSampled = 140;  // of the later ones, spread evenly with a random start
constexpr int kStepsBetween = 5;

// All of the first ones, and a sample of the others.
std::vector<std::uint64_t> chosen(std::uint64_t count) {
  std::set<std::uint64_t> out;
  for (std::uint64_t n = 1; n <= std::min(count, kFirst); ++n) out.insert(n);
  std::mt19937 random(kSeed);
  const std::uint64_t stride = std::max<std::uint64_t>(1, count / kSampled);
  for (std::uint64_t n = 1 + random() % stride; n <= count; n += stride) out.insert(n);
  return {out.begin(), out.end()};
}

class FaultInjectionTest : public TwinFixture, public ::testing::WithParamInterface<Fault> {
 protected:
  void SetUp() override {
    register_faulty_engine();
    folder_ = fs::path(::testing::TempDir()) / fmt::format("faults_{}", getpid()) / "omarm_one";
    fs::remove_all(folder_);
    fs::create_directories(folder_.parent_path());
    fs::copy(DOPPEL_SOURCE_DIR "/robots/omarm_one", folder_, fs::copy_options::recursive);
    return_to_start();
  }
  void TearDown() override {
    edge_.reset();
    twin_.reset();
    undisturbed_.reset();
    fs::remove_all(folder_.parent_path());
  }

  // Sets the arm in motion, for longer than the test takes.
  static void drive(Twin& twin) {
    trajectory_msgs::msg::JointTrajectory message;
    for (int i = 1; i <= 6; ++i) message.joint_names.push_back("Revolute " + std::to_string(i));
    auto& point = message.points.emplace_back();
    point.positions = {1.0, 1.2, 1.4, 1.5, 1.3, 1.1};
    point.time_from_start.sec = 20;
    const auto edge = twin.bus().attach("driver");
    ASSERT_TRUE(edge->publish("/driver", "/omarm_arm_controller/joint_trajectory",
                              "trajectory_msgs/msg/JointTrajectory", to_cdr(message)));
    steps(twin, 200);
  }
  static void steps(Twin& twin, int count) {
    for (int i = 0; i < count; ++i) {
      twin.between_steps();
      twin.step();
    }
  }

  void edit(const std::string& file, const std::string& from, const std::string& to) {
    std::ifstream in(folder_ / file);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << "expected '" << from << "' in " << file;
    in.close();
    std::ofstream(folder_ / file) << text.replace(at, from.size(), to);
  }

  // One reload with the nth fault injected; true: it succeeded nevertheless, because the fault was tolerated.
  bool reload_struck(std::uint64_t n) {
    Diagnostics said;
    arm(GetParam(), n);
    try {
      const auto fresh = Twin::prepare(twin_->running(), said);
      twin_->replace(fresh);
      disarm();
      return true;
    } catch (...) {
      disarm();
      reason_ = thrown_text();
      return false;
    }
  }

  // The number of possible faults in a reload, counted on a separate twin.
  std::uint64_t count_points() {
    Twin other(scenario(), quiet_, diagnostics_);
    Diagnostics said;
    arm(GetParam(), 0);
    const auto fresh = Twin::prepare(other.running(), said);
    other.replace(fresh);
    return disarm();
  }

  void expect_that_nothing_changes() {
    const std::uint64_t count = count_points();
    ASSERT_GT(count, 0u);
    int refused = 0, borne = 0;
    for (const std::uint64_t n : chosen(count)) {
      SCOPED_TRACE(std::string(kFaultNames[static_cast<int>(GetParam())]) + " " + std::to_string(n) + " of " +
                   std::to_string(count) + ", seed " + std::to_string(kSeed));
      if (reload_struck(n)) {
        ++borne;  // a cache that could not be written, a file with a substitute: the edit is applied
        return_to_start();
        continue;
      }
      ++refused;
      for (Twin* const twin : {twin_.get(), undisturbed_.get()}) steps(*twin, kStepsBetween);
      ASSERT_EQ(twin_->state_hash(), undisturbed_->state_hash()) << reason_;
      ASSERT_EQ(twin_->now(), undisturbed_->now());
    }
    RecordProperty("refused", refused);
    RecordProperty("borne", borne);
    EXPECT_GT(refused, 0);
  }

  // Recreates both twins, because one of them has been reloaded.
  void return_to_start() {
    edge_.reset();
    bring_up(scenario());
    undisturbed_ = std::make_unique<Twin>(scenario(), quiet_, diagnostics_);
    for (Twin* const twin : {twin_.get(), undisturbed_.get()}) drive(*twin);
  }

  [[nodiscard]] Scenario scenario() const {
    Scenario out;
    out.robots = {{.target = folder_.string()}};
    out.engine = "faulty";
    out.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
    return out;
  }

  fs::path folder_;
  Log quiet_;
  std::unique_ptr<Twin> undisturbed_;
  std::string reason_;
};

TEST_P(FaultInjectionTest, FailedReplacementOfSameStructureChangesNothing) {
  edit("urdf/omarm.xacro", "velocity=\"5.2\"", "velocity=\"4.4\"");
  expect_that_nothing_changes();
}

TEST_P(FaultInjectionTest, FailedReplacementWithOtherControllersChangesNothing) {
  edit("config/ros2_controllers.yaml", "update_rate: 100", "update_rate: 50");
  expect_that_nothing_changes();
}

INSTANTIATE_TEST_SUITE_P(Points, FaultInjectionTest,
                         ::testing::Values(Fault::allocation, Fault::file, Fault::engine),
                         [](const auto& fault) { return kFaultNames[static_cast<int>(fault.param)]; });

}  // namespace
}  // namespace doppel::test
