// Fuzz target: bytes to XML to URDF to Model to poses. Every model that compiles can be used in computations.
#include <cstdint>
#include <cstdlib>

#include "doppel/description/urdf/load.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/kinematics/kinematics.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static doppel::PackageResolver resolver;
  try {
    doppel::Diagnostics diagnostics;
    const doppel::RobotDescription robot =
        doppel::parse_urdf({reinterpret_cast<const char*>(data), size}, "robot.urdf", resolver, diagnostics);
    const doppel::Model model = doppel::compile_model(robot, doppel::BaseKind::fixed, diagnostics);
    doppel::Data workspace(model);
    const Eigen::VectorXd q = model.neutral(), v = Eigen::VectorXd::Zero(model.nv);
    if (q.size() != model.nq || model.joints.size() + 1 != model.links.size()) std::abort();
    doppel::forward_kinematics(model, workspace, q);
    doppel::mass_matrix(model, workspace, q);
  } catch (const doppel::InputError&) {
  }
  return 0;
}
