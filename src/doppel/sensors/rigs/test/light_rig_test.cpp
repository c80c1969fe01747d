// Sensors of light on a robot among boxes, against closed forms and against themselves.
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <map>

#include "doppel/ros/messages/vision_msgs.h"
#include "light_fixture.h"

namespace doppel {
namespace {

using sensor_msgs::msg::CameraInfo;
using sensor_msgs::msg::Image;
using sensor_msgs::msg::LaserScan;
using sensor_msgs::msg::PointCloud2;
using sensor_msgs::msg::Range;
using test::camera;
using test::kWall;
using test::lidar;
using test::LightTwin;
using test::sensor_named;
using test::time_of;

TEST(LightRig, CastsNoRayWithoutListener) {
  LightTwin twin({camera("eye", CameraKind::rgbd), lidar()});
  twin.run(0.5);
  EXPECT_EQ(twin.rig.rays_cast(), 0U);
  std::vector<CameraInfo> infos;
  twin.read("/eye/camera_info", infos);
  twin.run(0.5);
  EXPECT_EQ(twin.rig.rays_cast(), 0U);
  EXPECT_EQ(infos.size(), 15U);
}

TEST(LightRig, OutputsOfOneSampleHaveOneStamp) {
  LightTwin twin({camera("eye", CameraKind::rgbd)});
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
    LightTwin twin({eye});
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
  LightTwin twin({lidar()});
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
  LightTwin twin({near, far});
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
  LightTwin twin({sonar});
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
  LightTwin twin({beam});
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
  LightTwin twin({eye, scan}, {.seed = seed, .lockstep = true, .threads = threads});
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
    LightTwin twin({camera("eye", CameraKind::colour, 0), lidar()},
                   {.seed = 1, .lockstep = false, .threads = 3});
    std::vector<Image> pictures;
    std::vector<LaserScan> scans;
    twin.read("/eye/image_raw", pictures);
    twin.read("/scan", scans);
    twin.run(0.001 * i);
  }
}

TEST(LightRig, SamplesAreLeftOutAndCountedWhenLoopDoesNotWait) {
  LightTwin twin({camera("eye", CameraKind::colour, 0)}, {.seed = 1, .lockstep = false});
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
  LightTwin twin({eye});
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

TEST(LightRig, MessagesThatWaitAreSentAtTheirTimeThroughEdit) {
  RigSensor eye = camera("eye", CameraKind::colour, 10), gone = lidar();
  eye.description.latency = gone.description.latency = 0.25;
  LightTwin twin({gone, eye});
  std::vector<std::pair<Time, Time>> came;
  twin.reader.subscribe<CameraInfo>("/eye/camera_info", [&](const CameraInfo& info) {
    came.emplace_back(time_of(info.header), twin.world.engine->time());
  });
  std::vector<LaserScan> scans;
  twin.read("/scan", scans);
  twin.run(0.22);  // two samples wait
  twin.rig.set_sensors({eye}, *twin.world.engine);
  twin.run(0.4);
  EXPECT_TRUE(scans.empty()) << "its sensor is no longer there";
  ASSERT_EQ(came.size(), 3U);
  for (std::size_t i = 0; i < came.size(); ++i) {
    EXPECT_EQ(came[i].first, Time{} + from_seconds(0.1 * static_cast<double>(i + 1)));
    EXPECT_EQ(came[i].second, came[i].first + from_seconds(0.25));
  }
}

TEST(LightRig, MessagesThatWaitAreDroppedWhenEditChangesTheirSensor) {
  RigSensor eye = camera("eye", CameraKind::colour, 10);
  eye.description.latency = 0.25;
  RigSensor other_lens = eye, sooner = eye;
  std::get<std::vector<CameraDescription>>(other_lens.description.what).front().hfov = 1.5;
  sooner.description.latency = 0.05;
  for (const RigSensor& edited : {other_lens, sooner}) {
    LightTwin twin({eye});
    std::vector<CameraInfo> infos;
    twin.read("/eye/camera_info", infos);
    twin.run(0.22);  // two samples wait
    EXPECT_TRUE(infos.empty());
    twin.rig.set_sensors({edited}, *twin.world.engine);
    twin.run(0.55 - 0.22);
    ASSERT_FALSE(infos.empty());
    EXPECT_EQ(time_of(infos[0].header), Time{} + from_seconds(0.3)) << "the first after the edit";
  }
}

TEST(LightRig, SamplesThatFailAreNotCountedAsPublished) {
  RigSensor eye = camera("eye", CameraKind::rgbd, 10);
  std::get<std::vector<CameraDescription>>(eye.description.what).front().height = -1;  // has no memory
  LightTwin twin({eye, lidar()});
  std::vector<Image> pictures;
  std::vector<LaserScan> scans;
  twin.read("/eye/image", pictures);
  twin.read("/scan", scans);
  twin.run(0.55);
  EXPECT_TRUE(pictures.empty());
  EXPECT_EQ(twin.lines.size(), 1U);
  EXPECT_EQ(twin.rig.status().at(0).sensor.samples, 0U);
  EXPECT_EQ(twin.rig.failed(0), 5U);
  EXPECT_EQ(twin.rig.status().at(1).sensor.samples, 5U);
  EXPECT_EQ(twin.rig.failed(1), 0U);
}

TEST(LightRig, MessagesThatWaitAreDroppedWhenEditChangesTheirType) {
  RigSensor eye = camera("eye", CameraKind::boundingbox, 10), other = eye;
  eye.description.latency = 0.25;
  other.description.latency = 1;
  std::get<std::vector<CameraDescription>>(other.description.what).front().boxes = BoxKind::oriented_3d;
  LightTwin twin({eye});
  const auto edge = twin.bus.attach("edge");  // a node's reader would hold the former type
  for (const TopicInfo& topic : twin.bus.topics())
    if (topic.name == "/eye") edge->subscribe(topic.id);
  twin.bus.spin();
  twin.run(0.22);
  twin.rig.set_sensors({other}, *twin.world.engine);
  EXPECT_THAT(twin.lines, testing::IsEmpty()) << "the topic has the new type";
  twin.run(0.4);
  Edge::Incoming incoming;
  EXPECT_FALSE(edge->next(incoming));
  EXPECT_EQ(twin.rig.status().size(), 1U);
  EXPECT_GT(twin.rig.rays_cast(), 0U) << "the former sensor was read";
}

TEST(LightRig, SensorWhoseTopicHasOtherTypeElsewhereIsLeftOutWithError) {
  RigSensor eye = camera("eye", CameraKind::colour), scan = lidar();
  eye.description.topic = scan.description.topic = "view";
  scan.description.source = make_location("pole.urdf", 7, 3);
  LightTwin twin({eye, lidar()});
  twin.rig.set_sensors({eye, scan}, *twin.world.engine);
  EXPECT_EQ(twin.rig.status().size(), 1U);
  EXPECT_THAT(twin.lines, testing::ElementsAre(testing::AllOf(testing::HasSubstr("pole.urdf:7:3"),
                                                              testing::HasSubstr("'pole/head/scan'"),
                                                              testing::HasSubstr("/view"))));
}

TEST(LightRig, SensorThatIsLeftOutHasNoTopicAndErrorNamesItsElement) {
  LightTwin twin({lidar()});
  twin.reader.subscribe<LaserScan>("/eye/camera_info", [](const LaserScan&) {});
  twin.rig.set_sensors({lidar(), camera("eye", CameraKind::rgbd)}, *twin.world.engine);
  ASSERT_EQ(twin.lines.size(), 1U);
  EXPECT_THAT(twin.lines[0], testing::AllOf(testing::HasSubstr("'pole/head/eye' publishes nothing"),
                                            testing::HasSubstr("/eye/camera_info"),
                                            testing::HasSubstr("<camera_info_topic>"),
                                            testing::Not(testing::HasSubstr("error"))));
  for (const TopicInfo& topic : twin.bus.topics())
    EXPECT_TRUE(topic.publishers.empty() || !topic.name.starts_with("/eye")) << topic.name;
}

TEST(LightRig, OrientedBoxesAreInFrameOfTheirHeader) {
  RigSensor eye = camera("eye", CameraKind::boundingbox);
  std::get<std::vector<CameraDescription>>(eye.description.what).front().boxes = BoxKind::oriented_3d;
  eye.X_LF = make_pose({0, 0, 0.5}, {0, 0, 0});  // not optical, by the user's name
  LightTwin twin({eye});
  std::vector<vision_msgs::msg::Detection3DArray> boxes;
  twin.read("/eye", boxes);
  twin.run(0.04);
  ASSERT_EQ(boxes.size(), 1U);
  ASSERT_EQ(boxes[0].detections.size(), 1U);
  EXPECT_EQ(boxes[0].detections[0].header.frame_id, "head");
  EXPECT_EQ(boxes[0].detections[0].id, "wall");
  EXPECT_NEAR(boxes[0].detections[0].bbox.center.position.x, kWall + 0.1, 1e-6);
  EXPECT_NEAR(boxes[0].detections[0].bbox.center.position.z, -1.5, 1e-6);
  EXPECT_NEAR(boxes[0].detections[0].bbox.size.x, 0.2, 1e-6);
}

RigSensor several_cameras(int count) {
  RigSensor eyes = camera("eyes", CameraKind::colour);
  auto& cameras = std::get<std::vector<CameraDescription>>(eyes.description.what);
  cameras.resize(static_cast<std::size_t>(count), cameras.front());
  for (int i = 0; i < count; ++i) cameras[static_cast<std::size_t>(i)].name = "c" + std::to_string(i);
  return eyes;
}

TEST(LightRig, CamerasOfOneSensorHaveNoiseOfTheirOwn) {
  RigSensor eyes = several_cameras(2);
  auto& cameras = std::get<std::vector<CameraDescription>>(eyes.description.what);
  for (CameraDescription& one : cameras) one.noise.stddev = 0.05;
  LightTwin twin({eyes});
  std::vector<Image> left, right;
  twin.read("/eyes/c0/image_raw", left);
  twin.read("/eyes/c1/image_raw", right);
  twin.run(0.1);
  ASSERT_FALSE(left.empty());
  ASSERT_EQ(left.size(), right.size());
  std::size_t equal = 0;  // about one in fifty by chance
  for (std::size_t i = 0; i < left[0].data.size(); ++i)
    equal += left[0].data[i] == right[0].data[i] ? 1U : 0U;
  EXPECT_LT(equal, left[0].data.size() / 4);
}

TEST(LightRig, OutputsBeyondThe32ndAreReadAlone) {
  LightTwin twin({several_cameras(12)});  // three outputs each
  std::vector<CameraInfo> infos;
  twin.read("/eyes/c10/camera_info", infos);  // the 33rd
  twin.run(0.1);
  EXPECT_GT(infos.size(), 0U);
  EXPECT_EQ(twin.rig.rays_cast(), 0U) << "expected no rendering: the picture has no subscriber";
}

TEST(LightRig, SensorWithTooManyOutputsIsRejectedWithItsPlace) {
  RigSensor eyes = several_cameras(200);
  eyes.description.source = make_location("pole.urdf", 7, 3);
  try {
    const LightTwin twin({eyes});
    FAIL() << "it has 600 outputs";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("pole.urdf:7:3"));
    EXPECT_THAT(error.what(), testing::HasSubstr("'pole/head/eyes' has more than 511 outputs"));
  }
}

TEST(LightRig, PanopticPictureHasClassesAndInstances) {
  RigSensor eye = camera("eye", CameraKind::segmentation);
  std::get<std::vector<CameraDescription>>(eye.description.what).front().panoptic = true;
  LightTwin twin({eye});
  std::vector<Image> labels, colours;
  twin.read("/eye/labels_map", labels);
  twin.read("/eye/colored_map", colours);
  twin.run(0.04);
  ASSERT_EQ(labels.size(), 1U);
  ASSERT_EQ(colours.size(), 1U);
  EXPECT_EQ(labels[0].encoding, "rgb8");
  EXPECT_EQ(colours[0].encoding, "rgb8");
  const std::size_t centre = std::size_t{3} * (24 * 64 + 32);
  EXPECT_EQ(labels[0].data[centre], 1) << "the only model that is seen";
  EXPECT_EQ(labels[0].data[centre + 1], 0);
  EXPECT_EQ(labels[0].data[centre + 2], 1) << "without labels, all are of one class";
  EXPECT_NE(colours[0].data[centre], 0);
}

TEST(LightRig, SensorsThatStayKeepTheirCountWhenOthersCome) {
  LightTwin twin({camera("eye", CameraKind::colour, 10), lidar()});
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
  LightTwin twin({scan, absolute});
  const auto status = twin.rig.status();
  EXPECT_THAT(status[0].sensor.topics, testing::ElementsAre("/left/scan", "/left/scan/points"));
  EXPECT_THAT(status[1].sensor.topics, testing::ElementsAre("/scan_of_all", "/scan_of_all/points"));
}

// Without a rate, and with one that is limited to the step.
TEST(LightRig, SampleOfEveryStepHasStepAsPeriod) {
  for (const double rate : {0.0, 5000.0}) {
    RigSensor scanner = test::lidar(rate);
    auto& lidar = std::get<LidarDescription>(scanner.description.what);
    lidar.noise.walk_stddev = 0.5;
    lidar.noise.walk_time = 1;
    lidar.moving = true;
    test::LightTwin twin({scanner});
    std::vector<sensor_msgs::msg::LaserScan> scans;
    twin.read("/scan", scans);
    twin.run(0.02);
    ASSERT_EQ(scans.size(), 20U) << rate;
    EXPECT_FLOAT_EQ(scans.front().scan_time, 0.001F) << rate;
    EXPECT_NE(scans.front().ranges[90], scans.back().ranges[90]) << rate;  // the bias walks
  }
}

}  // namespace
}  // namespace doppel
