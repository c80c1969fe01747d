// Sensors in all spellings: types, plugins of Gazebo classic in the forms of ROS 1 and ROS 2, presets, and what is wrong.
#include "doppel/description/gazebo/sensor_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/description/gazebo/camera_intrinsics.h"
#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

constexpr const char* kLinks =
    "<robot name='r'>\n"
    "<link name='base'/><link name='head'/>\n"
    "<joint name='neck' type='fixed'><parent link='base'/><child link='head'/></joint>\n";

struct Read {
  std::vector<SensorDescription> sensors;
  Diagnostics diagnostics;

  explicit Read(const std::string& gazebo) {
    PackageResolver resolver;
    Diagnostics of_urdf;
    const RobotDescription robot = parse_urdf(kLinks + gazebo + "</robot>", "r.urdf", resolver, of_urdf);
    sensors = read_sensors(robot, diagnostics);
  }
  // Of a <sensor> on the head, which is in line 4.
  static Read of(const std::string& type, const std::string& inner) {
    return Read("<gazebo reference='head'><sensor name='eye' type='" + type + "'>" + inner +
                "</sensor></gazebo>");
  }
  [[nodiscard]] const SensorDescription& one() const { return sensors.at(0); }
  template <class T>
  [[nodiscard]] const T& what() const {
    return std::get<T>(one().what);
  }
  [[nodiscard]] const CameraDescription& camera() const {
    return what<std::vector<CameraDescription>>().at(0);
  }
  [[nodiscard]] std::vector<std::string> messages() const {
    std::vector<std::string> out;
    for (const Diagnostic& d : diagnostics.all()) out.push_back(d.str());
    return out;
  }
};

std::string plugin(const std::string& file, const std::string& inner) {
  return "<plugin name='node' filename='" + file + "'>" + inner + "</plugin>";
}

constexpr const char* kPicture =
    "<update_rate>20</update_rate><camera name='eye'><horizontal_fov>1.2</horizontal_fov>"
    "<image><width>64</width><height>48</height></image></camera>";

TEST(SensorReader, SensorHasPlaceOfItsOwnElement) {
  const Read read(
      "<gazebo reference='head'>\n<!-- a comment -->\n<gravity>1</gravity>\n  <sensor name='a' type='imu'/>\n"
      "<sensor name='b' type='imu'><update_rate>x</update_rate></sensor></gazebo>");
  ASSERT_EQ(read.sensors.size(), 2U);
  EXPECT_EQ(read.sensors[0].source.place(), "r.urdf:7:3");
  EXPECT_EQ(read.sensors[1].source.line, 8);
  EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("r.urdf:8:")));
}

TEST(SensorReader, UnknownTypeIsReportedAtItsLineWithNearestOne) {
  const Read read = Read::of("gpu_lider", "");
  EXPECT_TRUE(read.sensors.empty());
  EXPECT_THAT(read.messages(),
              ElementsAre(::testing::AllOf(HasSubstr("r.urdf:4:"), HasSubstr("did you mean 'gpu_lidar'?"))));
}

TEST(SensorReader, TypesOfBoxesAndSegmentationAreReadInCameraAndBesideIt) {
  const auto boxes = [](const std::string& type) {
    return Read::of("boundingbox_camera", "<camera><box_type>" + type + "</box_type></camera>")
        .camera()
        .boxes;
  };
  EXPECT_EQ(boxes("2d"), BoxKind::visible_2d);
  EXPECT_EQ(boxes("full_2d"), BoxKind::full_2d);
  EXPECT_EQ(boxes("3D"), BoxKind::oriented_3d);
  const Read beside = Read::of("segmentation", "<segmentation_type>instance</segmentation_type><camera/>"),
             within =
                 Read::of("segmentation", "<camera><segmentation_type>Panoptic</segmentation_type></camera>"),
             none = Read::of("segmentation", "<camera/>");
  EXPECT_TRUE(beside.camera().panoptic);
  EXPECT_TRUE(within.camera().panoptic);
  EXPECT_FALSE(none.camera().panoptic);
  const Read wrong =
      Read::of("segmentation", "<camera>\n<segmentation_type>All</segmentation_type></camera>");
  EXPECT_THAT(wrong.messages(),
              ElementsAre(::testing::AllOf(HasSubstr("r.urdf:5:"), HasSubstr("'All' is not semantic"))));
  EXPECT_THAT(Read::of("camera", "<camera><box_type>all</box_type></camera>").messages(), ElementsAre());
}

