// YAML files as values, by yaml-cpp.
#include "doppel/description/xacro/detail/xacro_yaml.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <sstream>

#include "doppel/base/core/read_file.h"

namespace doppel::xacro {
namespace {

constexpr int kMaxYamlDepth = 50;
constexpr std::int64_t kMaxNodes = 200'000;
constexpr std::size_t kMaxBytes = std::size_t{4} << 20;

class Converter {
 public:
  Converter(const std::filesystem::path& file, const TreePlace& where)
      : file_(std::make_shared<const std::string>(file.string())), where_(where) {}

  Value value(const YAML::Node& node, int depth) {
    if (depth > kMaxYamlDepth) fail(node, "the YAML is nested too deeply");
    if (++count_ > kMaxNodes) fail(node, "the YAML is too large with its aliases expanded");
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
            std::make_shared<SourceLocation::Within>(SourceLocation::Within{locate(where_), "in load_yaml"})};
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
    if (yaml_unit(tag) != 0) return quantity(node);
    double number = 0;
    if (tag == "tag:yaml.org,2002:float" && parse_real(text, number)) return Value(number);
    if (auto whole = parse_whole(text); whole && tag == "tag:yaml.org,2002:int") return *std::move(whole);
    if (tag == "tag:yaml.org,2002:bool" || tag == "tag:yaml.org,2002:null") return yaml_scalar(text);
    fail(node, fmt::format("unknown tag '{}' of '{}'; known tags are !degrees, !radians, !meters, "
                           "!millimeters, !foot, !inches",
                           tag, text));
  }

  Value quantity(const YAML::Node& node) {
    std::string why = "it is not a number";
    try {
      if (const auto value = yaml_quantity(node.Tag(), node.Scalar())) return *value;
    } catch (const ExpressionError& problem) {
      why = problem.what();
    }
    fail(node, fmt::format("'{} {}' cannot be evaluated: {}", node.Tag(), node.Scalar(), why));
  }

  std::shared_ptr<const std::string> file_;
  const TreePlace& where_;
  std::int64_t count_ = 0;
};

// Counts documents without loading them; YAML::LoadAll does not terminate for some invalid texts.
class DocumentCounter : public YAML::EventHandler {
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
  DocumentCounter ignoring;
  return parser.HandleNextDocument(ignoring) && parser.HandleNextDocument(ignoring);
}

}  // namespace

Value parse_yaml(const std::string& text, const std::filesystem::path& file, const TreePlace& where) {
  Converter converter(file, where);
  try {
    if (more_than_one(text))
      throw InputError("xacro.yaml", converter.place(YAML::Mark()), "there is more than one document in it");
    return converter.value(YAML::Load(text), 0);
  } catch (const YAML::Exception& problem) {
    throw InputError("xacro.yaml", converter.place(problem.mark),
                     fmt::format("the YAML is not well-formed: {}", problem.msg));
  } catch (const ExpressionError& problem) {
    throw InputError("xacro.yaml", locate(where), problem.what());
  }
}

Value load_yaml(const std::filesystem::path& file, const TreePlace& where) {
  std::string text;
  try {
    text = read_file(file.string(), kMaxBytes);
  } catch (const InputError&) {
    std::error_code none;
    const bool missing = !std::filesystem::exists(file, none);
    throw InputError(missing ? "xacro.file_not_found" : "file.unreadable", locate(where),
                     fmt::format("the YAML file '{}' {}", file.string(),
                                 missing ? "does not exist" : "is not a regular file of at most 4 MB"));
  }
  return parse_yaml(text, file, where);
}

}  // namespace doppel::xacro
