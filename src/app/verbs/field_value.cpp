#include "app/verbs/field_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "doppel/base/core/names.h"

namespace doppel::app {
namespace {

// A message as a tree; one message at a time keeps it small.
struct Value {
  std::string name;  // of the field that it is, in its message
  std::string scalar;
  std::string list_type;  // of a list, as rosidl prints it: "sequence type: double, length: 3"
  bool is_list = false, is_message = false, is_text = false;
  std::vector<Value> children;
};

class TreeBuilder : public ValueSink {
 public:
  Value root;

  void begin_message(const TypeDescription&) override { open().is_message = true; }
  void field(const FieldDescription& field) override {
    name_ = field.name;
    field_ = &field;
  }
  void end_message() override { path_.pop_back(); }
  void begin_list(std::size_t length) override {
    Value& list = open();
    list.is_list = true;
    if (field_ != nullptr) list.list_type = list_type(*field_, length);
  }
  void end_list() override { path_.pop_back(); }
  void boolean(bool value) override { add().scalar = value ? "true" : "false"; }
  void integer(std::int64_t value) override { add().scalar = std::to_string(value); }
  void natural(std::uint64_t value) override { add().scalar = std::to_string(value); }
  void real(double value) override { add().scalar = shortest_decimal(value); }
  void text(std::string_view value) override {
    Value& added = add();
    added.scalar = value;
    added.is_text = true;
  }

 private:
  Value& add() {
    if (path_.empty()) return root;
    path_.back()->children.emplace_back().name = std::exchange(name_, {});
    return path_.back()->children.back();
  }
  // Only the last child of each level grows, so that the pointers to its parents stay valid.
  Value& open() {
    Value& value = add();
    path_.push_back(&value);
    return value;
  }
  static std::string list_type(const FieldDescription& field, std::size_t length) {
    std::string element = field.type != nullptr ? field.type->name : std::string(to_string(field.kind));
    if (element == "float64") element = "double";
    if (element == "float32") element = "float";
    return field.shape == FieldShape::array ? fmt::format("array type: {}[{}]", element, length)
                                            : fmt::format("sequence type: {}, length: {}", element, length);
  }

  std::string name_;
  const FieldDescription* field_ = nullptr;
  std::vector<Value*> path_;
};

struct Step {
  std::string name;
  std::vector<std::size_t> indices;
};

Status parse_path(std::string_view path, std::vector<Step>& steps) {
  while (true) {
    const std::size_t dot = path.find('.');
    std::string_view part = path.substr(0, dot);
    Step step{.name = std::string(part.substr(0, part.find('['))), .indices = {}};
    part.remove_prefix(step.name.size());
    while (!part.empty()) {
      std::size_t index = 0;
      const auto [end, problem] = std::from_chars(part.data() + 1, part.data() + part.size(), index);
      if (part.front() != '[' || problem != std::errc() || end == part.data() + part.size() || *end != ']') {
        return Status::refused(fmt::format("'{}' is not a field path; write name[0].name", path));
      }
      step.indices.push_back(index);
      part.remove_prefix(static_cast<std::size_t>(end + 1 - part.data()));
    }
    steps.push_back(std::move(step));
    if (dot == std::string_view::npos) return {};
    path.remove_prefix(dot + 1);
  }
}

void write_block(const Value& value, std::size_t indent, std::string& out);

void write_child(const Value& child, std::size_t indent, std::string& out) {
  if (!child.is_message && !child.is_list) {
    out += fmt::format(" {}\n", child.scalar);
  } else if (child.children.empty()) {
    out += child.is_list ? " []\n" : " {}\n";
  } else {
    out += '\n';
    write_block(child, indent, out);
  }
}

void write_block(const Value& value, std::size_t indent, std::string& out) {
  for (const Value& child : value.children) {
    out += std::string(indent, ' ') + (value.is_list ? "-" : child.name + ":");
    write_child(child, indent + 2, out);
  }
}

std::string value_as_yaml(const Value& value) {
  if (!value.is_message && !value.is_list) return value.scalar + "\n";
  const bool flat =
      std::ranges::none_of(value.children, [](const Value& v) { return v.is_message || v.is_list; });
  if (value.is_list && flat) {
    std::string out = "[";
    for (const Value& child : value.children) out += (out.size() > 1 ? ", " : "") + child.scalar;
    return out + "]\n";
  }
  std::string out;
  write_block(value, 0, out);
  return out;
}

// The contents of lists and texts are replaced by what they are.
void hide_contents(Value& value, bool lists, bool texts) {
  if (lists && value.is_list) {
    value = {.name = value.name,
             .scalar = fmt::format("'<{}>'", value.list_type),
             .list_type = {},
             .children = {}};
  } else if (texts && value.is_text) {
    value.scalar = fmt::format("'<string length: <{}>>'", value.scalar.size());
    value.is_text = false;
  }
  for (Value& child : value.children) hide_contents(child, lists, texts);
}

// A text as it stands between the commas of a flow.
std::string flow_scalar(const Value& value) {
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '/' || c == '.';
  };
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
  // YAML 1.1 reads these, in any case, as values that are not texts.
  static const std::set<std::string> kReserved{"y",   "n",  "yes",  "no",   "true", "false",
                                               "off", "on", "null", ".nan", ".inf"};
  const std::string& text = value.scalar;
  std::string lower = text;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (!value.is_text || (!text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0 &&
                         std::ranges::all_of(text, is_plain) && !kReserved.contains(lower)))
    return text;
  if (std::ranges::any_of(text, is_control))
    return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
  return out + "'";
}

std::string flow_text(const Value& value) {
  if (!value.is_list && !value.is_message) return flow_scalar(value);
  std::string out;
  for (const Value& child : value.children) {
    if (!out.empty()) out += ", ";
    out += value.is_message ? child.name + ": " + flow_text(child) : flow_text(child);
  }
  return value.is_list ? "[" + out + "]" : "{" + out + "}";
}

// The values without their structure, in order.
void add_cells(const Value& value, std::vector<std::string>& cells) {
  for (const Value& child : value.children) add_cells(child, cells);
  if (!value.is_list && !value.is_message) cells.push_back(value.scalar);
}

const FieldDescription* find_field(const TypeDescription& type, const std::string& name) {
  const auto found = std::ranges::find(type.fields, name, &FieldDescription::name);
  return found == type.fields.end() ? nullptr : &*found;
}

void show_fields(const TypeDescription& type, std::size_t depth, std::string& out) {
  const std::string indent(depth, '\t');
  for (const ConstantDescription& constant : type.constants) {
    out += fmt::format("{}{}\n", indent, to_string(constant));
  }
  for (const FieldDescription& field : type.fields) {
    out += fmt::format("{}{} {}\n", indent, to_string(field), field.name);
    if (field.type != nullptr) show_fields(*field.type, depth + 1, out);
  }
}

}  // namespace