TEST(SensorReader, KnownTypeThatIsNotSimulatedIsReportedAsThat) {
  EXPECT_THAT(Read::of("thermal", "").messages(), ElementsAre(HasSubstr("are not simulated")));
}

TEST(SensorReader, EveryTypeOfOneKindHasEqualResult) {
  for (const char* type : {"camera", "wideanglecamera", "wide_angle_camera"})
    EXPECT_EQ(Read::of(type, kPicture).camera().kind, CameraKind::colour) << type;
  for (const char* type : {"depth", "depth_camera"})
    EXPECT_EQ(Read::of(type, kPicture).camera().kind, CameraKind::depth) << type;
  for (const char* type : {"rgbd", "rgbd_camera"})
    EXPECT_EQ(Read::of(type, kPicture).camera().kind, CameraKind::rgbd) << type;
  const std::string scan = "<scan><horizontal><samples>7</samples></horizontal></scan>";
  for (const char* type : {"ray", "gpu_ray", "lidar", "gpu_lidar"})
    for (const char* root : {"ray", "lidar"})
      EXPECT_EQ(Read::of(type, "<" + std::string(root) + ">" + scan + "</" + root + ">")
                    .what<LidarDescription>()
                    .horizontal.samples,
                7)
          << type << " " << root;
}

TEST(SensorReader, FrameTagsOfAllPrefixesNameOneFrame) {
  for (const char* tag : {"frame_id", "gz_frame_id", "ignition_frame_id", "gz:frame_id"})
    EXPECT_EQ(Read::of("imu", "<" + std::string(tag) + ">base</" + tag + ">").one().frame, "base") << tag;
}

TEST(SensorReader, DefaultTopicIsNone) {
  EXPECT_EQ(Read::of("imu", "<topic>__default_topic__</topic>").one().topic, "");
}

TEST(SensorReader, SensorOnJointIsOnItsChild) {
  const Read read("<gazebo reference='neck'><sensor name='f' type='force_torque'/></gazebo>");
  EXPECT_EQ(read.one().link, "head");
  EXPECT_EQ(read.one().joint, "neck");
}

TEST(SensorReader, SensorWithoutReferenceIsOnRootLinkAndReported) {
  const Read read("<gazebo><sensor name='i' type='imu'/></gazebo>");
  EXPECT_EQ(read.one().link, "base");
  EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("without a reference")));
}

TEST(SensorReader, UnknownReferenceIsReportedWithNearestName) {
  const Read read("<gazebo reference='haed'><sensor name='i' type='imu'/></gazebo>");
  EXPECT_TRUE(read.sensors.empty());
  EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("did you mean 'head'?")));
}

TEST(SensorReader, SecondSensorOfOneNameIsRenamedAndReported) {
  const Read read(
      "<gazebo reference='head'><sensor name='i' type='imu'/><sensor name='i' type='imu'/></gazebo>");
  EXPECT_EQ(read.sensors.at(1).name, "i_2");
  EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("two sensors 'i'")));
}

