#pragma once
// What a link weighs: the <inertial> as written where it can be simulated, else a repaired one, which is
// reported.

#include <optional>
#include <string>

#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"
#include "doppel/math/mass_properties.h"

namespace doppel {

// Why no rigid body can have this mass and tensor, in words; empty: one can. The tensor's principal moments
// must be positive and none larger than the sum of the others.
DOPPEL_API std::string physical_defect(const MassProperties& body);

// The nearest tensor that a rigid body can have: same principal axes, moments raised to at least 1e-3 of the
// largest and, where one exceeds the sum of the others, the others raised by half of the excess.
DOPPEL_API MassProperties physical_repair(const MassProperties& body);

// The link's own inertia in the link frame. Absent where nothing was written or the mass is not positive; a
// tensor that no body can have is repaired. Both are said: warning "model.not_physical". A tensor that is not
// written (the parser said so) is that of the link's solid at the written mass and centre of mass, else a
// ball's.
DOPPEL_API std::optional<MassProperties> link_inertia(const Link& link, Diagnostics& diagnostics);

}  // namespace doppel
