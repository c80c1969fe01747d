// The same camera in every spelling of Gazebo classic and gz-sim makes the same picture, byte for byte.
#include <gmock/gmock.h>

#include <algorithm>

#include "doppel/description/gazebo/sensor_reader.h"
#include "doppel/description/urdf/load.h"
#include "light_fixture.h"

namespace doppel {
namespace {

struct Spelling {
  const char* what;
  const char* type;
  const char* tags;    // of the sensor
  const char* plugin;  // of classic: filename and content; empty: none
  const char* content;
  const char* topic;  // of the picture
};

constexpr Spelling kSpellings[] = {
    {"gz-sim", "camera", "", "", "", "/eye/image_raw"},
    {"gz-sim with a topic", "camera", "<topic>view</topic>", "", "", "/view"},
    {"ignition", "camera", "<ignition_frame_id>head</ignition_frame_id>", "", "", "/eye/image_raw"},
    {"gz frame", "camera", "<gz_frame_id>head</gz_frame_id>", "", "", "/eye/image_raw"},
    {"wide angle", "wideanglecamera", "", "", "", "/eye/image_raw"},
    {"rgbd", "rgbd_camera", "", "", "", "/eye/image"},
    {"classic, ROS 2", "camera", "", "libgazebo_ros_camera.so",
     "<ros><namespace>n</namespace></ros><camera_name>c</camera_name>", "/n/c/image_raw"},
    {"classic, ROS 2, depth", "depth", "", "libgazebo_ros_camera.so", "", "/eye/image_raw"},
    {"classic, ROS 1", "camera", "", "libgazebo_ros_camera.so",
     "<robotNamespace>n</robotNamespace><cameraName>c</cameraName><imageTopicName>i</imageTopicName>",
     "/n/c/i"},
    {"classic, ROS 1, Kinect", "depth", "", "libgazebo_ros_openni_kinect.so",
     "<cameraName>c</cameraName><imageTopicName>rgb</imageTopicName>", "/c/rgb"},
    {"classic, ROS 1, depth camera", "depth", "", "libgazebo_ros_depth_camera.so",
     "<cameraName>c</cameraName>", "/c/ir/image_raw"},
    {"classic, triggered", "camera", "", "libgazebo_ros_triggered_camera.so", "<cameraName>c</cameraName>",
     "/c/image_raw"},
    {"classic, several cameras", "multicamera", "", "libgazebo_ros_multicamera.so",
     "<cameraName>c</cameraName>", "/c/image_raw"},
};

std::string urdf_of(const Spelling& spelling) {
  std::string plugin;
  if (*spelling.plugin != '\0')
    plugin =
        std::string("<plugin name='p' filename='") + spelling.plugin + "'>" + spelling.content + "</plugin>";
  return std::string(
             "<robot name='pole'><link name='head'><inertial><mass value='1'/><inertia ixx='1' ixy='0' "
             "ixz='0' "
             "iyy='1' iyz='0' izz='1'/></inertial></link><gazebo reference='head'><sensor name='eye' "
             "type='") +
         spelling.type + "'><update_rate>10</update_rate>" + spelling.tags +
         "<camera "
         "name='one'><horizontal_fov>1.1</horizontal_fov><image><width>48</width><height>32</height></image>"
         "<distortion><k1>-0.1</k1></distortion><noise><type>gaussian</type><stddev>0.02</stddev></noise></"
         "camera>" +
         plugin + "</sensor></gazebo></robot>";
}

World room_with_ball() {
  World world = test::empty_space();
  world.gravity.setZero();
  WorldObject ball;
  ball.name = "ball";
  ball.shape = Sphere{0.5};
  ball.X_WO.translation() = Eigen::Vector3d(2, 0.2, 0.1);
  world.objects.push_back(ball);
  return world;
}

std::vector<std::uint8_t> picture_of(const Spelling& spelling) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  const RobotDescription robot = parse_urdf(urdf_of(spelling), "pole.urdf", resolver, diagnostics);
  const std::vector<SensorDescription> sensors = read_sensors(robot, diagnostics);
  if (sensors.size() != 1) return {};
  test::LightTwin twin({RigSensor{sensors.front(), "pole", 0, "", "head", Pose::Identity(), ""}},
                       {.seed = 3, .lockstep = true}, robot, room_with_ball());
  std::vector<sensor_msgs::msg::Image> pictures;
  twin.read(spelling.topic, pictures);
  twin.run(0.11);
  return pictures.empty() ? std::vector<std::uint8_t>{} : pictures.back().data;
}

TEST(LightRig, SameCameraInEverySpellingMakesSameBytes) {
  const std::vector<std::uint8_t> first = picture_of(kSpellings[0]);
  ASSERT_EQ(first.size(), 48U * 32 * 3);
  EXPECT_NE(*std::ranges::max_element(first), *std::ranges::min_element(first));
  for (const Spelling& spelling : kSpellings) EXPECT_TRUE(picture_of(spelling) == first) << spelling.what;
}

}  // namespace
}  // namespace doppel