TEST(SensorPlugins, CameraOfRos2HasTopicsBelowItsName) {
  const Read read = Read::of("camera", kPicture + plugin("libgazebo_ros_camera.so",
                                                         "<ros><namespace>/demo</namespace></ros>"
                                                         "<camera_name>front</camera_name>"
                                                         "<frame_name>base</frame_name>"
                                                         "<hack_baseline>0.07</hack_baseline>"));
  EXPECT_EQ(read.one().name_space, "/demo");
  EXPECT_THAT(read.one().topics,
              ElementsAre(Pair("image", "front/image_raw"), Pair("camera_info", "front/camera_info")));
  EXPECT_EQ(read.one().frame, "base");
  EXPECT_EQ(read.camera().baseline, 0.07);
  EXPECT_EQ(read.one().rate, 20);
  EXPECT_THAT(read.messages(), ElementsAre());
}

TEST(SensorPlugins, CameraOfRos2WithoutNameHasThatOfItsSensor) {
  const Read read = Read::of("camera", kPicture + plugin("libgazebo_ros_camera.so", "<ros/>"));
  EXPECT_THAT(read.one().topics, Contains(Pair("image", "eye/image_raw")));
}

TEST(SensorPlugins, RemappingAppliesToTopicInItsNamespace) {
  const Read read =
      Read::of("camera", kPicture + plugin("libgazebo_ros_camera.so",
                                           "<ros><namespace>demo</namespace>"
                                           "<remapping>eye/image_raw:=picture</remapping>"
                                           "<remapping>/demo/eye/camera_info:=/about</remapping>"
                                           "<remapping>image_raw:=x</remapping></ros>"));
  EXPECT_THAT(read.one().topics, ElementsAre(Pair("image", "picture"), Pair("camera_info", "/about")));
  EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("image_raw:=x")));
}

TEST(SensorPlugins, CameraOfRos1HasTopicsAsWritten) {
  const Read read = Read::of(
      "camera", kPicture + plugin("libgazebo_ros_camera.so",
                                  "<alwaysOn>true</alwaysOn><updateRate>5</updateRate>"
                                  "<robotNamespace>bot</robotNamespace><cameraName>cam</cameraName>"
                                  "<imageTopicName>picture</imageTopicName>"
                                  "<cameraInfoTopicName>/about</cameraInfoTopicName>"
                                  "<frameName>/base</frameName><hackBaseline>0.1</hackBaseline>"
                                  "<distortionK1>-0.2</distortionK1><distortionT1>0.01</distortionT1>"));
  EXPECT_EQ(read.one().name_space, "bot");
  EXPECT_THAT(read.one().topics, ElementsAre(Pair("image", "cam/picture"), Pair("camera_info", "/about")));
  EXPECT_EQ(read.one().frame, "base");
  EXPECT_EQ(read.one().rate, 5);
  EXPECT_EQ(read.camera().lens.distortion, (std::array<double, 5>{-0.2, 0, 0.01, 0, 0}));
  EXPECT_THAT(read.messages(), ElementsAre());
}

TEST(SensorPlugins, DepthPluginPublishesPictureDepthAndPoints) {
  const Read read = Read::of(
      "depth", kPicture + plugin("libgazebo_ros_openni_kinect.so",
                                 "<cameraName>k</cameraName><imageTopicName>rgb/image_raw</imageTopicName>"
                                 "<depthImageTopicName>depth/image</depthImageTopicName>"
                                 "<pointCloudTopicName>cloud</pointCloudTopicName>"
                                 "<pointCloudCutoff>0.5</pointCloudCutoff>"));
  EXPECT_EQ(read.camera().kind, CameraKind::rgbd);
  EXPECT_EQ(read.camera().depth_near, 0.5);
  EXPECT_EQ(read.camera().depth_far, 5.0);
  EXPECT_THAT(read.one().topics,
              ElementsAre(Pair("image", "k/rgb/image_raw"), Pair("camera_info", "k/ir/camera_info"),
                          Pair("depth", "k/depth/image"), Pair("depth_camera_info", "k/depth/camera_info"),
                          Pair("points", "k/cloud")));
}

