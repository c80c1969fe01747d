#pragma once
// Messages without a counterpart in ROS 2: the status of the twin's loop, and the state of
// the whole simulation.

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::doppel_msgs::msg {

struct TwinStatus {
  double sim_time = 0;          // s
  double wall_time = 0;         // s of wall-clock time since the start of the run
  std::uint64_t steps = 0;      // since the start; a reset does not set them back
  double real_time_factor = 0;  // over the last half second; 0 while paused
  bool paused = false;
  double speed = 0;                                             // requested factor; 0: as fast as possible
  double lateness_p50 = 0, lateness_p99 = 0, lateness_max = 0;  // s, of steps relative to wall-clock time
  // Wall-clock time per step by activity, mean over the last half second, microseconds; 0 while paused.
  // control: hardware and controllers, including their publishing; physics: the engine's step; publish: /tf
  // and /clock; bus: between steps (services, received messages, reports); idle: sleeping until the next
  // step is due.
  double time_control = 0, time_physics = 0, time_publish = 0, time_bus = 0, time_idle = 0;
  std::uint64_t overruns = 0;  // how often the loop was 100 ms late and its schedule was moved
  std::uint64_t skipped = 0;   // messages that were skipped for slow clients
  std::string divergence;      // why the physics is paused at its last finite state; empty: it is not
  std::vector<std::string> real_hardware;  // namespaces of the robots that drive it; "": without namespace
  DOPPEL_MESSAGE("doppel_msgs/msg/TwinStatus", sim_time, wall_time, steps, real_time_factor, paused, speed,
                 lateness_p50, lateness_p99, lateness_max, time_control, time_physics, time_publish, time_bus,
                 time_idle, overruns, skipped, divergence, real_hardware)
};

// The load of each driven joint; N m or N. One element of each list per joint.
struct JointLoads {
  std_msgs::msg::Header header;
  std::vector<std::string> joint_names;
  std::vector<double> efforts;          // of the drives in the last step
  std::vector<double> gravity_torques;  // load of gravity on the drives at rest in this pose
  std::vector<double> sags;             // rad or m: offset of the joint from its target by gravity
  std::vector<double> margins;          // effort limit - |gravity torque|; negative: cannot hold
  std::vector<double> effort_limits;    // infinite: none
  std::vector<double> frictions;        // the most that Coulomb friction can hold
  std::vector<double>
      least_sags;                 // sag less and plus friction / stiffness: the joint rests anywhere between;
  std::vector<double> most_sags;  // all three are 0 where it rests on its limit
  DOPPEL_MESSAGE("doppel_msgs/msg/JointLoads", header, joint_names, efforts, gravity_torques, sags, margins,
                 effort_limits, frictions, least_sags, most_sags)
};

// A sensor of a twin.
struct Sensor {
  std::string name;                  // "kate/camera_link/camera": robot, link, sensor
  std::string type;                  // "gpu_lidar", as described
  std::vector<std::string> topics;   // the first is that of its data
  std::string frame;                 // of its headers
  double rate = 0;                   // Hz that are asked for; 0: every step
  double reached = 0;                // Hz of simulated time over the last second; 0: not read
  std::uint64_t samples = 0;         // made so far
  std::uint64_t left_out = 0;        // because they took too long
  double cost = 0;                   // s of processor time of the last sample
  std::uint64_t revision = 0;        // another one when an edit has changed a value of the sensor
  std::string origin_frame;          // of TF, where the sensor is fixed
  geometry_msgs::msg::Point origin;  // m, of the sensor in that frame: about it is the torque of a wrench
  DOPPEL_MESSAGE("doppel_msgs/msg/Sensor", name, type, topics, frame, rate, reached, samples, left_out, cost,
                 revision, origin_frame, origin)
};

struct Sensors {
  std::vector<Sensor> sensors;
  DOPPEL_MESSAGE("doppel_msgs/msg/Sensors", sensors)
};

// A light of the world. Source: SDFormat 1.11, light.
struct Light {
  static constexpr std::uint8_t POINT = 0, DIRECTIONAL = 1, SPOT = 2;
  std::string name;
  std::uint8_t kind = POINT;
  geometry_msgs::msg::Point position;     // m, in the frame "world"
  geometry_msgs::msg::Vector3 direction;  // unit; of directional and spot lights
  std_msgs::msg::ColorRGBA diffuse, specular;
  double intensity = 1;
  double range = 0;  // m
  double attenuation_constant = 1, attenuation_linear = 0, attenuation_quadratic = 0;
  double inner_angle = 0, outer_angle = 0, falloff = 0;  // rad, full angles of a spot light
  bool cast_shadows = false;
  DOPPEL_MESSAGE("doppel_msgs/msg/Light", name, kind, position, direction, diffuse, specular, intensity,
                 range, attenuation_constant, attenuation_linear, attenuation_quadratic, inner_angle,
                 outer_angle, falloff, cast_shadows)
  DOPPEL_CONSTANTS(POINT, DIRECTIONAL, SPOT)
};

// The properties of a material that a marker of /doppel/objects cannot express. Maps are URIs, empty: none.
struct PhysicalMaterial {
  std::int32_t marker = 0;  // the marker's id
  std_msgs::msg::ColorRGBA emissive;
  double roughness = -1, metalness = -1;  // 0..1; negative: not written
  std::string normal_map, roughness_map, metalness_map, emissive_map;
  DOPPEL_MESSAGE("doppel_msgs/msg/PhysicalMaterial", marker, emissive, roughness, metalness, normal_map,
                 roughness_map, metalness_map, emissive_map)
};

// The surface of a heightmap, in the axes of its marker. Points [rows][columns], the first at (-size_x / 2, -size_y / 2),
// the second further along x.
struct Terrain {
  std::int32_t marker = 0;  // the marker's id
  std::uint32_t columns = 0, rows = 0;
  double size_x = 0, size_y = 0;                   // m
  std::vector<float> heights;                      // m
  std::vector<std::string> textures, normal_maps;  // URIs, from the lowest to the highest; "": none
  std::vector<double> texture_sizes;               // m, of one repetition
  std::vector<double> blend_heights,
      blend_distances;  // m: where the next texture begins and after how much it is alone
  DOPPEL_MESSAGE("doppel_msgs/msg/Terrain", marker, columns, rows, size_x, size_y, heights, textures,
                 normal_maps, texture_sizes, blend_heights, blend_distances)
};

// The appearance of the world beside the markers of /doppel/objects.
struct Scene {
  bool has_environment =
      false;  // false: the world has no <scene>, and the fields up to `sunset` are not used
  std_msgs::msg::ColorRGBA ambient, background;
  bool shadows = true, sky = false;
  double time = 0, sunrise = 0, sunset = 0;  // h, of the sky
  std::vector<Light> lights;                 // empty: those of the viewer
  std::vector<PhysicalMaterial> materials;
  std::vector<Terrain> terrains;
  DOPPEL_MESSAGE("doppel_msgs/msg/Scene", has_environment, ambient, background, shadows, sky, time, sunrise,
                 sunset, lights, materials, terrains)
};

}  // namespace doppel::doppel_msgs::msg

