#include "doppel/ros/messages/detail/builtin_types.h"

#include <deque>

namespace doppel::messages_detail {
namespace {

FieldDescription field_of(const FieldRow& row) {
  FieldDescription field{.name = row.name, .kind = row.kind, .shape = row.shape};
  if (row.shape == FieldShape::array) field.count = row.size;
  if (row.shape == FieldShape::sequence) field.bound = row.size;
  field.text_bound = row.text_bound;
  if (row.kind == FieldKind::message) field.type = builtin_type_at(row.type).description();
  field.initial = row.initial;
  return field;
}

class BuiltinType final : public TypeSupport {
 public:
  explicit BuiltinType(const TypeRow& row) : TypeSupport(row.name), row_(row) {}

  // Made at first use: most programs need a few of the types.
  [[nodiscard]] const TypeDescription* description() const override {
    std::call_once(once_, [this] {
      description_.name = name;
      for (const FieldRow& field : row_.fields) description_.add(field_of(field));
      for (const ConstantRow& constant : row_.constants)
        description_.constants.push_back({constant.name, constant.kind, constant.value, constant.text});
    });
    return &description_;
  }

 private:
  const TypeRow& row_;
  mutable std::once_flag once_;
  mutable TypeDescription description_;
};

}  // namespace

const TypeSupport& builtin_type_at(std::size_t row) {
  static const std::deque<BuiltinType> types(kBuiltinTypes.begin(), kBuiltinTypes.end());
  return types[row];
}

}  // namespace doppel::messages_detail
