#pragma once
// CDR per message type, from its field list.

#include <type_traits>

#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/detail/cdr.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel::messages_detail {

// Types with the same representation in memory and on the wire, so that lists are copied as a whole.
template <class T>
concept Number = (std::is_arithmetic_v<T> && !std::same_as<T, bool>) || std::same_as<T, std::byte>;

template <class Sink, class T>
void put(Sink& sink, const T& value) {
  if constexpr (std::same_as<T, bool>) {
    sink.number(static_cast<std::uint8_t>(value));
  } else if constexpr (Number<T>) {
    sink.number(value);
  } else if constexpr (Text<T>) {
    sink.text(value);
  } else if constexpr (std::same_as<T, std::u16string>) {
    sink.wide_text(value);
  } else if constexpr (SequenceOf<T>::value || ArrayOf<T>::value) {
    if constexpr (SequenceOf<T>::value) sink.number(static_cast<std::uint32_t>(value.size()));
    using Element = typename T::value_type;
    if constexpr (Number<Element>) {
      sink.numbers(value.data(), value.size());
    } else {
      for (const auto& element : value) put<Sink, Element>(sink, element);
    }
  } else if constexpr (EmptyMessage<T>) {
    sink.number(std::uint8_t{0});
  } else {
    T::for_each_field(value, [&sink](const char*, const auto& field) { put(sink, field); });
  }
}

template <class T>
bool get(CdrReader& reader, T& value);

template <class T>
bool get_elements(CdrReader& reader, T& values) {
  using Element = typename T::value_type;
  if constexpr (std::same_as<Element, bool>) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      bool value = false;  // std::vector<bool> has no references to its elements
      if (!reader.boolean(value)) return false;
      values[i] = value;
    }
    return true;
  } else if constexpr (Number<Element>) {
    return reader.numbers(values.data(), values.size());
  } else {
    for (Element& element : values) {
      if (!get(reader, element)) return false;
    }
    return true;
  }
}

template <class Element>
std::size_t least_size() {
  if constexpr (Message<Element>) {
    return describe<Element>().least_cdr_size;
  } else {
    return least_cdr_size(kind_of<Element>());
  }
}

template <class T>
bool get(CdrReader& reader, T& value) {
  if constexpr (std::same_as<T, bool>) {
    return reader.boolean(value);
  } else if constexpr (Number<T>) {
    return reader.number(value);
  } else if constexpr (Text<T>) {
    std::string_view text;
    if (!reader.text(text)) return false;
    value.assign(text);
    return true;
  } else if constexpr (std::same_as<T, std::u16string>) {
    return reader.wide_text(value);
  } else if constexpr (SequenceOf<T>::value) {
    std::uint32_t count = 0;
    if (!reader.length(count, least_size<typename T::value_type>(), SequenceOf<T>::kBound)) return false;
    value.resize(count);
    return get_elements(reader, value);
  } else if constexpr (ArrayOf<T>::value) {
    return get_elements(reader, value);
  } else if constexpr (EmptyMessage<T>) {
    std::uint8_t unused = 0;
    return reader.number(unused);
  } else {
    bool good = true;
    T::for_each_field(value, [&reader, &good](const char* name, auto& field) {
      if (!good || get(reader, field)) return;
      good = false;
      reader.within(name);
    });
    return good;
  }
}

}  // namespace doppel::messages_detail

namespace doppel {

template <Message M>
std::size_t cdr_size(const M& message) {
  CdrSizer sizer;
  messages_detail::put(sizer, message);
  return sizer.size();
}

template <Message M>
std::size_t write_cdr(const M& message, std::span<std::byte> out) {
  const std::size_t size = cdr_size(message);
  if (size > out.size()) return 0;
  CdrWriter writer(out.data());
  messages_detail::put(writer, message);
  return size;
}

template <Message M>
Bytes to_cdr(const M& message) {
  Bytes bytes(cdr_size(message));
  CdrWriter writer(bytes.data());
  messages_detail::put(writer, message);
  return bytes;
}

template <Message M>
Status from_cdr(std::span<const std::byte> bytes, M& message) {
  CdrReader reader(bytes);
  if (reader.ok() && messages_detail::get(reader, message)) reader.finish();
  return reader.ok() ? Status() : reader.status(M::kType);
}

namespace messages_detail {

template <Message M>
class StructType final : public TypeSupport {
 public:
  StructType() : TypeSupport(std::string(M::kType)) {}
  [[nodiscard]] const TypeDescription* description_in(Distro distro) const override {
    return &describe<M>(distro);
  }
};

}  // namespace messages_detail

template <Message M>
const TypeSupport& type_support() {
  if constexpr (BuiltinMessage<M>) {
    return M::builtin_type();
  } else {
    static const messages_detail::StructType<M> support;
    return support;
  }
}

template <Service S>
const ServiceSupport& service_support() {
  constexpr std::string_view kRequest = S::Request::kType, kSuffix = "_Request";
  static_assert(kRequest.ends_with(kSuffix), "a service's request is called <pkg>/srv/<Name>_Request");
  static const ServiceSupport support{std::string(kRequest.substr(0, kRequest.size() - kSuffix.size())),
                                      &type_support<typename S::Request>(),
                                      &type_support<typename S::Response>()};
  return support;
}

template <Action A>
const ActionSupport& action_support() {
  constexpr std::string_view kGoal = A::Goal::kType, kSuffix = "_Goal";
  static_assert(kGoal.ends_with(kSuffix), "an action's goal is called <pkg>/action/<Name>_Goal");
  static const ActionSupport support{std::string(kGoal.substr(0, kGoal.size() - kSuffix.size())),
                                     &type_support<typename A::Goal>(), &type_support<typename A::Result>(),
                                     &type_support<typename A::Feedback>()};
  return support;
}

}  // namespace doppel
