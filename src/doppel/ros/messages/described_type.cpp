#include "doppel/ros/messages/described_type.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <iterator>
#include <map>

#include "doppel/ros/messages/detail/cdr.h"
#include "doppel/ros/messages/detail/limits.h"
#include "doppel/ros/messages/type_hash.h"

namespace doppel {

using type_description_interfaces::msg::Field;
using type_description_interfaces::msg::IndividualTypeDescription;

namespace {

constexpr std::size_t kMaxNameLength = 255, kMaxDepth = 64;
constexpr double kMaxInitialValue = 9e15;  // whole numbers beyond it are not exact in a double

// Kinds by rosidl's ids; `message` also stands for those that no ROS 2 type has: long double, fixed strings.
constexpr FieldKind kKinds[] = {
    FieldKind::message, FieldKind::message,   FieldKind::int8,           FieldKind::uint8,
    FieldKind::int16,   FieldKind::uint16,    FieldKind::int32,          FieldKind::uint32,
    FieldKind::int64,   FieldKind::uint64,    FieldKind::float32,        FieldKind::float64,
    FieldKind::message, FieldKind::character, FieldKind::wide_character, FieldKind::boolean,
    FieldKind::byte,    FieldKind::text,      FieldKind::wide_text,      FieldKind::message,
    FieldKind::message, FieldKind::text,      FieldKind::wide_text};
constexpr std::uint8_t kNestedId = 1, kFirstBoundedTextId = 21;

bool is_name(std::string_view name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !name.empty() && name.size() <= kMaxNameLength && !(name[0] >= '0' && name[0] <= '9') &&
         std::ranges::all_of(name, good);
}

// "package/msg/Name"
bool is_type_name(std::string_view name) {
  if (name.size() > kMaxNameLength) return false;
  const std::size_t first = name.find('/'), last = name.rfind('/');
  if (first == std::string_view::npos || first == last) return false;
  return is_name(name.substr(0, first)) && is_name(name.substr(first + 1, last - first - 1)) &&
         is_name(name.substr(last + 1));
}

double initial_value(FieldKind kind, const std::string& text) {
  if (kind == FieldKind::boolean) return text == "True" ? 1 : 0;
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return std::abs(value) <= kMaxInitialValue ? value : 0;
}

// A type's description, which is first, and those of all types that it refers to. Their addresses are stable,
// because they refer to each other by pointers.
using DescribedTypes = std::deque<TypeDescription>;

class DescribedType final : public TypeSupport {
 public:
  explicit DescribedType(std::unique_ptr<const DescribedTypes> types)
      : TypeSupport(types->front().name), types_(std::move(types)), type_(types_->front()) {}
  [[nodiscard]] const TypeDescription* description_in(Distro /*distro*/) const override { return &type_; }

 private:
  std::unique_ptr<const DescribedTypes> types_;
  const TypeDescription& type_;
};

class DescriptionReader {
 public:
  explicit DescriptionReader(const TypeDescriptionMessage& message) : message_(message) {}

  std::unique_ptr<const DescribedTypes> read(Status& status) {
    enter(message_.type_description);
    for (const IndividualTypeDescription& type : message_.referenced_type_descriptions) enter(type);
    if (why_.empty()) fill(message_.type_description.type_name, 0);
    for (const IndividualTypeDescription& type : message_.referenced_type_descriptions)
      if (why_.empty()) fill(type.type_name, 0);
    status = why_.empty() ? Status() : Status::refused(why_);
    return why_.empty() ? std::move(types_) : nullptr;
  }

 private:
  struct Entry {
    const IndividualTypeDescription* said;
    TypeDescription* type;
    enum { untouched, begun, done } state = untouched;
  };

  void enter(const IndividualTypeDescription& type) {
    if (!why_.empty()) return;
    if (!is_type_name(type.type_name)) return refuse("a type name does not have the form 'package/msg/Name'");
    TypeDescription& place = types_->emplace_back();
    place.name = type.type_name;
    if (!entries_.emplace(place.name, Entry{&type, &place}).second)
      refuse(fmt::format("{} is described twice", place.name));
  }

