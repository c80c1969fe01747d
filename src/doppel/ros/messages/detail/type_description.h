#pragma once
// The description of a message: a built-in one is in the table of types, another one has a field list.

#include "doppel/ros/messages/type_description.h"

namespace doppel::messages_detail {

template <class T>
struct SequenceOf : std::false_type {};
template <class T>
struct SequenceOf<std::vector<T>> : std::true_type {
  using Element = T;
  static constexpr std::size_t kBound = 0;
};
template <class T, std::size_t N>
struct SequenceOf<BoundedVector<T, N>> : SequenceOf<std::vector<T>> {
  static constexpr std::size_t kBound = N;
};
template <class T>
struct ArrayOf : std::false_type {};
template <class T, std::size_t N>
struct ArrayOf<std::array<T, N>> : std::true_type {
  using Element = T;
  static constexpr std::size_t kCount = N;
};
template <class T>
concept Text = std::derived_from<T, std::string>;  // also BoundedString
template <class M>
concept EmptyMessage = Message<M> && requires {
  M::kIsEmpty;
};

template <class T>
constexpr FieldKind kind_of() {
  if constexpr (std::same_as<T, bool>) return FieldKind::boolean;
  if constexpr (std::same_as<T, std::byte>) return FieldKind::byte;
  if constexpr (std::same_as<T, std::int8_t>) return FieldKind::int8;
  if constexpr (std::same_as<T, std::uint8_t>) return FieldKind::uint8;
  if constexpr (std::same_as<T, std::int16_t>) return FieldKind::int16;
  if constexpr (std::same_as<T, std::uint16_t>) return FieldKind::uint16;
  if constexpr (std::same_as<T, std::int32_t>) return FieldKind::int32;
  if constexpr (std::same_as<T, std::uint32_t>) return FieldKind::uint32;
  if constexpr (std::same_as<T, std::int64_t>) return FieldKind::int64;
  if constexpr (std::same_as<T, std::uint64_t>) return FieldKind::uint64;
  if constexpr (std::same_as<T, float>) return FieldKind::float32;
  if constexpr (std::same_as<T, double>) return FieldKind::float64;
  if constexpr (std::same_as<T, char16_t>) return FieldKind::wide_character;
  if constexpr (std::same_as<T, std::u16string>) return FieldKind::wide_text;
  if constexpr (Text<T>) return FieldKind::text;
  return FieldKind::message;
}

template <class T>
FieldDescription describe_field(const char* name, const T& initial, Distro distro) {
  FieldDescription field{.name = name};
  const auto element = [&field, distro]<class E>(std::type_identity<E>) {
    static_assert(Message<E> || kind_of<E>() != FieldKind::message, "not a type that a message can have");
    field.kind = kind_of<E>();
    if constexpr (Message<E>) field.type = &describe<E>(distro);
    if constexpr (requires { E::kBound; }) field.text_bound = E::kBound;
  };
  if constexpr (SequenceOf<T>::value) {
    field.shape = FieldShape::sequence;
    field.bound = SequenceOf<T>::kBound;
    element(std::type_identity<typename SequenceOf<T>::Element>{});
  } else if constexpr (ArrayOf<T>::value) {
    field.shape = FieldShape::array;
    field.count = ArrayOf<T>::kCount;
    element(std::type_identity<typename ArrayOf<T>::Element>{});
  } else {
    element(std::type_identity<T>{});
    if constexpr (std::is_arithmetic_v<T>) field.initial = static_cast<double>(initial);
  }
  return field;
}

// Describes a struct with a field list of its own, which is the same in all distributions; the messages in it
// may differ.
template <Message M>
TypeDescription describe_struct(Distro distro) {
  TypeDescription type{.name = std::string(M::kType), .fields = {}, .constants = {}};
  const M initial{};
  M::for_each_field(initial, [&type, distro](const char* name, const auto& value) {
    type.add(describe_field(name, value, distro));
  });
  if constexpr (requires { M::for_each_constant(initial, [](const char*, const auto&) {}); }) {
    M::for_each_constant(initial, [&type]<class T>(const char* name, const T& value) {
      if constexpr (std::same_as<T, std::string_view>) {
        type.constants.push_back({name, FieldKind::text, 0, std::string(value)});
      } else {
        type.constants.push_back({name, kind_of<T>(), static_cast<std::int64_t>(value), {}});
      }
    });
  }
  return type;
}

}  // namespace doppel::messages_detail

namespace doppel {

template <Message M>
const TypeDescription& describe(Distro distro) {
  if constexpr (BuiltinMessage<M>) {
    return description_of(M::builtin_type(), distro);
  } else {
    static const std::array descriptions{messages_detail::describe_struct<M>(Distro::jazzy),
                                         messages_detail::describe_struct<M>(Distro::kilted),
                                         messages_detail::describe_struct<M>(Distro::lyrical)};
    return descriptions[static_cast<std::size_t>(distro)];
  }
}

}  // namespace doppel
