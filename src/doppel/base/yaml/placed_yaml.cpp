#include "doppel/base/yaml/placed_yaml.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <memory>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/utf8.h"
#include "doppel/base/core/yaml_fix.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxYamlBytes = std::size_t{4} << 20;  // parsed, it takes a hundred times as much

class Placer {
 public:
  explicit Placer(const std::filesystem::path& file)
      : file_(std::make_shared<const std::string>(file.string())) {}

  [[nodiscard]] SourceLocation place(const YAML::Mark& mark) const {
    SourceLocation where;
    where.file = file_;
    if (mark.is_null()) return where;
    where.line = mark.line + 1;
    where.column = mark.column + 1;
    return where;
  }

  // Aliases are copied, so that a text of a few lines can name itself, or a value a billion times.
  [[nodiscard]] PlacedYaml placed(const YAML::Node& node, const YamlRules& rules, int depth = 0) {
    PlacedYaml out;
    out.where = place(node.Mark());
    if (depth > kMaxDepth || ++values_ > kMaxValues) {
      throw InputError(
          rules.too_large, out.where,
          "the values are nested too deeply, or too many where aliases are replaced by what they name",
          "write the values without aliases (*name)");
    }
    if (node.IsScalar()) {
      out.kind = PlacedYaml::Kind::scalar;
      out.text = node.Scalar();
      if (!is_utf8(out.text))
        throw InputError(rules.syntax, out.where, "this text is not UTF-8", "save the file as UTF-8");
    } else if (node.IsSequence()) {
      out.kind = PlacedYaml::Kind::list;
      for (const auto& item : node) out.items.push_back(placed(item, rules, depth + 1));
    } else if (node.IsMap()) {
      out.kind = PlacedYaml::Kind::map;
      for (const auto& field : node) {
        out.keys.push_back(placed(field.first, rules, depth + 1));
        out.items.push_back(placed(field.second, rules, depth + 1));
      }
    } else {
      out.kind = PlacedYaml::Kind::null;
    }
    return out;
  }

 private:
  static constexpr int kMaxDepth = 200;
  static constexpr std::size_t kMaxValues = 1'000'000;

  std::shared_ptr<const std::string> file_;
  std::size_t values_ = 0;
};

}  // namespace

const PlacedYaml& PlacedYaml::operator[](std::string_view key) const {
  static const PlacedYaml kMissing;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i].is_scalar() && keys[i].text == key) return items[i];
  }
  return kMissing;
}

PlacedYaml load_yaml(const std::filesystem::path& file, const YamlRules& rules, const std::string& what) {
  Placer placer(file);
  const FileContent content = read_content(file, kMaxYamlBytes);
  if (!content.was_read()) {
    throw InputError(rules.unreadable, placer.place(YAML::Mark::null_mark()),
                     fmt::format("the {} cannot be read: {}", what, content.problem),
                     "give a file that exists and is readable");
  }
  try {
    return placer.placed(YAML::Load(content.bytes), rules);
  } catch (const YAML::ParserException& error) {
    throw InputError(rules.syntax, placer.place(error.mark), "this is not YAML: " + error.msg,
                     yaml_fix(error.msg));
  }
}

}  // namespace doppel
