// Sensors of light on a robot among boxes, against closed forms and against themselves.
#include "doppel/sensing/light_rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>

#include "doppel/messages/sensor_msgs.h"
#include "doppel/physics/test/engine_fixture.h"

namespace doppel {
namespace {

using sensor_msgs::msg::CameraInfo;
using sensor_msgs::msg::Image;
using sensor_msgs::msg::LaserScan;
using sensor_msgs::msg::PointCloud2;
using sensor_msgs::msg::Range;

constexpr double kWall = 3;  // m from the robot to the face of the box before it

Time time_of(const std_msgs::msg::Header& header) {
  return Time{std::int64_t{header.stamp.sec} * 1'000'000'000 + header.stamp.nanosec};
}

RobotDescription pole() {
  RobotDescription robot;
  robot.name = "pole";
  robot.links.push_back(test::make_link("base", 1, {0, 0, 0}, {1e-3, 1e-3, 1e-3}));
  robot.links.push_back(test::make_link("head", 1, {0, 0, 0}, {1e-3, 1e-3, 1e-3}));
  robot.joints.push_back(test::make_joint("neck", JointType::revolute, "base", "head", {0, 0, 1}, {0, 0, 1}));
  test::limit(robot.joints.back(), -3, 3, 10, 10);
  return robot;
}

World room() {
  World world = test::empty_space();
  world.gravity.setZero();
  WorldObject wall;
  wall.name = "wall";
  wall.shape = Box{{0.2, 20, 20}};
  wall.X_WO.translation() = Eigen::Vector3d(kWall + 0.1, 0, 0);
  world.objects.push_back(wall);
  return world;
}

RigSensor sensor_named(const std::string& name, double rate) {
  RigSensor sensor;
  sensor.instance = "pole";
  sensor.link = 1;
  sensor.frame = "head";
  sensor.description.name = name;
  sensor.description.link = "head";
  sensor.description.rate = rate;
  return sensor;
}

RigSensor camera(const std::string& name, CameraKind kind, double rate = 30) {
  RigSensor sensor = sensor_named(name, rate);
  CameraDescription description;
  description.kind = kind;
  description.width = 64;
  description.height = 48;
  sensor.description.what = std::vector<CameraDescription>{description};
  return sensor;
}

RigSensor lidar(double rate = 10) {
  RigSensor sensor = sensor_named("scan", rate);
  LidarDescription description;
  description.horizontal = {181, 1, -1, 1};
  sensor.description.what = description;
  return sensor;
}

// A rig with its engine, and what comes on its topics.
struct Running {
  test::Rig world{pole(), room()};
  Bus bus;
  Log log;
  std::vector<std::string> lines;
  LightRig rig;
  Node reader{bus, "/reader"};

  explicit Running(std::vector<RigSensor> sensors, const RigOptions& options = {.seed = 1, .lockstep = true})
      : rig(bus, log, options) {
    log.add_sink([this](const LogLine& line) { lines.push_back(line.text); });
    rig.set_sensors(std::move(sensors), *world.engine);
  }
  template <Message M>
  void read(const std::string& topic, std::vector<M>& into) {
    reader.subscribe<M>(topic, [&into](const M& message) { into.push_back(message); });
    bus.spin();
  }
  void run(double seconds) {
    const auto steps = static_cast<int>(std::lround(seconds * 1000));
    for (int i = 0; i < steps; ++i) {
      world.engine->step();
      const Time now = world.engine->time();
      bus.set_now(now);
      rig.after_step(now, *world.engine);
      rig.between_steps(now);
    }
  }
};

TEST(LightRig, CastsNoRayWithoutListener) {
  Running twin({camera("eye", CameraKind::rgbd), lidar()});
  twin.run(0.5);
  EXPECT_EQ(twin.rig.rays_cast(), 0U);
  std::vector<CameraInfo> infos;
  twin.read("/eye/camera_info", infos);
  twin.run(0.5);
  EXPECT_EQ(twin.rig.rays_cast(), 0U);
  EXPECT_EQ(infos.size(), 15U);
}

TEST(LightRig, OutputsOfOneSampleHaveOneStamp) {
  Running twin({camera("eye", CameraKind::rgbd)});
  std::vector<Image> pictures, depths;
  std::vector<PointCloud2> clouds;
  std::vector<CameraInfo> infos;
  twin.read("/eye/image", pictures);
  twin.read("/eye/depth_image", depths);
  twin.read("/eye/points", clouds);
  twin.read("/eye/camera_info", infos);
  twin.run(1);
  ASSERT_EQ(pictures.size(), 30U);
  ASSERT_EQ(depths.size(), 30U);
  ASSERT_EQ(clouds.size(), 30U);
  ASSERT_EQ(infos.size(), 30U);
  for (std::size_t i = 0; i < 30; ++i) {
    const Time stamp = time_of(pictures[i].header);
    EXPECT_EQ(stamp, time_of(depths[i].header));
    EXPECT_EQ(stamp, time_of(clouds[i].header));
    EXPECT_EQ(stamp, time_of(infos[i].header));
  }
  EXPECT_EQ(pictures[0].encoding, "rgb8");
  EXPECT_EQ(depths[0].encoding, "32FC1");
  EXPECT_EQ(pictures[0].data.size(), 64U * 48 * 3);
  float depth = 0;
  std::memcpy(&depth, &depths[0].data[std::size_t{4} * (24 * 64 + 32)], 4);
  EXPECT_NEAR(depth, kWall, 1e-4);
}

TEST(LightRig, PointsLieOnSurfacesInAxesOfTheirFrame) {
  // In the link's axes, in the optical ones, and in a frame anywhere.
  Pose optical = make_pose({0.1, 0.2, 0.3}, {-M_PI / 2, 0, -M_PI / 2});
  for (const Pose& X_LF : {Pose::Identity(), optical, make_pose({1, -2, 0.5}, {0.3, 0.2, 0.1})}) {
    RigSensor eye = camera("eye", CameraKind::depth);
    eye.X_LF = X_LF;
    eye.description.X_LS = make_pose({0.1, 0.2, 0.3}, {0, 0, 0.1});
    Running twin({eye});
    std::vector<PointCloud2> clouds;
    twin.read("/eye/points", clouds);
    twin.run(0.1);
    ASSERT_GE(clouds.size(), 3U);
    const Pose X_WF = std::as_const(*twin.world.engine).instance(0).link_pose(1) * X_LF;
    int points = 0;
    for (std::size_t at = 0; at < clouds[0].data.size(); at += clouds[0].point_step) {
      Eigen::Vector3f p_F;
      std::memcpy(p_F.data(), &clouds[0].data[at], 12);
      if (!p_F.allFinite()) continue;
      EXPECT_NEAR((X_WF * p_F.cast<double>()).x(), kWall, 1e-4);
      ++points;
    }
    EXPECT_GT(points, 3000);
  }
}

TEST(LightRig, RangesAreThoseOfClosedForm) {
  Running twin({lidar()});
  std::vector<LaserScan> scans;
  twin.read("/scan", scans);
  twin.run(0.3);
  ASSERT_EQ(scans.size(), 3U);
  const LaserScan& scan = scans[0];
  ASSERT_EQ(scan.ranges.size(), 181U);
  EXPECT_NEAR(scan.angle_increment, 2.0 / 180, 1e-7);
  for (std::size_t i = 0; i < scan.ranges.size(); ++i)
    EXPECT_NEAR(scan.ranges[i], kWall / std::cos(-1 + 2.0 * static_cast<double>(i) / 180), 1e-5);
}

TEST(LightRig, RangesBeyondAndBelowLimitsAreInfinite) {
  RigSensor near = lidar(), far = lidar();
  near.description.name = "near";
  std::get<LidarDescription>(near.description.what).near = 3.5;
  far.description.name = "far";
  std::get<LidarDescription>(far.description.what).far = 2;
  Running twin({near, far});
  std::vector<LaserScan> of_near, of_far;
  twin.read("/near", of_near);
  twin.read("/far", of_far);
  twin.run(0.1);
  ASSERT_FALSE(of_near.empty());
  EXPECT_EQ(of_near[0].ranges[90], -kInfinity);
  EXPECT_NEAR(of_near[0].ranges[0], kWall / std::cos(1.0), 1e-4);
  EXPECT_EQ(of_far[0].ranges[90], kInfinity);
}

TEST(LightRig, NearestOfConeIsRange) {
  RigSensor sonar = sensor_named("sonar", 20);
  sonar.description.what = RangeDescription{};
  Running twin({sonar});
  std::vector<Range> ranges;
  twin.read("/sonar", ranges);
  twin.run(0.1);
  ASSERT_EQ(ranges.size(), 2U);
  EXPECT_NEAR(ranges[0].range, kWall, 1e-5);
}

TEST(LightRig, RangeOfRaySensorIsNearestOfItsOwnRays) {
  RigSensor beam = sensor_named("beam", 20);
  beam.description.type = "ray";
  beam.description.X_LS.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  RangeDescription range;
  range.field_of_view = 1;  // of a cone, which would meet the wall nearer
  range.rays.horizontal = {1, 1, 0, 0};
  beam.description.what = range;
  Running twin({beam});
  std::vector<Range> ranges;
  twin.read("/beam", ranges);
  twin.run(0.1);
  ASSERT_EQ(ranges.size(), 2U);
  EXPECT_NEAR(ranges[0].range, kWall / std::cos(0.4), 1e-4);
}

std::map<std::string, std::uint64_t> hashes(std::uint64_t seed, bool reads_early, int threads = 1) {
  RigSensor eye = camera("eye", CameraKind::rgbd), scan = lidar();
  auto& description = std::get<std::vector<CameraDescription>>(eye.description.what).front();
  description.noise.stddev = 0.02;
  description.depth_noise = {0.001, 0, 0.002};
  std::get<LidarDescription>(scan.description.what).noise = {0, 0.01, 0, 0, 0, 0.1, 1.0};
  Running twin({eye, scan}, {.seed = seed, .lockstep = true, .threads = threads});
  std::vector<Image> pictures;
  std::vector<LaserScan> scans;
  twin.run(0.25);
  if (reads_early) twin.read("/eye/image", pictures);
  twin.run(0.25);
  if (!reads_early) twin.read("/eye/image", pictures);
  twin.read("/scan", scans);
  twin.run(0.5);
  // Only what came in the last half of a second, which every run has read.
  std::map<std::string, std::uint64_t> out;
  for (const auto& [name, bytes] :
       {std::pair{"eye", to_cdr(pictures.back())}, {"scan", to_cdr(scans.back())}})
    for (const std::byte byte : bytes) out[name] = out[name] * 31 + static_cast<std::uint64_t>(byte);
  return out;
}

TEST(LightRig, SampleHasSameBytesWithAnyReadersBefore) {
  const auto one = hashes(1, true);
  EXPECT_EQ(one, hashes(1, true));
  EXPECT_EQ(one, hashes(1, false));
  const auto other_seed = hashes(2, true);
  EXPECT_NE(one.at("eye"), other_seed.at("eye"));
  EXPECT_NE(one.at("scan"), other_seed.at("scan"));
}

TEST(LightRig, SampleHasSameBytesWithAnyNumberOfThreads) {
  const auto one = hashes(1, true, 1);
  EXPECT_EQ(one, hashes(1, true, 2));
  EXPECT_EQ(one, hashes(1, true, 5));
}

TEST(LightRig, EndsWhileSamplesAreMadeByManyThreads) {
  for (int i = 0; i < 30; ++i) {
    Running twin({camera("eye", CameraKind::colour, 0), lidar()},
                 {.seed = 1, .lockstep = false, .threads = 3});
    std::vector<Image> pictures;
    std::vector<LaserScan> scans;
    twin.read("/eye/image_raw", pictures);
    twin.read("/scan", scans);
    twin.run(0.001 * i);
  }
}

TEST(LightRig, SamplesAreLeftOutAndCountedWhenLoopDoesNotWait) {
  Running twin({camera("eye", CameraKind::colour, 0)}, {.seed = 1, .lockstep = false});
  std::vector<Image> pictures;
  twin.read("/eye/image_raw", pictures);
  twin.run(1);
  const doppel_msgs::msg::Sensor status = twin.rig.status().at(0).sensor;
  EXPECT_GT(status.left_out, 0U);
  EXPECT_LE(status.samples + status.left_out, 1000U);
  EXPECT_GE(status.samples + status.left_out, 1000U - 4);
}

TEST(LightRig, MessagesWaitForLatencyAndKeepTheirStamp) {
  RigSensor eye = camera("eye", CameraKind::colour, 10);
  eye.description.latency = 0.25;
  Running twin({eye});
  std::vector<CameraInfo> infos;
  std::vector<Time> came;
  twin.reader.subscribe<CameraInfo>("/eye/camera_info", [&](const CameraInfo& info) {
    infos.push_back(info);
    came.push_back(twin.world.engine->time());
  });
  twin.run(1);
  ASSERT_GE(infos.size(), 7U);
  for (std::size_t i = 0; i < infos.size(); ++i)
    EXPECT_EQ(came[i], time_of(infos[i].header) + from_seconds(0.25));
}

TEST(LightRig, SensorsThatStayKeepTheirCountWhenOthersCome) {
  Running twin({camera("eye", CameraKind::colour, 10), lidar()});
  std::vector<CameraInfo> infos;
  twin.read("/eye/camera_info", infos);
  twin.run(1);
  ASSERT_EQ(infos.size(), 10U);
  RigSensor wide = camera("eye", CameraKind::colour, 10), second = lidar();
  std::get<std::vector<CameraDescription>>(wide.description.what).front().hfov = 1.5;
  second.description.name = "second";
  twin.rig.set_sensors({wide, lidar(), second}, *twin.world.engine);
  twin.run(0.15);
  ASSERT_EQ(infos.size(), 11U);
  EXPECT_NEAR(infos[10].k[0], 32 / std::tan(0.75), 1e-9);
  EXPECT_EQ(twin.rig.status().at(0).sensor.samples, 11U);
}

TEST(LightRig, SensorsOfNamespaceHaveTopicsThere) {
  RigSensor scan = lidar();
  scan.name_space = "left";
  RigSensor absolute = lidar();
  absolute.description.name = "second";
  absolute.description.topic = "/scan_of_all";
  Running twin({scan, absolute});
  const auto status = twin.rig.status();
  EXPECT_THAT(status[0].sensor.topics, testing::ElementsAre("/left/scan", "/left/scan/points"));
  EXPECT_THAT(status[1].sensor.topics, testing::ElementsAre("/scan_of_all", "/scan_of_all/points"));
}

}  // namespace
}  // namespace doppel