  // Fills in its fields after those of the types in them, whose least sizes are needed.
  const TypeDescription* fill(std::string_view name, std::size_t depth) {
    const auto found = entries_.find(name);
    if (found == entries_.end()) return refuse_type(fmt::format("{} is not described", shown(name)));
    Entry& entry = found->second;
    if (entry.state == Entry::done) return entry.type;
    if (entry.state == Entry::begun) return refuse_type(fmt::format("{} contains itself", name));
    if (depth > kMaxDepth) return refuse_type(fmt::format("{} is nested too deeply", name));
    entry.state = Entry::begun;
    for (const Field& field : entry.said->fields) {
      add(*entry.type, field, depth);
      if (!why_.empty()) return nullptr;
    }
    if (entry.type->fields.size() == 1 && entry.type->fields[0].name == kOnlyMember)
      entry.type->fields.clear();
    entry.state = Entry::done;
    return entry.type;
  }

  void add(TypeDescription& type, const Field& said, std::size_t depth) {
    const auto same_name = [&said](const FieldDescription& field) { return field.name == said.name; };
    if (!is_name(said.name) || std::ranges::any_of(type.fields, same_name))
      return refuse(fmt::format("{} has a field without a unique name", type.name));
    FieldDescription field;
    field.name = said.name;
    const std::uint8_t id = shape_of(said, field);
    const bool nested = id == kNestedId;
    if (id >= std::size(kKinds) || (kKinds[id] == FieldKind::message && !nested))
      return refuse(fmt::format("{}.{} is of an unknown kind ({})", type.name, said.name, said.type.type_id));
    field.kind = kKinds[id];
    if (nested) field.type = fill(said.type.nested_type_name, depth + 1);
    if (!why_.empty()) return;
    if (id >= kFirstBoundedTextId) field.text_bound = said.type.string_capacity;
    if (field.shape == FieldShape::single) field.initial = initial_value(field.kind, said.default_value);
    const bool bounded = field.shape == FieldShape::sequence && id + kBoundedSequenceId == said.type.type_id;
    if (field.count == 0 || (bounded && field.bound == 0) ||
        (id >= kFirstBoundedTextId && field.text_bound == 0))
      return refuse(fmt::format("{}.{} has size 0", type.name, said.name));
    if (field.count > messages_detail::kMaxMessageSize / field.least_element_size())
      return refuse(fmt::format("{}.{} is larger than 64 MiB", type.name, said.name));
    type.add(std::move(field));
    if (type.least_cdr_size > messages_detail::kMaxMessageSize)
      refuse(fmt::format("{} is larger than 64 MiB", type.name));
  }

  // Returns the id of the kind of its elements.
  static std::uint8_t shape_of(const Field& said, FieldDescription& field) {
    const std::uint8_t id = said.type.type_id;
    if (id >= kUnboundedSequenceId) {
      field.shape = FieldShape::sequence;
      return id - kUnboundedSequenceId;
    }
    if (id >= kBoundedSequenceId) {
      field.shape = FieldShape::sequence;
      field.bound = said.type.capacity;
      return id - kBoundedSequenceId;
    }
    if (id >= kArrayId) {
      field.shape = FieldShape::array;
      field.count = said.type.capacity;
      return id - kArrayId;
    }
    return id;
  }

  const TypeDescription* refuse_type(std::string why) {
    refuse(std::move(why));
    return nullptr;
  }
  void refuse(std::string why) {
    if (why_.empty()) why_ = std::move(why);
  }
  static std::string shown(std::string_view name) {
    return is_type_name(name) ? std::string(name) : "a type in a field";
  }

  const TypeDescriptionMessage& message_;
  std::unique_ptr<DescribedTypes> types_ = std::make_unique<DescribedTypes>();
  std::map<std::string, Entry, std::less<>> entries_;
  std::string why_;
};

}  // namespace

std::shared_ptr<const TypeSupport> described_type(const TypeDescriptionMessage& message, Status& status) {
  auto types = DescriptionReader(message).read(status);
  return types == nullptr ? nullptr : std::make_shared<DescribedType>(std::move(types));
}

}  // namespace doppel
