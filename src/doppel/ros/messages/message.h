#pragma once
// A message is a plain struct named as in ROS 2, with one field list, from which CDR, JSON, YAML, schema text
// and the type hash are derived. A new message is one struct:
//
//   namespace doppel::std_msgs::msg {
//   struct Header {
//     builtin_interfaces::msg::Time stamp;
//     std::string frame_id;
//     DOPPEL_MESSAGE("std_msgs/msg/Header", stamp, frame_id)
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

#define DOPPEL_FIELD_1(f) visit(#f, self.f);
#define DOPPEL_FIELD_2(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_1(__VA_ARGS__)
#define DOPPEL_FIELD_3(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_2(__VA_ARGS__)
#define DOPPEL_FIELD_4(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_3(__VA_ARGS__)
#define DOPPEL_FIELD_5(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_4(__VA_ARGS__)
#define DOPPEL_FIELD_6(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_5(__VA_ARGS__)
#define DOPPEL_FIELD_7(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_6(__VA_ARGS__)
#define DOPPEL_FIELD_8(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_7(__VA_ARGS__)
#define DOPPEL_FIELD_9(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_8(__VA_ARGS__)
#define DOPPEL_FIELD_10(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_9(__VA_ARGS__)
#define DOPPEL_FIELD_11(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_10(__VA_ARGS__)
#define DOPPEL_FIELD_12(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_11(__VA_ARGS__)
#define DOPPEL_FIELD_13(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_12(__VA_ARGS__)
#define DOPPEL_FIELD_14(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_13(__VA_ARGS__)
#define DOPPEL_FIELD_15(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_14(__VA_ARGS__)
#define DOPPEL_FIELD_16(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_15(__VA_ARGS__)
#define DOPPEL_FIELD_17(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_16(__VA_ARGS__)
#define DOPPEL_FIELD_18(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_17(__VA_ARGS__)
#define DOPPEL_FIELD_19(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_18(__VA_ARGS__)
#define DOPPEL_FIELD_20(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_19(__VA_ARGS__)
#define DOPPEL_FIELD_21(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_20(__VA_ARGS__)
#define DOPPEL_FIELD_22(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_21(__VA_ARGS__)
#define DOPPEL_FIELD_23(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_22(__VA_ARGS__)
#define DOPPEL_FIELD_24(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_23(__VA_ARGS__)
#define DOPPEL_FIELD_25(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_24(__VA_ARGS__)
#define DOPPEL_FIELD_26(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_25(__VA_ARGS__)
#define DOPPEL_FIELD_27(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_26(__VA_ARGS__)
#define DOPPEL_FIELD_28(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_27(__VA_ARGS__)
#define DOPPEL_FIELD_29(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_28(__VA_ARGS__)
#define DOPPEL_FIELD_30(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_29(__VA_ARGS__)
#define DOPPEL_FIELD_31(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_30(__VA_ARGS__)
#define DOPPEL_FIELD_32(f, ...) DOPPEL_FIELD_1(f) DOPPEL_FIELD_31(__VA_ARGS__)
#define DOPPEL_PICK(_1, _2, _3, _4, _5, _6, _7, _8, _9, _10, _11, _12, _13, _14, _15, _16, _17, _18, _19, \
                    _20, _21, _22, _23, _24, _25, _26, _27, _28, _29, _30, _31, _32, NAME, ...)           \
  NAME
#define DOPPEL_FOR_EACH_FIELD(...)                                                                 \
  DOPPEL_PICK(__VA_ARGS__, DOPPEL_FIELD_32, DOPPEL_FIELD_31, DOPPEL_FIELD_30, DOPPEL_FIELD_29,     \
              DOPPEL_FIELD_28, DOPPEL_FIELD_27, DOPPEL_FIELD_26, DOPPEL_FIELD_25, DOPPEL_FIELD_24, \
              DOPPEL_FIELD_23, DOPPEL_FIELD_22, DOPPEL_FIELD_21, DOPPEL_FIELD_20, DOPPEL_FIELD_19, \
              DOPPEL_FIELD_18, DOPPEL_FIELD_17, DOPPEL_FIELD_16, DOPPEL_FIELD_15, DOPPEL_FIELD_14, \
              DOPPEL_FIELD_13, DOPPEL_FIELD_12, DOPPEL_FIELD_11, DOPPEL_FIELD_10, DOPPEL_FIELD_9,  \
              DOPPEL_FIELD_8, DOPPEL_FIELD_7, DOPPEL_FIELD_6, DOPPEL_FIELD_5, DOPPEL_FIELD_4,      \
              DOPPEL_FIELD_3, DOPPEL_FIELD_2, DOPPEL_FIELD_1)                                      \
  (__VA_ARGS__)

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

template <class M>
concept Message = requires {
  { M::kType } -> std::convertible_to<std::string_view>;
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
