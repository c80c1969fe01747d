#include "doppel/ros/messages/schema_reader.h"

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "doppel/ros/messages/described_type.h"

namespace doppel {
namespace {

namespace msg = type_description_interfaces::msg;

// The ids of FieldType.msg of type_description_interfaces.
constexpr std::uint8_t kNested = 1, kUint8 = 3, kString = 17, kWideString = 18;
constexpr std::pair<std::string_view, std::uint8_t> kPrimitives[] = {
    {"bool", 15},  {"byte", 16},    {"char", kUint8}, {"int8", 2},         {"uint8", kUint8},
    {"int16", 4},  {"uint16", 5},   {"int32", 6},     {"uint32", 7},       {"int64", 8},
    {"uint64", 9}, {"float32", 10}, {"float64", 11},  {"string", kString}, {"wstring", kWideString}};
// The id of a bounded string, less that of a string.
constexpr std::uint8_t kBoundedText = 4;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return "";
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::optional<std::uint64_t> number_in(std::string_view text) {
  std::uint64_t out = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return out;
}

// "geometry_msgs/Pose" and "Pose" in another package's type -> "geometry_msgs/msg/Pose".
std::string full_name(std::string_view name, std::string_view package) {
  const std::size_t slash = name.find('/');
  if (slash == std::string_view::npos) return fmt::format("{}/msg/{}", package, name);
  if (name.find('/', slash + 1) != std::string_view::npos) return std::string(name);
  return fmt::format("{}/msg/{}", name.substr(0, slash), name.substr(slash + 1));
}

class SchemaReader {
 public:
  explicit SchemaReader(std::string_view name) { begin_type(std::string(name)); }

  // Empty: the line is read.
  std::string read_line(std::string_view line) {
    const std::string_view text = trimmed(line.substr(0, comment_in(line)));
    if (text.empty()) return "";
    if (text.starts_with("===")) return "";
    if (text.starts_with("MSG:")) {
      begin_type(full_name(trimmed(text.substr(4)), ""));
      return "";
    }
    const std::size_t blank = text.find_first_of(" \t");
    if (blank == std::string_view::npos) return fmt::format("'{}' has no name", text);
    const std::string_view rest = trimmed(text.substr(blank));
    const std::size_t name_end = rest.find_first_of(" \t=");
    const bool is_constant = trimmed(rest.substr(std::min(name_end, rest.size()))).starts_with('=');
    return is_constant ? "" : add_field(text.substr(0, blank), rest.substr(0, name_end));
  }

  TypeDescriptionMessage take() {
    TypeDescriptionMessage out;
    out.type_description = std::move(types_.front());
    std::map<std::string, msg::IndividualTypeDescription> others;  // sorted, as hashes need them
    for (std::size_t i = 1; i < types_.size(); ++i) others[types_[i].type_name] = std::move(types_[i]);
    for (auto& [name, type] : others) out.referenced_type_descriptions.push_back(std::move(type));
    for (auto* type : all_of(out)) add_only_member(*type);
    return out;
  }

 private:
  // Behind a '#' that is not within a text.
  static std::size_t comment_in(std::string_view line) {
    char quote = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (quote != 0) {
        if (line[i] == quote) quote = 0;
      } else if (line[i] == '"' || line[i] == '\'') {
        quote = line[i];
      } else if (line[i] == '#') {
        return i;
      }
    }
    return line.size();
  }

  void begin_type(std::string name) { types_.emplace_back().type_name = std::move(name); }

  static std::vector<msg::IndividualTypeDescription*> all_of(TypeDescriptionMessage& message) {
    std::vector<msg::IndividualTypeDescription*> out{&message.type_description};
    for (auto& type : message.referenced_type_descriptions) out.push_back(&type);
    return out;
  }

  static void add_only_member(msg::IndividualTypeDescription& type) {
    if (!type.fields.empty()) return;
    msg::Field& field = type.fields.emplace_back();
    field.name = kOnlyMember;
    field.type.type_id = kUint8;
  }

  // "string<=5[<=2]" with its name.
  std::string add_field(std::string_view type, std::string_view name) {
    msg::Field field;
    field.name = name;
    std::string_view element = type.substr(0, type.find('['));
    if (const std::size_t bound = element.find("<="); bound != std::string_view::npos) {
      const auto length = number_in(element.substr(bound + 2));
      if (!length) return fmt::format("'{}' has a bound that is not a number", type);
      field.type.string_capacity = *length;
      element = element.substr(0, bound);
    }
    if (std::string why = set_element(field.type, element); !why.empty()) return why;
    if (std::string why = set_list(field.type, type); !why.empty()) return why;
    types_.back().fields.push_back(std::move(field));
    return "";
  }

  std::string set_element(msg::FieldType& field, std::string_view element) {
    for (const auto& [name, id] : kPrimitives) {
      if (name != element) continue;
      const bool is_text = id == kString || id == kWideString;
      if (field.string_capacity > 0 && !is_text) return fmt::format("'{}' cannot have a bound", element);
      field.type_id = static_cast<std::uint8_t>(id + (field.string_capacity > 0 ? kBoundedText : 0));
      return "";
    }
    // The types of ROS 1.
    const std::string_view name = element == "time"       ? "builtin_interfaces/Time"
                                  : element == "duration" ? "builtin_interfaces/Duration"
                                  : element == "Header"   ? "std_msgs/Header"
                                                          : element;
    const std::string& owner = types_.back().type_name;
    field.type_id = kNested;
    field.nested_type_name = full_name(name, owner.substr(0, owner.find('/')));
    return "";
  }

  static std::string set_list(msg::FieldType& field, std::string_view type) {
    const std::size_t open = type.find('[');
    if (open == std::string_view::npos) return "";
    if (!type.ends_with(']')) return fmt::format("'{}' has no ']'", type);
    std::string_view size = type.substr(open + 1, type.size() - open - 2);
    if (size.empty()) {
      field.type_id = static_cast<std::uint8_t>(field.type_id + kUnboundedSequenceId);
      return "";
    }
    const bool is_bound = size.starts_with("<=");
    if (is_bound) size.remove_prefix(2);
    const auto count = number_in(size);
    if (!count) return fmt::format("'{}' has a size that is not a number", type);
    field.capacity = *count;
    field.type_id = static_cast<std::uint8_t>(field.type_id + (is_bound ? kBoundedSequenceId : kArrayId));
    return "";
  }

  std::vector<msg::IndividualTypeDescription> types_;
};

}  // namespace

std::shared_ptr<const TypeSupport> type_of_schema(std::string_view name, std::string_view text,
                                                  Status& status) {
  SchemaReader reader(name);
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    ++number;
    if (const std::string why = reader.read_line(text.substr(0, end)); !why.empty()) {
      status = Status::refused(fmt::format("line {}: {}", number, why));
      return nullptr;
    }
    text = end == std::string_view::npos ? "" : text.substr(end + 1);
  }
  return described_type(reader.take(), status);
}

}  // namespace doppel
