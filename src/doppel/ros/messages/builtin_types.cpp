#include "doppel/ros/messages/detail/builtin_types.h"

#include <deque>

#include "doppel/ros/messages/detail/late_descriptions.h"

namespace doppel::messages_detail {
namespace {

FieldDescription field_of(const FieldRow& row, Distro distro) {
  FieldDescription field{.name = row.name, .kind = row.kind, .shape = row.shape};
  if (row.shape == FieldShape::array) field.count = row.size;
  if (row.shape == FieldShape::sequence) field.bound = row.size;
  field.text_bound = row.text_bound;
  if (row.kind == FieldKind::message) field.type = builtin_type_at(row.type).description_in(distro);
  field.initial = row.initial;
  return field;
}

class BuiltinType final : public TypeSupport {
 public:
  explicit BuiltinType(const TypeRow& row) : TypeSupport(row.name), row_(row) {}

  [[nodiscard]] const TypeDescription* description_in(Distro distro) const override {
    return descriptions_.get(distro, [&] {
      TypeDescription type;
      type.name = name;
      for (const FieldRow& field : row_.fields) {
        if (field.range.contains(distro)) type.add(field_of(field, distro));
      }
      for (const ConstantRow& constant : row_.constants)
        type.constants.push_back({constant.name, constant.kind, constant.value, constant.text});
      return type;
    });
  }

 private:
  const TypeRow& row_;
  LateDescriptions descriptions_;
};

}  // namespace

const TypeSupport& builtin_type_at(std::size_t row) {
  static const std::deque<BuiltinType> types(kBuiltinTypes.begin(), kBuiltinTypes.end());
  return types[row];
}

}  // namespace doppel::messages_detail
