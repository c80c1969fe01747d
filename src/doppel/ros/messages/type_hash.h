#pragma once
// ROS 2's type hashes, version RIHS01 (REP 2016): "RIHS01_" and the SHA-256 in hexadecimal of the JSON of the
// type's description without default values, as rosidl_generator_type_description (Jazzy) writes it.
// Constants are not part of it. These functions compute a hash; TypeSupport, ServiceSupport and ActionSupport
// store theirs (hash()).

#include <string>

#include "doppel/export.h"
#include "doppel/ros/messages/type_description_message.h"

namespace doppel {

DOPPEL_API std::string type_hash(
    const TypeDescriptionMessage& type);  // of checked names, referenced types sorted
DOPPEL_API std::string type_hash(const TypeDescription& type);
DOPPEL_API std::string service_type_hash(const ServiceSupport& service);
DOPPEL_API std::string action_type_hash(const ActionSupport& action);

}  // namespace doppel
