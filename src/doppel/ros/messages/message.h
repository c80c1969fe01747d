#pragma once
// A message is a plain struct named as in ROS 2, with a list of its fields, from which CDR, JSON, YAML,
// schema text and the type hash are derived. The built-in ones are generated from definitions/
// (generator/definition.h describes the text). A message of another library is one struct:
//
//   namespace my_msgs::msg {
//   struct Grip {
//     double width = 0;
//     std::vector<std::string> fingers;
//     DOPPEL_MESSAGE("my_msgs/msg/Grip", width, fingers)
//   };
//   }
//
// A service is a struct with nested Request and Response, an action one with nested Goal, Result and
// Feedback; their types are called "<pkg>/srv/<Name>_Request" and so on, as ROS 2 does. Field types:
// bool, std::byte, (u)int8..64, float, double, char16_t, std::string, std::u16string, other messages,
// std::vector<T> of these, std::array<T, N>, and BoundedString<N>, BoundedVector<T, N> where a .msg
// file specifies <=N.

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/messages/distro.h"

// visit("first", self.first); visit("second", self.second); ... for at most 64 fields: each of the repeated
// expansions begins the macro anew with the rest of the list.
#define DOPPEL_PARENTHESES ()
#define DOPPEL_EXPAND(...) DOPPEL_EXPAND_4(DOPPEL_EXPAND_4(DOPPEL_EXPAND_4(DOPPEL_EXPAND_4(__VA_ARGS__))))
#define DOPPEL_EXPAND_4(...) DOPPEL_EXPAND_3(DOPPEL_EXPAND_3(DOPPEL_EXPAND_3(DOPPEL_EXPAND_3(__VA_ARGS__))))
#define DOPPEL_EXPAND_3(...) DOPPEL_EXPAND_2(DOPPEL_EXPAND_2(DOPPEL_EXPAND_2(DOPPEL_EXPAND_2(__VA_ARGS__))))
#define DOPPEL_EXPAND_2(...) __VA_ARGS__
#define DOPPEL_VISIT(field, ...) \
  visit(#field, self.field);     \
  __VA_OPT__(DOPPEL_VISIT_REST DOPPEL_PARENTHESES(__VA_ARGS__))
#define DOPPEL_VISIT_REST() DOPPEL_VISIT
#define DOPPEL_FOR_EACH_FIELD(...) DOPPEL_EXPAND(DOPPEL_VISIT(__VA_ARGS__))

// At least one field.
#define DOPPEL_MESSAGE(type_name, ...)                      \
  static constexpr std::string_view kType = type_name;      \
  template <class Self, class Visitor>                      \
  static void for_each_field(Self& self, Visitor&& visit) { \
    DOPPEL_FOR_EACH_FIELD(__VA_ARGS__)                      \
  }

// The constants of a message, declared before as static constexpr members, for the schema text.
#define DOPPEL_CONSTANTS(...)                                  \
  template <class Self, class Visitor>                         \
  static void for_each_constant(Self& self, Visitor&& visit) { \
    DOPPEL_FOR_EACH_FIELD(__VA_ARGS__)                         \
  }

// A message without fields. On the wire ROS 2 adds one byte (structure_needs_at_least_one_member).
#define DOPPEL_EMPTY_MESSAGE(type_name)                \
  static constexpr std::string_view kType = type_name; \
  static constexpr bool kIsEmpty = true;               \
  template <class Self, class Visitor>                 \
  static void for_each_field(Self&, Visitor&&) {}

namespace doppel {

class TypeSupport;

template <class M>
concept Message = requires {
  { M::kType } -> std::convertible_to<std::string_view>;
};

// A generated one: its description is data.
template <class M>
concept BuiltinMessage = Message<M> && requires {
  { M::builtin_type() } -> std::same_as<const TypeSupport&>;
};

template <class S>
concept Service = Message<typename S::Request> && Message<typename S::Response>;

template <class A>
concept Action = Message<typename A::Goal> && Message<typename A::Result> && Message<typename A::Feedback>;

// "string<=N". Writers do not check the bound; it is part of the type and of its hash.
template <std::size_t N>
struct BoundedString : std::string {
  static constexpr std::size_t kBound = N;
  using std::string::string;
  using std::string::operator=;
  BoundedString() = default;
  BoundedString(std::string text) : std::string(std::move(text)) {}
};

// "T[<=N]". Readers refuse a longer one.
template <class T, std::size_t N>
struct BoundedVector : std::vector<T> {
  static constexpr std::size_t kBound = N;
  using std::vector<T>::vector;
};

}  // namespace doppel