namespace doppel::doppel_msgs::srv {

struct Step {
  struct Request {
    std::uint32_t steps = 1;
    DOPPEL_MESSAGE("doppel_msgs/srv/Step_Request", steps)
  };
  struct Response {
    bool success = false;
    std::string message;
    double sim_time = 0;  // s, after the steps
    DOPPEL_MESSAGE("doppel_msgs/srv/Step_Response", success, message, sim_time)
  };
};

struct SetSpeed {
  struct Request {
    double factor = 1;  // of real time; 0: as fast as possible
    DOPPEL_MESSAGE("doppel_msgs/srv/SetSpeed_Request", factor)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("doppel_msgs/srv/SetSpeed_Response", success, message)
  };
};

// rad or m, rad/s or m/s, N m or N
struct GetState {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("doppel_msgs/srv/GetState_Request")
  };
  struct Response {
    double sim_time = 0;  // s
    std::vector<std::string> names;
    std::vector<double> positions, velocities, efforts;
    DOPPEL_MESSAGE("doppel_msgs/srv/GetState_Response", sim_time, names, positions, velocities, efforts)
  };
};

struct SetState {
  struct Request {
    std::vector<std::string> names;
    std::vector<double> positions;
    std::vector<double> velocities;  // empty: at rest
    DOPPEL_MESSAGE("doppel_msgs/srv/SetState_Request", names, positions, velocities)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("doppel_msgs/srv/SetState_Response", success, message)
  };
};

}  // namespace doppel::doppel_msgs::srv