TEST(SensorPlugins, DepthSensorWithCameraPluginOfRos2HasDepthTopics) {
  const Read read = Read::of(
      "depth",
      kPicture + plugin("libgazebo_ros_camera.so", "<min_depth>0.1</min_depth><max_depth>7</max_depth>"));
  EXPECT_EQ(read.camera().depth_near, 0.1);
  EXPECT_EQ(read.camera().depth_far, 7.0);
  EXPECT_THAT(read.one().topics, Contains(Pair("depth", "eye/depth/image_raw")));
  EXPECT_THAT(read.one().topics, Contains(Pair("points", "eye/points")));
}

TEST(SensorPlugins, StereoCamerasHaveBaselineOfTheirPoses) {
  const Read read = Read::of("multicamera",
                             "<camera name='left'><pose>0 0.05 0 0 0 0</pose></camera>"
                             "<camera name='right'><pose>0 -0.05 0 0 0 0</pose></camera>" +
                                 plugin("libgazebo_ros_multicamera.so", "<cameraName>s</cameraName>"));
  const auto& cameras = read.what<std::vector<CameraDescription>>();
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].baseline, 0);
  EXPECT_NEAR(cameras[1].baseline, 0.1, 1e-12);
  EXPECT_THAT(read.one().topics, Contains(Pair("right/image", "s/right/image_raw")));
  EXPECT_THAT(read.one().topics, Contains(Pair("left/camera_info", "s/left/camera_info")));
}

TEST(SensorPlugins, LaserOfRos1HasItsTopicAndNoise) {
  for (const char* file : {"libgazebo_ros_laser.so", "libgazebo_ros_gpu_laser.so"}) {
    const Read read = Read::of("ray", plugin(file,
                                             "<topicName>/scan</topicName><frameName>base</frameName>"
                                             "<gaussianNoise>0.02</gaussianNoise>"));
    EXPECT_EQ(read.one().topic, "/scan");
    EXPECT_EQ(read.what<LidarDescription>().noise.stddev, 0.02);
    EXPECT_FALSE(read.one().points_only);
  }
}

TEST(SensorPlugins, OutputTypeOfRaySensorDecides) {
  const auto read = [](const std::string& type) {
    return Read::of("ray", "<ray><range><min>0.1</min><max>3</max></range></ray>" +
                               plugin("libgazebo_ros_ray_sensor.so",
                                      "<ros><remapping>~/out:=scan</remapping></ros>" +
                                          (type.empty() ? "" : "<output_type>" + type + "</output_type>")));
  };
  EXPECT_FALSE(read("sensor_msgs/LaserScan").one().points_only);
  EXPECT_EQ(read("sensor_msgs/LaserScan").one().topic, "scan");
  for (const char* type : {"", "sensor_msgs/PointCloud2", "sensor_msgs/PointCloud"})
    EXPECT_TRUE(read(type).one().points_only) << type;
  const Read range = read("sensor_msgs/Range");
  EXPECT_EQ(range.what<RangeDescription>().far, 3);
  EXPECT_FALSE(range.what<RangeDescription>().ultrasound);
}

TEST(SensorPlugins, PrivateTopicIsBelowNameOfPlugin) {
  const Read read =
      Read::of("imu", plugin("libgazebo_ros_imu_sensor.so", "<ros><namespace>n</namespace></ros>"));
  EXPECT_EQ(read.one().topic, "node/out");
  EXPECT_EQ(read.one().name_space, "n");
}

TEST(SensorPlugins, VelodyneAndBlockLaserPublishPointsOnly) {
  for (const char* file : {"libgazebo_ros_velodyne_laser.so", "libgazebo_ros_velodyne_gpu_laser.so",
                           "libgazebo_ros_block_laser.so"}) {
    const Read read = Read::of("ray", plugin(file, "<topicName>points</topicName>"));
    EXPECT_TRUE(read.one().points_only) << file;
    EXPECT_EQ(read.one().topic, "points") << file;
  }
}

