#pragma once
// The motions of a robot that are repeated at several steps, and what is recorded of each.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/physics/engine_modules.h"

namespace doppel {

enum class MotionKind {
  smooth,  // falls without drives, friction, damping, limits and contacts; mimics and slides are fixed, and a
           // floating robot is thrown with a turn, for nothing would move in it else
  fall,    // falls as it is described, in its world, without drives
  hold,    // drives hold the start pose
  move,    // drives follow a quintic of kMoveTime, commanded once a step, to a pose with nothing in the way
};
inline constexpr MotionKind kMotions[] = {MotionKind::smooth, MotionKind::fall, MotionKind::hold,
                                          MotionKind::move};
inline constexpr double kMoveTime = 1.0;  // s

const char* name_of(MotionKind kind);         // "smooth"
const char* description_of(MotionKind kind);  // "falls without drives, friction, ..."

// What moves, and in which world.
struct MotionSubject {
  std::shared_ptr<const RobotDescription> robot;
  std::shared_ptr<const Model> model;
  BaseKind base = BaseKind::fixed;  // that the model was compiled with
  World world;                      // with the step and the integrator that are to be judged
  InstanceOptions options;
  std::string engine = kDefaultEngine;
};

// What is compared of a motion: the position of a free scalar joint, or one of the six of a floating joint,
// whose rotation is the rotation vector from its start.
struct Coordinate {
  std::string name;     // of the joint; "base x", "base turn w"
  bool slides = false;  // m, else rad
  int joint = -1, component = 0;
};

struct MotionRecord {
  bool diverged = false;              // after the last sample
  std::vector<double> time;           // s, of each sample; the first is the start
  std::vector<Eigen::VectorXd> x;     // [samples] [coordinates]
  std::vector<Eigen::Vector3d> tool;  // [samples] p_WT, m
  std::optional<double>
      touches_after;        // s: contacts that there were not at the start; only where it was asked for
  double energy_drift = 0;  // largest, of the largest kinetic energy; smooth only
};

// One kind of motion of a subject. smooth has a model of its own.
class Motion {
 public:
  // `tool`: a link of the model. Throws InputError where the engine refuses the robot.
  Motion(const MotionSubject& subject, MotionKind kind, const std::string& tool);

  [[nodiscard]] const Model& model() const { return *model_; }
  [[nodiscard]] const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  // The motion over `duration` s at world.step / `fineness`, sampled at every world.step. `offset`: added to
  // the start of every free joint, rad or m. `contacts`: they are looked for too.
  [[nodiscard]] MotionRecord run(double duration, int fineness, double offset = 0,
                                 bool contacts = false) const;

 private:
  [[nodiscard]] Eigen::VectorXd pose_beside(double way) const;
  [[nodiscard]] std::unique_ptr<Engine> engine(const WorldSettings& settings) const;
  [[nodiscard]] bool touches(Instance robot, const Eigen::VectorXd& goal) const;
  void command(Instance robot, double time) const;
  void list_coordinates();
  void sample(const Instance& robot, double time, MotionRecord& out) const;

  MotionKind kind_;
  std::string engine_;
  std::shared_ptr<const Model> model_;
  WorldSettings world_;
  std::vector<ModelInstance> instances_;  // the robot, then objects
  int tool_ = 0;
  std::vector<Coordinate> coordinates_;
  Eigen::VectorXd start_, goal_;  // [nq]
};

// The link whose motion people look at: one with a tool's name (tool0, tcp, ee_link, ...), else the one
// behind the most driven joints.
std::string choose_tool(const Model& model);

}  // namespace doppel
