#pragma once
// vision_msgs 4 (Jazzy): what is detected in a picture. Pixels, and m.

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::vision_msgs::msg {

struct Point2D {
  double x = 0, y = 0;
  DOPPEL_MESSAGE("vision_msgs/msg/Point2D", x, y)
};

struct Pose2D {
  Point2D position;
  double theta = 0;  // rad
  DOPPEL_MESSAGE("vision_msgs/msg/Pose2D", position, theta)
};

struct BoundingBox2D {
  Pose2D center;
  double size_x = 0, size_y = 0;  // before the turn by theta
  DOPPEL_MESSAGE("vision_msgs/msg/BoundingBox2D", center, size_x, size_y)
};

struct ObjectHypothesis {
  std::string class_id;
  double score = 0;  // 0..1
  DOPPEL_MESSAGE("vision_msgs/msg/ObjectHypothesis", class_id, score)
};

struct ObjectHypothesisWithPose {
  ObjectHypothesis hypothesis;
  geometry_msgs::msg::PoseWithCovariance pose;
  DOPPEL_MESSAGE("vision_msgs/msg/ObjectHypothesisWithPose", hypothesis, pose)
};

struct Detection2D {
  std_msgs::msg::Header header;
  std::vector<ObjectHypothesisWithPose> results;
  BoundingBox2D bbox;
  std::string id;  // the same for an object in all pictures
  DOPPEL_MESSAGE("vision_msgs/msg/Detection2D", header, results, bbox, id)
};

struct Detection2DArray {
  std_msgs::msg::Header header;
  std::vector<Detection2D> detections;
  DOPPEL_MESSAGE("vision_msgs/msg/Detection2DArray", header, detections)
};

struct BoundingBox3D {
  geometry_msgs::msg::Pose center;
  geometry_msgs::msg::Vector3 size;  // in the axes of the box
  DOPPEL_MESSAGE("vision_msgs/msg/BoundingBox3D", center, size)
};

struct Detection3D {
  std_msgs::msg::Header header;
  std::vector<ObjectHypothesisWithPose> results;
  BoundingBox3D bbox;
  std::string id;  // the same for an object in all pictures
  DOPPEL_MESSAGE("vision_msgs/msg/Detection3D", header, results, bbox, id)
};

struct Detection3DArray {
  std_msgs::msg::Header header;
  std::vector<Detection3D> detections;
  DOPPEL_MESSAGE("vision_msgs/msg/Detection3DArray", header, detections)
};

}  // namespace doppel::vision_msgs::msg