TEST(SensorPlugins, RangePluginsMeasureOneDistance) {
  for (const char* file : {"libgazebo_ros_range.so", "libhector_gazebo_ros_sonar.so"}) {
    const Read read = Read::of("ray", plugin(file,
                                             "<topicName>sonar</topicName><fov>0.5</fov>"
                                             "<radiation>infrared</radiation>"));
    EXPECT_EQ(read.what<RangeDescription>().field_of_view, 0.5) << file;
    EXPECT_FALSE(read.what<RangeDescription>().ultrasound) << file;
  }
}

TEST(SensorPlugins, BumperPublishesItsStates) {
  const Read read = Read::of("contact", plugin("libgazebo_ros_bumper.so",
                                               "<bumperTopicName>hit</bumperTopicName>"
                                               "<frameName>world</frameName>"));
  EXPECT_TRUE(read.what<ContactDescription>().bumper);
  EXPECT_EQ(read.one().topic, "hit");
  EXPECT_EQ(read.one().frame, "");
}

TEST(SensorPlugins, BestEffortIsReadOfQos) {
  const Read read =
      Read::of("imu", plugin("libgazebo_ros_imu_sensor.so",
                             "<ros><qos><topic name='~/out'><publisher><reliability>best_effort</reliability>"
                             "</publisher></topic></qos></ros>"));
  EXPECT_TRUE(read.one().best_effort);
}

TEST(SensorPlugins, PluginOutsideOfSensorIsSensorOnItsBody) {
  for (const char* file : {"libgazebo_ros_imu.so", "libhector_gazebo_ros_imu.so"}) {
    const Read read("<gazebo>" +
                    plugin(file,
                           "<bodyName>head</bodyName><topicName>imu</topicName>"
                           "<xyzOffset>1 2 3</xyzOffset><updateRate>50</updateRate>") +
                    "</gazebo>");
    EXPECT_EQ(read.one().link, "head") << file;
    EXPECT_EQ(read.one().topic, "imu") << file;
    EXPECT_EQ(read.one().rate, 50) << file;
    EXPECT_EQ(read.one().X_LS.translation(), Eigen::Vector3d(1, 2, 3)) << file;
    EXPECT_TRUE(std::holds_alternative<ImuDescription>(read.one().what)) << file;
    EXPECT_EQ(read.one().source.line, 4);
  }
}

TEST(SensorPlugins, ElementsOfRos1AreNotReadBesideThoseOfRos2) {
  const Read read = Read::of("imu", plugin("libgazebo_ros_imu_sensor.so",
                                           "<ros><remapping>~/out:=imu/data</remapping></ros>"
                                           "<topicName>other</topicName>"));
  EXPECT_EQ(read.one().topic, "imu/data");
}

TEST(SensorPlugins, NoiseOfHectorIsForEachAxis) {
  const Read read("<gazebo>" +
                  plugin("libhector_gazebo_ros_imu.so",
                         "<bodyName>head</bodyName><rateGaussianNoise>1 2 3</rateGaussianNoise>"
                         "<accelGaussianNoise>4</accelGaussianNoise>") +
                  "</gazebo>");
  EXPECT_EQ(read.what<ImuDescription>().angular_velocity[2].stddev, 3);
  EXPECT_EQ(read.what<ImuDescription>().linear_acceleration[1].stddev, 4);
  EXPECT_THAT(read.messages(), ElementsAre());
}

TEST(SensorPlugins, WrenchPluginIsOnItsJoint) {
  for (const char* tag : {"joint_name", "jointName"}) {
    const Read read("<gazebo>" +
                    plugin("libgazebo_ros_ft_sensor.so", "<" + std::string(tag) + ">neck</" + tag + ">") +
                    "</gazebo>");
    EXPECT_EQ(read.one().joint, "neck") << tag;
    EXPECT_EQ(read.one().link, "head") << tag;
    EXPECT_EQ(read.one().topic, "wrench") << tag;
  }
}

