#pragma once
// The operations of an overlay that an inverse model leads to.

#include <vector>

#include "doppel/description/overlay/operation.h"
#include "doppel/export.h"
#include "doppel/review/identification/inverse_model.h"
#include "doppel/review/identification/payload.h"

namespace doppel {

// The body without the weight that the model was fitted with. A body that is lighter than the weight keeps
// its described properties.
DOPPEL_API void remove_payload(FittedLink& link, const Payload& payload, const ModelLink& described);

// set_inertia of each link whose body is another one than described, and set_servo of each drive whose losses
// are identified. Only together do the bodies predict the efforts, which the reason says.
DOPPEL_API std::vector<Operation> dynamics_operations(const RobotDescription& robot, const Model& model,
                                                      const InverseModel& fit);

}  // namespace doppel
