#pragma once
// The command lines of spawners: of models in simulators, of controllers, of fixed transforms.

#include <optional>
#include <string>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/scenario/launch/launch_description.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

// A model that is put into a simulator, by gazebo_ros' spawn_entity.py and spawn_model, or ros_gz_sim's
// create.
struct ModelSpawn {
  std::string topic;     // that has the description; ROS 1: the parameter
  std::string file;      // URDF or SDF
  std::string text;      // the description itself
  std::string database;  // a model's name
  std::string name, name_space;
  std::optional<Pose> X_WR;
};
ModelSpawn model_spawn(const std::vector<std::string>& words);
// The same from the parameters of create (name, topic, file, x, y, z, R, P, Y) or the arguments of a launch
// file.
ModelSpawn model_spawn(const NamedTexts& values);

struct ControllerSpawn {
  std::vector<std::string> names;
  std::vector<std::string> files;
  std::string manager;  // "/left/controller_manager"
  bool active = true;
};
ControllerSpawn controller_spawn(const std::vector<std::string>& words);

// nullopt: it is not complete.
std::optional<StaticTransform> static_transform(const std::vector<std::string>& words);

// The world of `gz sim ARGUMENTS` and of Gazebo's server; empty: its default.
std::string world_of_command(const std::vector<std::string>& words);
std::vector<std::string> split_words(const std::string& text);

}  // namespace doppel