TEST(SensorPlugins, OuterPluginOnUnknownBodyIsReported) {
  const Read read("<gazebo>" + plugin("libgazebo_ros_imu.so", "<bodyName>hed</bodyName>") + "</gazebo>");
  EXPECT_TRUE(read.sensors.empty());
  EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("did you mean 'head'?")));
}

TEST(SensorPlugins, UnknownPluginIsNotedAtItsLine) {
  const Read read = Read::of("camera", kPicture + ("\n" + plugin("libgazebo_ros_camra.so", "")));
  EXPECT_EQ(read.sensors.size(), 1U);
  EXPECT_THAT(read.messages(), ElementsAre(::testing::AllOf(HasSubstr("r.urdf:5:"),
                                                            HasSubstr("did you mean 'gazebo_ros_camera'?"))));
}

TEST(SensorPlugins, PluginForOtherTypeIsReported) {
  const Read read = Read::of("ray", plugin("libgazebo_ros_camera.so", ""));
  EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("does not fit")));
}

TEST(SensorPlugins, ValuesWithoutEffectAreNoted) {
  const Read read = Read::of(
      "camera", kPicture + plugin("libgazebo_ros_camera.so", "<triggered>true</triggered><Cx>0</Cx>"));
  EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("without effect: triggered")));
}

TEST(SensorPresets, EveryPresetIsReadWithoutWarning) {
  const std::pair<const char*, const char*> kAll[] = {
      {"realsense_d435", "rgbd_camera"}, {"kinect_v1", "depth"},
      {"rplidar_a1", "gpu_lidar"},       {"sick_lms200", "ray"},
      {"hokuyo_urg04lx", "gpu_ray"},     {"bno055", "imu"}};
  for (const auto& [name, type] : kAll) {
    const Read read = Read::of(type, std::string("<doppel:preset>") + name + "</doppel:preset>");
    EXPECT_THAT(read.messages(), ElementsAre()) << name;
    EXPECT_GT(read.one().rate, 0) << name;
  }
}

TEST(SensorPresets, WrittenValueWins) {
  const Read read = Read::of("lidar",
                             "<doppel:preset>sick_lms200</doppel:preset><update_rate>9</update_rate>"
                             "<lidar><range><max>5</max></range></lidar>");
  EXPECT_EQ(read.one().rate, 9);
  EXPECT_EQ(read.what<LidarDescription>().far, 5);
  EXPECT_EQ(read.what<LidarDescription>().horizontal.samples, 181);
  EXPECT_EQ(read.what<LidarDescription>().noise.stddev, 0.005);
}

TEST(SensorPresets, DepthCameraHasNoiseGrowingWithRange) {
  const Read read = Read::of("depth", "<doppel:preset>kinect_v1</doppel:preset>");
  EXPECT_EQ(read.camera().width, 640);
  EXPECT_EQ(read.camera().depth_noise, Eigen::Vector3d(0, 0, 0.001425));
  EXPECT_EQ(read.camera().depth_far, 5);
}

TEST(SensorPresets, UnknownOrUnfitPresetIsReported) {
  EXPECT_THAT(Read::of("imu", "<doppel:preset>bno05</doppel:preset>").messages(),
              ElementsAre(HasSubstr("did you mean 'bno055'?")));
  EXPECT_THAT(Read::of("camera", "<doppel:preset>bno055</doppel:preset>").messages(),
              ElementsAre(HasSubstr("is for <imu>")));
}

