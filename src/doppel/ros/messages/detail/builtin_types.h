#pragma once
// The tables that generate_messages writes from definitions/, and the types that they describe.

#include <cstddef>
#include <cstdint>
#include <span>

#include "doppel/ros/messages/action_msgs.h"
#include "doppel/ros/messages/codec.h"

namespace doppel::messages_detail {

struct FieldRow {
  const char* name;
  FieldKind kind;
  FieldShape shape;
  std::uint32_t size;        // of an array, or the bound of a sequence; 0: none
  std::uint32_t text_bound;  // 0: none
  std::uint32_t type;        // of a message: its row
  double initial;
  DistroRange range;
};

struct ConstantRow {
  const char* name;
  FieldKind kind;
  std::int64_t value;
  const char* text;
};

struct TypeRow {
  const char* name;
  std::span<const FieldRow> fields;
  std::span<const ConstantRow> constants;
};

extern const std::span<const TypeRow> kBuiltinTypes;  // generated

// The type of a row. Any thread.
const TypeSupport& builtin_type_at(std::size_t row);

// Enters all types, services and actions of the tables; generated.
void register_builtin_types();

// Including the types that rosidl derives from an action.
template <Action A>
void register_action_types() {
  register_action(action_support<A>());
  register_service(service_support<SendGoal<A>>());
  register_service(service_support<GetResult<A>>());
  register_type(type_support<FeedbackMessage<A>>());
}

}  // namespace doppel::messages_detail
