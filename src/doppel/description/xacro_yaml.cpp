// YAML files as values, scalars read as YAML 1.1 reads them (PyYAML's safe_load).
#include "doppel/description/xacro_yaml.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>
#include <numbers>
#include <sstream>

namespace doppel::xacro {
namespace {

constexpr int kDeepestYaml = 50;
constexpr std::int64_t kMostNodes = 200'000;
constexpr std::size_t kLargest = std::size_t{4} << 20;

// Units of xacro's YAML tags, in SI.
const std::map<std::string, double>& units() {
  static const std::map<std::string, double> table{
      {"!radians", 1.0},      {"!meters", 1.0},  {"!degrees", std::numbers::pi / 180},
      {"!millimeters", 1e-3}, {"!foot", 0.3048}, {"!inches", 0.0254}};
  return table;
}

class Nothing : public NameScope {
 public:
  const Value* find(std::string_view) override { return nullptr; }
  [[nodiscard]] std::vector<std::string> names() const override { return {}; }
};

bool digits_only(std::string_view text, std::string_view allowed) {
  return !text.empty() && text.find_first_not_of(allowed) == std::string_view::npos;
}

// [-+]?[0-9][0-9_]*, 0b..., 0x..., and octal with a leading zero.
std::optional<Value> integer(const std::string& text) {
  const std::size_t sign = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
  std::string digits = text.substr(sign);
  std::erase(digits, '_');
  if (digits.empty() || text[sign] == '_') return std::nullopt;
  int base = 10;
  std::string_view allowed = "0123456789";
  if (digits.starts_with("0b")) {
    base = 2, allowed = "01", digits.erase(0, 2);
  } else if (digits.starts_with("0x")) {
    base = 16, allowed = "0123456789abcdefABCDEF", digits.erase(0, 2);
  } else if (digits.size() > 1 && digits[0] == '0') {
    base = 8, allowed = "01234567";
  }
  if (!digits_only(digits, allowed)) return std::nullopt;
  std::int64_t out = 0;
  if (!parse_integer((sign == 1 && text[0] == '-' ? "-" : "") + digits, out, base)) return std::nullopt;
  return Value(out);
}

// A point is required, and a sign in the exponent: 1e-5 is a text in YAML 1.1.
std::optional<Value> real(const std::string& text) {
  const std::size_t sign = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
  const std::string body = text.substr(sign);
  const bool minus = text.starts_with('-');
  if (body == ".inf" || body == ".Inf" || body == ".INF") return Value(minus ? -HUGE_VAL : HUGE_VAL);
  if (sign == 0 && (body == ".nan" || body == ".NaN" || body == ".NAN")) return Value(std::nan(""));
  const std::size_t point = body.find('.');
  if (point == std::string::npos || body.find('.', point + 1) != std::string::npos) return std::nullopt;
  const std::size_t e = std::min(body.find_first_of("eE"), body.size());
  if (e < point) return std::nullopt;
  std::string mantissa = body.substr(0, e);
  const std::string exponent = body.substr(e);
  const bool signed_exponent = exponent.size() > 2 && (exponent[1] == '-' || exponent[1] == '+') &&
                               digits_only(std::string_view(exponent).substr(2), "0123456789");
  if (!exponent.empty() && !signed_exponent) return std::nullopt;
  std::erase(mantissa, '_');
  if (mantissa.size() < 2 || !digits_only(mantissa, "0123456789.") || body[0] == '_') return std::nullopt;
  double out = 0;
  if (!parse_real((minus ? "-" : "") + mantissa + exponent, out)) return std::nullopt;
  return Value(out);
}

// 1:30 is 90.
std::optional<Value> sexagesimal(const std::string& text) {
  if (text.find(':') == std::string::npos) return std::nullopt;
  const bool minus = text.starts_with('-');
  std::string rest = text.substr(minus || text.starts_with('+') ? 1 : 0);
  double total = 0;
  bool point = false, first = true;
  while (true) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    const std::string part = rest.substr(0, end);
    const bool last = end == rest.size();
    if (!digits_only(part, last ? "0123456789." : "0123456789")) return std::nullopt;
    double value = 0;
    if (!parse_real(part, value) || (!first && value >= 60)) return std::nullopt;
    if (first && (part[0] == '0' || last)) return std::nullopt;
    point = part.find('.') != std::string::npos;
    total = total * 60 + value;
    if (last) break;
    rest.erase(0, end + 1);
    first = false;
  }
  if (minus) total = -total;
  if (point) return Value(total);
  return std::abs(total) < 9e15 ? std::optional<Value>(Value(static_cast<std::int64_t>(total)))
                                : std::nullopt;
}

}  // namespace

Value yaml_scalar(const std::string& text) {
  if (text.empty() || text == "~" || text == "null" || text == "Null" || text == "NULL") return {};
  for (const char* yes : {"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"}) {
    if (text == yes) return Value(true);
  }
  for (const char* no : {"false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"}) {
    if (text == no) return Value(false);
  }
  if (std::string_view("0123456789+-.").find(text[0]) == std::string_view::npos) return Value(text);
  if (auto whole = integer(text)) return *whole;
  if (auto number = real(text)) return *number;
  if (auto number = sexagesimal(text)) return *number;
  return Value(text);
}

std::optional<Value> yaml_quantity(const std::string& tag, const std::string& text) {
  const auto unit = units().find(tag);
  double number = 0;
  if (unit == units().end()) return std::nullopt;
  if (parse_real(text, number)) return Value(number * unit->second);
  std::int64_t budget = 100'000;
  Nothing nothing;
  const Value value = evaluate(text, nothing, budget);
  if (value.number()) return Value(value.real() * unit->second);
  if (!value.is<std::string>() || !parse_real(value.as<std::string>(), number)) return std::nullopt;
  return Value(number * unit->second);
}

