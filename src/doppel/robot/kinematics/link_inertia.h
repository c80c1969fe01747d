#pragma once
// The mass properties of a link: <inertial> as written if it can be simulated, else a repaired one with a
// warning. Masses in kg, tensors in kg m^2.

#include <optional>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/mass_properties.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// The reason, as a sentence, why no rigid body can have this mass and tensor; empty: one can. The mass and
// the principal moments must be positive, and no moment larger than the sum of the others.
DOPPEL_API std::string physical_defect(const MassProperties& body);

// The nearest tensor that a rigid body can have: same principal axes, moments raised to at least 1e-3 of the
// largest and, where one exceeds the sum of the others, the others raised by half of the excess.
DOPPEL_API MassProperties physical_repair(const MassProperties& body);

// The link's inertia about its centre of mass, in link axes; the centre of mass in the link frame, m. Absent
// without <inertial> or with a mass that is not positive; a tensor that no body can have is repaired. The
// last two are warnings "model.not_physical". Without a written tensor (the parser has warned), the link's
// solid or a ball is used at the written mass and centre of mass.
DOPPEL_API std::optional<MassProperties> link_inertia(const Link& link, Diagnostics& diagnostics);

}  // namespace doppel
