#pragma once
// Inertias, friction and rotor inertias of a whole arm from a recording of its positions and efforts. Only
// some combinations of the parameters act on the efforts; those are fitted by weighted least squares, with
// intervals. Then the bodies nearest to the described ones are found that a body can be and that have these
// combinations (docs/identification.md).

#include <Eigen/Core>
#include <string>
#include <vector>

#include "doppel/base/math/mass_properties.h"
#include "doppel/export.h"
#include "doppel/review/identification/recorded_motion.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// Positions, rates and efforts at common times, low-pass filtered alike. A row is a sample.
struct TorqueRecord {
  std::vector<double> time;  // s, rising
  double period = 0;         // s, within a part
  std::vector<int> parts;    // behind the last sample of each part that has no gap
  std::vector<int> drives;   // joints of the model, those with efforts
  Eigen::MatrixXd q, v, a;   // [samples, nq], [samples, nv] twice
  Eigen::MatrixXd effort;    // [samples, drives], N m or N
};

// Throws InputError: no efforts are recorded, or all of them are zero.
DOPPEL_API TorqueRecord torque_record(const Model& model, const MeasuredMotion& motion);

// A drive's effort beside that of the links: armature a + viscous v + friction sign(v).
struct DriveLosses {
  double armature = 0, viscous = 0, friction = 0;  // kg m^2, N m s/rad, N m; or kg, N s/m, N
};

enum class BaseVerdict { identified, zero, not_excited };  // zero: no other value than 0 is proven

struct BaseParameter {
  std::string name;                     // "m cx of 'upper' + 0.2 m of 'fore'"
  double value = 0, low = 0, high = 0;  // 95 % interval; kg, kg m, kg m^2, N m ...
  double described = 0;
  BaseVerdict verdict = BaseVerdict::not_excited;
};

// Rms over the held-out samples in which the joint moves, N m or N.
struct TorqueErrors {
  std::string joint;
  double effort = 0;     // of the recorded effort
  double described = 0;  // error of the description,
  double base = 0;       // of the base parameters,
  double physical = 0;   // and of the bodies
  int samples = 0;
};

struct FittedLink {
  int link = -1;
  MassProperties described, fitted;  // in the link frame
};

struct FittedDrive {
  int joint = -1;
  DriveLosses described, fitted;
  bool knows_armature = false, knows_viscous = false, knows_friction = false;
};

struct DOPPEL_API InverseModel {
  int parameters = 0;               // of all links that move and of all drives
  std::vector<BaseParameter> base;  // as many as combinations act on the efforts
  std::vector<TorqueErrors> errors;
  std::vector<FittedLink> links;
  std::vector<FittedDrive> drives;
  double inflation = 1;  // of the variances, by the correlation of the residuals
  int samples = 0;

  [[nodiscard]] DOPPEL_API int count(BaseVerdict verdict) const;
  // The bodies predict the held-out efforts better than the described ones.
  [[nodiscard]] DOPPEL_API bool is_better() const;
};

// `described`: in the order of record.drives. Throws InputError: too few samples in motion.
DOPPEL_API InverseModel fit_inverse_model(const Model& model, const TorqueRecord& record,
                                          const std::vector<DriveLosses>& described,
                                          const Eigen::Vector3d& gravity);

// The parameters that act only together: B [combinations, parameters], whose rows are the base parameters of
// the model in the order of fit_inverse_model().
struct BaseCombinations {
  std::vector<int> links;    // that have inertia and move
  std::vector<int> columns;  // the parameter that each combination is named after
  Eigen::MatrixXd B;         // the parameters: 10 per link, then armature, viscous, friction per drive
};
DOPPEL_API BaseCombinations base_combinations(const Model& model, const std::vector<int>& drives,
                                              const Eigen::Vector3d& gravity);

}  // namespace doppel