namespace {

class Converter {
 public:
  Converter(const std::filesystem::path& file, const SourceLocation& where)
      : file_(std::make_shared<const std::string>(file.string())), where_(where) {}

  Value value(const YAML::Node& node, int depth) {
    if (depth > kDeepestYaml) fail(node, "the YAML is nested too deeply");
    if (++count_ > kMostNodes) fail(node, "the YAML holds too much, its aliases counted");
    switch (node.Type()) {
      case YAML::NodeType::Scalar:
        return scalar(node);
      case YAML::NodeType::Sequence: {
        ValueList out;
        for (const auto& item : node) out.push_back(value(item, depth + 1));
        return Value::list(std::move(out));
      }
      case YAML::NodeType::Map:
        return map(node, depth);
      default:
        return {};
    }
  }

  [[nodiscard]] SourceLocation place(const YAML::Mark& mark) const {
    return {file_, mark.line + 1, mark.column + 1,
            std::make_shared<SourceLocation::Within>(SourceLocation::Within{where_, "in load_yaml"})};
  }

 private:
  [[noreturn]] void fail(const YAML::Node& node, const std::string& what) const {
    throw InputError("xacro.yaml", place(node.Mark()), what);
  }

  Value map(const YAML::Node& node, int depth) {
    ValueDict out;
    try {
      for (const auto& entry : node) {
        if (entry.first.IsScalar() && entry.first.Scalar() == "<<" && entry.first.Tag() == "?")
          merge(entry.second, depth, out);
      }
      for (const auto& entry : node) {
        if (entry.first.IsScalar() && entry.first.Scalar() == "<<" && entry.first.Tag() == "?") continue;
        out.set(value(entry.first, depth + 1), value(entry.second, depth + 1));
      }
      return Value::dict(std::move(out), true);
    } catch (const ExpressionError& problem) {
      fail(node, problem.what());
    }
  }
  void merge(const YAML::Node& from, int depth, ValueDict& out) {
    const Value merged = value(from, depth + 1);
    ValueList maps{merged};
    if (merged.is<Value::List>()) maps = merged.values();
    for (const Value& one : maps) {
      if (!one.is<Value::Dict>()) fail(from, "'<<' needs a map");
      for (const auto& [key, item] : one.as<Value::Dict>().entries->dict) {
        if (out.find(key) == nullptr) out.set(key, item);
      }
    }
  }

  Value scalar(const YAML::Node& node) {
    const std::string &text = node.Scalar(), &tag = node.Tag();
    if (tag == "?" || tag.empty()) return yaml_scalar(text);
    if (tag == "!" || tag == "tag:yaml.org,2002:str") return Value(text);
    if (units().contains(tag)) return quantity(node);
    double number = 0;
    std::int64_t whole = 0;
    if (tag == "tag:yaml.org,2002:float" && parse_real(text, number)) return Value(number);
    if (tag == "tag:yaml.org,2002:int" && parse_integer(text, whole)) return Value(whole);
    if (tag == "tag:yaml.org,2002:bool" || tag == "tag:yaml.org,2002:null") return yaml_scalar(text);
    fail(node, fmt::format("the tag '{}' of '{}' is not known; there are !degrees, !radians, !meters, "
                           "!millimeters, !foot, !inches",
                           tag, text));
  }

  Value quantity(const YAML::Node& node) {
    std::string why = "it is no number";
    try {
      if (const auto value = yaml_quantity(node.Tag(), node.Scalar())) return *value;
    } catch (const ExpressionError& problem) {
      why = problem.what();
    }
    fail(node, fmt::format("'{} {}' cannot be evaluated: {}", node.Tag(), node.Scalar(), why));
  }

  std::shared_ptr<const std::string> file_;
  const SourceLocation& where_;
  std::int64_t count_ = 0;
};

// Documents are only counted; YAML::LoadAll would find them for ever in some texts that are no YAML.
class Ignoring : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
  }
  void OnMapEnd() override {}
};

bool more_than_one(const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  Ignoring ignoring;
  return parser.HandleNextDocument(ignoring) && parser.HandleNextDocument(ignoring);
}

}  // namespace

Value parse_whole_yaml(const std::string& text, const std::filesystem::path& file,
                       const SourceLocation& where) {
  Converter converter(file, where);
  try {
    if (more_than_one(text))
      throw InputError("xacro.yaml", converter.place(YAML::Mark()), "there is more than one document in it");
    return converter.value(YAML::Load(text), 0);
  } catch (const YAML::Exception& problem) {
    throw InputError("xacro.yaml", converter.place(problem.mark),
                     fmt::format("the YAML is not well-formed: {}", problem.msg));
  } catch (const ExpressionError& problem) {
    throw InputError("xacro.yaml", where, problem.what());
  }
}

Value parse_yaml(const std::string& text, const std::filesystem::path& file, const SourceLocation& where) {
  if (auto simple = parse_simple_yaml(text)) return *std::move(simple);
  return parse_whole_yaml(text, file, where);
}

Value load_yaml(const std::filesystem::path& file, const SourceLocation& where) {
  std::string text;
  try {
    text = read_file(file.string(), kLargest);
  } catch (const InputError&) {
    std::error_code none;
    const bool missing = !std::filesystem::exists(file, none);
    throw InputError(missing ? "xacro.file_not_found" : "file.unreadable", where,
                     fmt::format("the YAML file '{}' {}", file.string(),
                                 missing ? "does not exist" : "is no regular file of at most 4 MB"));
  }
  return parse_yaml(text, file, where);
}

}  // namespace doppel::xacro
