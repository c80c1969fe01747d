#pragma once
// A type's description as a message, as rosidl_generator_type_description (Jazzy) generates it: the response
// of ~/get_type_description, and the input of a type's hash.

#include "doppel/export.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/type_description.h"
#include "doppel/ros/messages/type_description_interfaces.h"

namespace doppel {

using TypeDescriptionMessage = type_description_interfaces::msg::TypeDescription;

// rosidl's ids in FieldType.msg: a kind's own, and what a list of it adds.
inline constexpr std::uint8_t kArrayId = 48, kBoundedSequenceId = 96, kUnboundedSequenceId = 144;
DOPPEL_API std::uint8_t type_id(const FieldDescription& field);

// The field that rosidl gives to a type without fields.
inline constexpr std::string_view kOnlyMember = "structure_needs_at_least_one_member";

// Default values are only included for single numbers other than zero; hashes do not depend on them.
DOPPEL_API TypeDescriptionMessage description_message(const TypeDescription& type);
DOPPEL_API TypeDescriptionMessage description_message(const ServiceSupport& service);
DOPPEL_API TypeDescriptionMessage description_message(const ActionSupport& action);

// The sources of the types, in the same order: as in .msg, .srv and .action files, without comments and
// default values. Types that rosidl derives have none ("implicit").
using TypeSources = std::vector<type_description_interfaces::msg::TypeSource>;
DOPPEL_API TypeSources type_sources(const TypeDescription& type);
DOPPEL_API TypeSources type_sources(const ServiceSupport& service);
DOPPEL_API TypeSources type_sources(const ActionSupport& action);

}  // namespace doppel
