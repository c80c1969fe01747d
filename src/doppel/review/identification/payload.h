#pragma once
// A weight of known mass that a recording's robot carries: it fixes the common scale of efforts and inertias
// that positions alone leave free.

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/review/identification/servo_fit.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct Payload {
  double mass = 0;                                    // kg
  std::string link;                                   // empty: the arm's tip
  Eigen::Vector3d p_LoC_L = Eigen::Vector3d::Zero();  // m, its centre of mass in the link's frame
};

// "0.2", "200 g", "200g@0,0,0.06": kg, and the centre of mass in m or with a unit. Throws InputError
// "cli.use".
DOPPEL_API Payload read_payload(const std::string& text, const std::string& link);
// "0.2@0,0,0.06", for read_payload().
DOPPEL_API std::string payload_text(const Payload& payload);

// The weight that a bag of `doppel identify record --payload` names; nullopt: it names none. Throws
// InputError.
DOPPEL_API std::optional<Payload> recorded_payload(const std::string& bag);
// The custom data of a bag that name it.
DOPPEL_API std::map<std::string, std::string> payload_data(const Payload& payload);

// The link's name: that of the payload, or the tip of the only arm. Throws InputError: there is no such link,
// or no single arm.
DOPPEL_API std::string payload_link(const Model& model, const Payload& payload);

// The same robot with the weight, as a point.
DOPPEL_API Model loaded_model(const Model& model, const Payload& payload);

// Records of one joint one after the other, as one: the drive is the same, the loads are not. A gap between
// them lets the drive come to rest. Precondition: not empty.
DOPPEL_API JointRecord joined_records(const std::vector<JointRecord>& records);

}  // namespace doppel
