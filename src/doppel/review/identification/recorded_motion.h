#pragma once
// A recording of a running robot as the record of one joint that fit_servo() needs:
// command and position by their stamps, load and inertia of the model along the measured motion.

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/servo.h"
#include "doppel/review/identification/servo_fit.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/ros/record/bag_reader.h"

namespace doppel {

struct PositionCurve {
  std::vector<double> time;      // s, rising
  std::vector<double> position;  // rad or m; of an effort N m or N
};

// A short release of the joint's torque, see JointRelease; the same clock as that of the curves.
struct RecordedRelease {
  double torque_off = 0, torque_on = 0;  // s
  double caught = 0;                     // rad or m
};

struct MeasuredMotion {
  std::map<std::string, PositionCurve> commanded, measured;           // by joint
  std::map<std::string, PositionCurve> efforts;                       // those of joint_states
  std::map<std::string, std::vector<RecordedRelease>> released = {};  // ended ones, by joint
};

// Measured: sensor_msgs/msg/JointState of topics joint_states. Commanded: the outputs, else the references,
// of control_msgs/msg/JointTrajectoryControllerState, and sensor_msgs/msg/JointState of topics whose name
// ends with joint_command or joint_commands. Released: doppel_msgs/msg/Devices. Times are those of the
// headers' stamps, or of the recording where a stamp is zero.
DOPPEL_API MeasuredMotion read_recorded_motion(BagReader& bag);

// False: the command stays, but for what a controller corrects when it takes joints over.
DOPPEL_API bool is_moved(const ModelJoint& joint, const PositionCurve& command);

// The part of the motion in which the joint is commanded to move. gravity: m/s^2, in the root link's axes.
// Precondition: the model has the joint, and it is scalar. Throws InputError: no command or no position is
// recorded, or the command does not change.
DOPPEL_API JointRecord joint_record(const Model& model, const std::string& joint,
                                    const MeasuredMotion& motion, const Eigen::Vector3d& gravity);

// The values at which a fit starts: the description's servo and friction; limits that it does not have are
// beyond those of the record.
DOPPEL_API ServoValues start_values(const ModelJoint& joint, const ServoParameters& servo,
                                    const JointRecord& record);

}  // namespace doppel