Status check_field_path(const TypeDescription& type, std::string_view path) {
  std::vector<Step> steps;
  if (const Status status = parse_path(path, steps); !status) return status;
  const TypeDescription* at = &type;
  for (const Step& step : steps) {
    if (at == nullptr)
      return Status::refused(fmt::format("'{}': the part before '{}' has no fields", path, step.name));
    const FieldDescription* field = find_field(*at, step.name);
    if (field == nullptr) {
      std::vector<std::string> names;
      for (const FieldDescription& known : at->fields) names.push_back(known.name);
      return Status::refused(
          fmt::format("{} has no field '{}'{}", at->name, step.name, did_you_mean(step.name, names)));
    }
    const std::size_t lists = field->shape == FieldShape::single ? 0 : 1;
    if (step.indices.size() > lists) return Status::refused(fmt::format("'{}' is not a list", step.name));
    at = step.indices.size() == lists ? field->type : nullptr;
  }
  return {};
}

Status format_message(const TypeDescription& type, std::span<const std::byte> cdr,
                      const MessageFormat& format, std::string& out) {
  std::vector<Step> steps;
  if (!format.field.empty()) {
    if (Status status = check_field_path(type, format.field); !status) return status;
    if (Status status = parse_path(format.field, steps); !status) return status;
  }
  TreeBuilder builder;
  if (Status status = walk_cdr(type, cdr, builder); !status) return status;
  Value* value = &builder.root;
  for (const Step& step : steps) {
    value = &*std::ranges::find(value->children, step.name, &Value::name);
    for (const std::size_t index : step.indices) {
      if (index >= value->children.size()) {
        return Status::refused(fmt::format("{} has {} elements; index {} is out of range", step.name,
                                           value->children.size(), index));
      }
      value = &value->children[index];
    }
  }
  hide_contents(*value, format.no_arrays, format.no_strings);
  out.clear();
  if (format.csv) {
    std::vector<std::string> cells;
    add_cells(*value, cells);
    out = fmt::format("{}\n", fmt::join(cells, ","));
  } else {
    out = format.flow ? flow_text(*value) + "\n" : value_as_yaml(*value);
  }
  return {};
}

Status field_as_yaml(const TypeDescription& type, std::span<const std::byte> cdr, std::string_view path,
                     std::string& out) {
  return format_message(type, cdr, {.field = std::string(path)}, out);
}

std::string show_type(const TypeDescription& type) {
  std::string out;
  show_fields(type, 0, out);
  return out;
}

}  // namespace doppel::app
