#pragma once
// Private to the bridge: conversion of the types of the bus and the registry to those of the network.

#include <string>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/network/service.h"

namespace doppel::ros2 {

DOPPEL_API QosProfile to_profile(const Qos& qos);
// "RIHS01_..."; "" for an unknown type.
DOPPEL_API std::string message_hash(std::string_view type);
DOPPEL_API ServiceSpec service_spec(std::string_view name, std::string_view type);

}  // namespace doppel::ros2