// Each would take all memory, or give pictures and scans of numbers that are none.
TEST(SensorReader, SizeBeyondMemoryIsRefusedAtItsElement) {
  const Read picture =
      Read::of("camera", "<camera><image><width>100000</width>\n<height>100000</height></image></camera>");
  EXPECT_EQ(picture.camera().width, 320);
  EXPECT_EQ(picture.camera().height, 240);
  EXPECT_THAT(picture.messages(), ElementsAre(HasSubstr("100000 x 100000 pixels")));

  const Read samples = Read::of("camera",
                                "<camera><image><width>4096</width><height>4096</height>"
                                "<anti_aliasing>64</anti_aliasing></image></camera>");
  EXPECT_EQ(samples.camera().width, 4096);
  EXPECT_EQ(samples.camera().samples, 4);
  EXPECT_THAT(samples.messages(), ElementsAre(HasSubstr("4 are used")));

  const Read scan = Read::of("gpu_lidar",
                             "<lidar><scan><horizontal><samples>50000</samples></horizontal>"
                             "<vertical><samples>50000</samples></vertical></scan></lidar>");
  EXPECT_EQ(scan.what<LidarDescription>().horizontal.samples, 640);
  EXPECT_EQ(scan.what<LidarDescription>().vertical.samples, 1);
  EXPECT_THAT(scan.messages(), ElementsAre(HasSubstr("2500000000 rays")));
}

TEST(SensorReader, ValueOutsideItsRangeIsReportedAndReplaced) {
  const auto lidar = [](const std::string& inner, const std::string& beside = "") {
    return Read::of("gpu_lidar", "<lidar>" + inner + "</lidar>" + beside);
  };
  const Read resolution = lidar("<scan><horizontal><resolution>inf</resolution></horizontal></scan>");
  EXPECT_EQ(resolution.what<LidarDescription>().horizontal.resolution, 1);
  EXPECT_THAT(resolution.messages(), ElementsAre(HasSubstr("not a finite number")));
  const Read angle = lidar("<scan><horizontal><min_angle>inf</min_angle></horizontal></scan>");
  EXPECT_TRUE(std::isfinite(angle.what<LidarDescription>().horizontal.min));
  EXPECT_EQ(angle.messages().size(), 1U);
  const Read noise = lidar("<noise type='gaussian'><stddev>-1</stddev></noise>");
  EXPECT_EQ(noise.what<LidarDescription>().noise.stddev, 0);
  EXPECT_THAT(noise.messages(), ElementsAre(HasSubstr("is negative")));
  const Read dropout = lidar("", "<doppel:dropout>1.5</doppel:dropout>");
  EXPECT_EQ(dropout.what<LidarDescription>().dropout, 0);
  EXPECT_THAT(dropout.messages(), ElementsAre(HasSubstr("is not from 0 to 1")));
  for (const char* latency : {"100", "-1"}) {
    const Read late = lidar("", "<doppel:latency>" + std::string(latency) + "</doppel:latency>");
    EXPECT_EQ(late.sensors.front().latency, 0);
    EXPECT_THAT(late.messages(), ElementsAre(HasSubstr("is not from 0 to 60")));
  }
  const Read far = lidar("<range><max>inf</max></range>");
  EXPECT_EQ(far.what<LidarDescription>().far, HUGE_VAL);
  EXPECT_THAT(far.messages(), ElementsAre());
}

TEST(SensorReader, LensWithoutPictureIsReportedAndReplaced) {
  for (const char* lens :
       {"<intrinsics><fx>0</fx></intrinsics>", "<intrinsics><fx>50</fx><fy>-50</fy></intrinsics>",
        "<type>custom</type><custom_function><c2>0</c2></custom_function>",
        "<type>equidistant</type><cutoff_angle>0</cutoff_angle>",
        "<type>custom</type><scale_to_hfov>false</scale_to_hfov><custom_function><f>0</f></"
        "custom_function>"}) {
    const Read read = Read::of("camera", std::string("<camera><lens>") + lens + "</lens></camera>");
    const CameraIntrinsics k = intrinsics_of(read.camera());
    EXPECT_NEAR(k.fx, 160 / std::tan(1.047 / 2), 1e-9) << lens;
    EXPECT_EQ(k.fy, k.fx) << lens;
    EXPECT_THAT(read.messages(), ElementsAre(HasSubstr("give no picture"))) << lens;
  }
}

}  // namespace
}  // namespace doppel
