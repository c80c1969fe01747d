#pragma once
// The engine with the names of its instances in messages and services: which of them are robots, and the
// frame "world". The loop's thread.

#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class DOPPEL_API Scene {
 public:
  // `robots`: the instances that are robots, in the twin's order. `root`: the one without a namespace, whose
  // frames have no prefix in TF; empty: none.
  void show(Engine& engine, std::vector<std::string> robots, std::string root);

  [[nodiscard]] Engine& engine() const { return *engine_; }
  [[nodiscard]] Time now() const { return engine_->time(); }
  [[nodiscard]] const std::vector<int>& robots() const { return robots_; }  // instances
  // Instances that are not robots.
  [[nodiscard]] const std::vector<int>& objects() const { return objects_; }
  [[nodiscard]] bool is_robot(int instance) const;
  [[nodiscard]] bool is_object(int instance) const;
  [[nodiscard]] Instance instance(int index) const { return engine_->instance(index); }
  // A robot or an object; -1: none.
  [[nodiscard]] int find(std::string_view name) const { return engine_->world().find(name); }

  // X_TW: the engine's world in TF's "world". If the robot without a namespace has a link "world", TF's
  // "world" is that link, at its pose of the world file; else it is the engine's world.
  [[nodiscard]] Pose world_in_tf() const;

  // The unique name of a robot's joint or link among all robots: "left::Revolute 1", or the name alone for a
  // robot without a namespace.
  [[nodiscard]] std::string scoped(int robot, const std::string& name) const;

 private:
  Engine* engine_ = nullptr;
  std::vector<int> robots_, objects_;
  int root_ = -1;
};

}  // namespace doppel
