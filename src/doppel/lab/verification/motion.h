#pragma once
// The motions of a robot that are repeated at several steps, and their records.

#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/engine_modules.h"

namespace doppel {

enum class MotionKind {
  smooth,  // falls without drives, friction, damping, limits and contacts; mimics and slides are fixed, and a
           // floating robot is thrown with a rotation, because its joints would not move otherwise
  fall,    // falls as described, in its world, without drives
  hold,    // drives hold the start pose
  move,    // drives follow a quintic of kMoveTime, commanded once a step, to a pose on a free path
  path,    // drives follow MotionSubject::path, commanded once a step
};
// The motions that need only a robot.
inline constexpr MotionKind kMotions[] = {MotionKind::smooth, MotionKind::fall, MotionKind::hold,
                                          MotionKind::move};
inline constexpr double kMoveTime = 1.0;  // s

DOPPEL_API const char* name_of(MotionKind kind);         // "smooth"
DOPPEL_API const char* description_of(MotionKind kind);  // "falls without drives, friction, ..."

// Positions of joints by time, linear in between; before the first time linear from the robot's start.
struct JointPath {
  std::vector<std::string> joints;
  std::vector<double> times;                   // s, rising
  std::vector<std::vector<double>> positions;  // [times][joints] rad or m
};

// The robot of a motion, its world and its engine.
struct MotionSubject {
  ModelInstance robot;                // motions start at its pose at reset
  std::vector<ModelInstance> others;  // the other instances of the world
  WorldSettings world;                // with the step and the integrator to be verified
  std::string engine = kDefaultEngine;
  JointPath path;
};

// A compared quantity of a motion: the position of a free scalar joint, or one of the six components of a
// floating joint, whose rotation is the rotation vector from its start.
struct Coordinate {
  std::string name;     // of the joint; "base x", "base turn w"
  bool slides = false;  // m, else rad
  int joint = -1, component = 0;
};

struct MotionRecord {
  bool diverged = false;                // after the last sample
  std::vector<double> time;             // s, of each sample; the first is the start
  std::vector<Eigen::VectorXd> x;       // [samples] [coordinates] rad or m
  std::vector<Eigen::Vector3d> tool;    // [samples] p_WT, m
  std::optional<double> touches_after;  // s: first contact that did not exist at the start; only on request
  double energy_drift = 0;              // largest, of the largest kinetic energy; smooth only
};

// One kind of motion of a subject. smooth uses a modified model.
class DOPPEL_API Motion {
 public:
  // `tool`: a link of the model. Throws InputError if the engine rejects the robot.
  Motion(const MotionSubject& subject, MotionKind kind, const std::string& tool);

  // The same motion as `plan`, from its start to its goal, which another engine has found free of contacts.
  Motion(const MotionSubject& subject, const Motion& plan, const std::string& tool);

  [[nodiscard]] const Model& model() const { return *robot_.model; }
  [[nodiscard]] const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  // The motion over `duration` s at world.step / `fineness`, sampled at every world.step. `offset`: added to
  // the start of every free joint, rad or m. `contacts`: also records MotionRecord::touches_after.
  [[nodiscard]] MotionRecord run(double duration, int fineness, double offset = 0,
                                 bool contacts = false) const;

 private:
  // The robot is instance 0.
  [[nodiscard]] std::unique_ptr<Engine> make_engine(Duration step) const;
  [[nodiscard]] Eigen::VectorXd pose_beside(double way) const;
  [[nodiscard]] bool touches(Engine& engine, const Eigen::VectorXd& goal) const;
  void command(Instance robot, double time) const;
  void command_path(Instance robot, double time) const;
  void list_coordinates();
  void sample(const Instance& robot, double time, MotionRecord& out) const;

  MotionKind kind_;
  ModelInstance robot_;
  std::vector<ModelInstance> others_;
  WorldSettings world_;
  std::string engine_;
  JointPath path_;
  int tool_ = 0;
  std::vector<Coordinate> coordinates_;
  Eigen::VectorXd start_, goal_;  // [nq]
};

// The link whose motion is reported: one with a tool's name (tool0, tcp, ee_link, ...), else the one behind
// the most driven joints.
DOPPEL_API std::string choose_tool(const Model& model);

}  // namespace doppel
