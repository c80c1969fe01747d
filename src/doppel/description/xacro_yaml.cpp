#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <map>
#include <numbers>

#include "doppel/description/urdf_reader.h"
#include "doppel/description/xacro_detail.h"

namespace doppel::xacro {
namespace {

constexpr int kDeepestYaml = 100;

// Units of xacro's YAML tags, in SI.
const std::map<std::string, double>& units() {
  static const std::map<std::string, double> table{{"!degrees", std::numbers::pi / 180},
                                                   {"!radians", 1.0},
                                                   {"!meters", 1.0},
                                                   {"!millimeters", 1e-3},
                                                   {"!foot", 0.3048},
                                                   {"!inches", 0.0254}};
  return table;
}

Value scalar(const YAML::Node& node, const SourceLocation& where) {
  const std::string& text = node.Scalar();
  if (const auto unit = units().find(node.Tag()); unit != units().end()) {
    const auto number = parse_number(text);
    if (number) return Value(*number * unit->second);
    class Nothing : public NameScope {
     public:
      std::optional<Value> find(const std::string&) override { return std::nullopt; }
      [[nodiscard]] std::vector<std::string> names() const override { return {}; }
    } nothing;
    std::int64_t budget = 10'000;
    try {
      return Value(evaluate(text, nothing, budget).real() * unit->second);
    } catch (const std::exception& problem) {
      throw InputError("xacro.yaml", where,
                       fmt::format("'{} {}' is no number: {}", node.Tag(), text, problem.what()));
    }
  }
  if (node.Tag() == "!") return Value(text);  // quoted
  if (text == "null" || text == "~" || text.empty()) return Value();
  for (const char* yes : {"true", "True", "TRUE", "yes", "Yes", "on", "On"}) {
    if (text == yes) return Value(true);
  }
  for (const char* no : {"false", "False", "FALSE", "no", "No", "off", "Off"}) {
    if (text == no) return Value(false);
  }
  const Value read = literal(text);
  return read.number() ? read : Value(text);
}

Value convert(const YAML::Node& node, const SourceLocation& where, int depth) {
  if (depth > kDeepestYaml) throw InputError("xacro.yaml", where, "the YAML is nested too deeply");
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return scalar(node, where);
    case YAML::NodeType::Sequence: {
      ValueList out;
      for (const auto& item : node) out.push_back(convert(item, where, depth + 1));
      return Value::list(std::move(out));
    }
    case YAML::NodeType::Map: {
      ValueDict out;
      for (const auto& entry : node)
        out.emplace_back(scalar(entry.first, where), convert(entry.second, where, depth + 1));
      return Value::dict(std::move(out));
    }
    default:
      return {};
  }
}

}  // namespace

Value load_yaml(const std::filesystem::path& file, const SourceLocation& where) {
  try {
    return convert(YAML::LoadFile(file.string()), where, 0);
  } catch (const YAML::BadFile&) {
    throw InputError("xacro.file_not_found", where,
                     fmt::format("the YAML file '{}' cannot be read", file.string()));
  } catch (const YAML::Exception& problem) {
    SourceLocation place = make_location(file.string(), problem.mark.line + 1, problem.mark.column + 1);
    place.within = std::make_shared<SourceLocation::Within>(SourceLocation::Within{where, "in load_yaml"});
    throw InputError("xacro.yaml", place, fmt::format("the YAML is not well-formed: {}", problem.msg));
  }
}

}  // namespace doppel::xacro
