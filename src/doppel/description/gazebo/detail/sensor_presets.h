#pragma once
// Values of real sensors by name: <doppel:preset>realsense_d435</doppel:preset>. What the user writes wins.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"

namespace doppel {

// The elements of the preset that a sensor names, below a root. `element`: of its kind, "camera", "ray", "imu". nullptr: it
// names none, or one that is unknown or for another kind, which is a warning, "sensor.preset". It lives for ever.
const XmlNode* find_preset(const XmlNode& sensor, const std::string& element, Diagnostics& diagnostics);

}  // namespace doppel
