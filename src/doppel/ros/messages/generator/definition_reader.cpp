#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <map>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/ros/messages/generator/definition.h"

namespace doppel::message_generator {
namespace {

template <class T>
bool is_number(std::string_view value) {
  T number{};
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  return error == std::errc() && end == value.data() + value.size();
}
bool is_boolean(std::string_view value) {
  return value == "true" || value == "false";
}
bool is_text(std::string_view value) {
  return value.size() >= 2 && value.starts_with('"') && value.ends_with('"');
}
bool is_nothing(std::string_view) {
  return false;
}

constexpr BasicType kBasicTypes[] = {
    {"bool", "boolean", "bool", "boolean", is_boolean},
    {"byte", "byte", "std::byte", "octet", is_number<std::uint8_t>},
    {"char", "uint8", "std::uint8_t", "uint8", is_number<std::uint8_t>},
    {"int8", "int8", "std::int8_t", "int8", is_number<std::int8_t>},
    {"uint8", "uint8", "std::uint8_t", "uint8", is_number<std::uint8_t>},
    {"int16", "int16", "std::int16_t", "int16", is_number<std::int16_t>},
    {"uint16", "uint16", "std::uint16_t", "uint16", is_number<std::uint16_t>},
    {"int32", "int32", "std::int32_t", "int32", is_number<std::int32_t>},
    {"uint32", "uint32", "std::uint32_t", "uint32", is_number<std::uint32_t>},
    {"int64", "int64", "std::int64_t", "int64", is_number<std::int64_t>},
    {"uint64", "uint64", "std::uint64_t", "uint64", is_number<std::uint64_t>},
    {"float32", "float32", "float", "float", is_number<float>},
    {"float64", "float64", "double", "double", is_number<double>},
    {"string", "text", "std::string", "string", is_text},
    {"wstring", "wide_text", "std::u16string", "wstring", is_nothing}};

constexpr std::string_view kNameChars = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
const std::vector<std::string> kKinds = {"msg", "srv", "action"};

std::size_t part_count(std::string_view kind) {
  return kind == "msg" ? 1 : kind == "srv" ? 2 : 3;
}

std::string contents(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream)
    throw InputError("messages.unreadable", make_location(file.string()), "the file cannot be read",
                     "check its name and its permissions");
  return {std::istreambuf_iterator<char>(stream), {}};
}

class DefinitionsReader {
 public:
  explicit DefinitionsReader(std::span<const std::filesystem::path> files) {
    for (const auto& file : files) files_[file.stem().string()] = file;
  }

  Definitions read() {
    for (const auto& [name, file] : files_) package(name);
    return std::move(definitions_);
  }

  // Reads the package's file at first use; nullptr: there is none, or it is being read, as in a cycle of
  // packages.
  const Package* package(const std::string& name);

  // nullptr: not defined so far.
  const Type* find(const std::string& full_name) const {
    const auto found = types_.find(full_name);
    return found == types_.end() ? nullptr : found->second;
  }
  // Messages of the package that are defined so far.
  [[nodiscard]] std::vector<std::string> messages(std::string_view package) const {
    std::vector<std::string> names;
    for (const Type& type : definitions_.types) {
      if (type.package == package && type.kind == "msg") names.push_back(type.name);
    }
    return names;
  }
  [[nodiscard]] std::vector<std::string> package_names() const {
    std::vector<std::string> names;
    for (const auto& [name, file] : files_) names.push_back(name);
    return names;
  }

  // nullptr: there is a type of this name.
  Type* add_type(std::string package, std::string kind, std::string name) {
    definitions_.types.push_back(
        {std::move(package), std::move(kind), std::move(name), definitions_.types.size(), {}});
    Type& type = definitions_.types.back();
    return types_.emplace(type.full_name(), &type).second ? &type : nullptr;
  }

 private:
  std::map<std::string, std::filesystem::path> files_;  // by package
  std::map<std::string, const Package*> packages_;      // nullptr: begun
  std::map<std::string, const Type*> types_;
  Definitions definitions_;
};

// Reads the lines of one file.
class FileReader {
 public:
  FileReader(DefinitionsReader& all, const std::filesystem::path& file, Package& package)
      : all_(all), file_(std::make_shared<const std::string>(file.string())), package_(package) {}

  void read(std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      line_ = text.substr(0, end);
      text.remove_prefix(std::min(end + 1, text.size()));
      ++number_;
      column_ = 0;
      read_line();
    }
    finish_interface();
  }

 private:
  void read_line() {
    const bool indented = line_.starts_with(' ');
    skip_blanks();
    if (at_end()) {
      // The comment at the top, up to the first empty line, is the package's.
      if (number_ == comments_.size() + 1 && package_.comments.empty())
        package_.comments = std::move(comments_);
      comments_.clear();
      return;
    }
    if (line_[column_] == '#') {
      comments_.push_back(comment());
      return;
    }
    if (!indented && !read_heading()) return;
    if (interface_ == nullptr)
      refuse(column_, "an indented line belongs to a type, and there is none above it",
             "write 'msg NAME:' first");
    read_declarations();
  }

  // Returns whether declarations may follow.
  bool read_heading() {
    const std::size_t start = column_;
    const std::string kind = word();
    skip_blanks();
    if (kind == "include") {
      package_.includes.emplace_back(line_.substr(column_));
      return false;
    }
    if (std::ranges::find(kKinds, kind) == kKinds.end())
      refuse(start, fmt::format("'{}' does not begin a type{}", kind, did_you_mean(kind, kKinds)),
             "begin a type with 'msg NAME:', 'srv NAME:' or 'action NAME:', and indent its other lines");
    finish_interface();
    const std::size_t name_start = column_;
    const std::string name = identifier("the type's name");
    if (at_end() || line_[column_] != ':')
      refuse(column_, "':' is missing behind the type's name", "write 'msg NAME:'");
    ++column_;
    package_.interfaces.push_back({kind, name, std::move(comments_), {}});
    interface_ = &package_.interfaces.back();
    comments_.clear();
    interface_start_ = {number_, name_start};
    begin_part();
    return true;
  }

  void finish_interface() {
    if (interface_ == nullptr || interface_->parts.size() == part_count(interface_->kind)) return;
    number_ = interface_start_.first;
    refuse(interface_start_.second,
           fmt::format("{} '{}' has {} of {} parts", interface_->kind, interface_->name,
                       interface_->parts.size(), part_count(interface_->kind)),
           "separate its parts by '---', also empty ones");
  }

  void begin_part() {
    const std::size_t part = interface_->parts.size();
    if (part == part_count(interface_->kind))
      refuse(column_, fmt::format("{} '{}' has no further part", interface_->kind, interface_->name),
             "remove the '---'");
    Type* type = all_.add_type(package_.name, interface_->kind,
                               interface_->name + std::string(part_suffix(interface_->kind, part)));
    if (type == nullptr)
      refuse(interface_start_.second, fmt::format("'{}' is defined twice", interface_->name),
             "remove one of the two");
    interface_->parts.push_back(type);
  }

  void read_declarations() {
    bool first_of_line = true;
    for (skip_blanks(); !at_end(); skip_blanks()) {
      if (line_[column_] == '#') {
        auto& declarations = interface_->parts.back()->declarations;
        if (first_of_line || declarations.empty()) {
          comments_.push_back(comment());
        } else {
          declarations.back().comment = comment();
        }
        return;
      }
      if (line_.substr(column_).starts_with("---")) {
        begin_part();
        column_ += 3;
      } else if (line_[column_] == ';') {
        ++column_;
      } else {
        read_declaration();
        first_of_line = false;
      }
    }
  }

  // "[from kilted]" or "[to jazzy]".
  DistroRange read_range() {
    const std::size_t start = ++column_;
    const std::string bound = word();
    if (bound != "from" && bound != "to")
      refuse(start, fmt::format("'{}' does not begin a range of distributions", bound),
             "write '[from DISTRO]' or '[to DISTRO]'");
    skip_blanks();
    const std::size_t name_start = column_;
    const std::string name = word();
    const std::optional<Distro> distro = distro_of(name);
    if (!distro)
      refuse(name_start,
             fmt::format("there is no distribution '{}'{}", name, did_you_mean(name, distro_names())),
             fmt::format("write one of {}", fmt::join(kDistroNames, ", ")));
    if (at_end() || line_[column_] != ']')
      refuse(column_, "']' is missing behind the distribution", "insert it");
    ++column_;
    skip_blanks();
    return bound == "from" ? DistroRange{.first = *distro} : DistroRange{.last = *distro};
  }

  void read_declaration() {
    Declaration declaration;
    if (line_[column_] == '[') declaration.range = read_range();
    declaration.type = read_type();
    declaration.comments = std::exchange(comments_, {});
    bool more = true;
    while (more) {
      skip_blanks();
      read_member(declaration);
      more = !at_end() && line_[column_] == ',';
      if (more) ++column_;
    }
    if (!at_end() && line_[column_] != ';' && line_[column_] != '#' &&
        !line_.substr(column_).starts_with("---"))
      refuse(column_, "';' is missing between two declarations", "insert it, or begin a line");
    interface_->parts.back()->declarations.push_back(std::move(declaration));
  }

  FieldType read_type() {
    const std::size_t start = column_;
    column_ = std::min(line_.find_first_of(" ;,#", column_), line_.size());
    const std::string_view text = line_.substr(start, column_ - start);
    std::size_t rest = std::min(text.find_first_of("<["), text.size());
    FieldType type = named_type(std::string(text.substr(0, rest)), start);
    const auto size_behind = [&](std::string_view opening, std::string_view closing) {
      std::size_t size = 0;
      const std::size_t digits = rest + opening.size();
      rest = std::min(text.find_first_not_of("0123456789", digits), text.size());
      std::from_chars(text.data() + digits, text.data() + rest, size);
      if (size == 0 || !text.substr(rest).starts_with(closing))
        refuse(start + digits, "a size is missing", "write it as in 'string<=5', 'int32[3]' or 'int32[<=3]'");
      rest += closing.size();
      return size;
    };
    if (text.substr(rest).starts_with("<=") && type.basic != nullptr && type.basic->kind.ends_with("text"))
      type.text_bound = size_behind("<=", "");
    const std::string_view brackets = text.substr(rest);
    if (brackets.starts_with("["))
      type.shape = brackets.starts_with("[]") || brackets.starts_with("[<=") ? "sequence" : "array";
    if (brackets.starts_with("[]")) {
      rest += 2;
    } else if (brackets.starts_with("[")) {
      type.size = size_behind(type.shape == "array" ? "[" : "[<=", "]");
    }
    if (rest < text.size())
      refuse(start + rest, fmt::format("'{}' does not belong to a type", text.substr(rest)),
             "write a list as 'TYPE[]', 'TYPE[3]' or 'TYPE[<=3]', and a bounded text as 'string<=5'");
    return type;
  }

  FieldType named_type(const std::string& name, std::size_t start) {
    const auto basic = std::ranges::find(kBasicTypes, std::string_view(name), &BasicType::name);
    if (basic != std::end(kBasicTypes)) return {.basic = &*basic};
    const std::size_t slash = name.find('/');
    const bool in_package = slash == std::string::npos;
    const std::string package = in_package ? package_.name : name.substr(0, slash);
    if (!in_package && package != package_.name && all_.package(package) == nullptr) {
      const std::vector<std::string> names = all_.package_names();
      const bool begun = std::ranges::find(names, package) != names.end();
      refuse(start,
             begun ? fmt::format("the package '{}' uses this one", package)
                   : fmt::format("there is no package '{}'{}", package, did_you_mean(package, names)),
             begun ? "remove one of the uses: packages must not use each other"
                   : "correct the name, or define the package in a file of its name");
    }
    const std::string message = in_package ? name : name.substr(slash + 1);
    const Type* type = all_.find(package + "/msg/" + message);
    if (type == nullptr) {
      std::vector<std::string> names = all_.messages(package);
      if (in_package)
        std::ranges::transform(kBasicTypes, std::back_inserter(names),
                               [](auto& t) { return std::string(t.name); });
      refuse(start, fmt::format("there is no type '{}'{}", name, did_you_mean(message, names)),
             "correct the name, or define the type above its use");
    }
    if (package != package_.name) package_.uses.insert(package);
    return {.message = type};
  }

  void read_member(Declaration& declaration) {
    const std::size_t start = column_;
    const std::string name = identifier("a name");
    const Type& type = *interface_->parts.back();
    const auto is_used = [&name](const Declaration& other) {
      return std::ranges::find(other.members, name, &Member::name) != other.members.end();
    };
    if (is_used(declaration) || std::ranges::any_of(type.declarations, is_used))
      refuse(start, fmt::format("'{}' has two members '{}'", type.name, name), "rename one of them");
    skip_blanks();
    const bool constant = !at_end() && line_[column_] == '=';
    if (constant) ++column_;
    if (constant && declaration.range != DistroRange{})
      refuse(start, "a constant is in all distributions", "remove the range");
    if (!declaration.members.empty() && constant != declaration.constant)
      refuse(start, "a declaration has either fields or constants", "separate them by ';'");
    declaration.constant = constant;
    skip_blanks();
    declaration.members.push_back({name, value(declaration.type)});
    if (constant && declaration.members.back().value.empty())
      refuse(column_, fmt::format("the constant '{}' has no value", name), "write 'NAME=VALUE'");
  }

  // A default or a constant; empty: there is none.
  std::string value(const FieldType& type) {
    const std::size_t start = column_;
    if (at_end() || line_.substr(start).starts_with("---")) return {};
    if (line_[start] == '"') {
      const std::size_t end = line_.find('"', start + 1);
      if (end == std::string_view::npos) refuse(start, "the text has no end", "write '\"' behind it");
      column_ = end + 1;
    } else {
      column_ = std::min(line_.find_first_of(" ;,#", start), line_.size());
    }
    const std::string text(line_.substr(start, column_ - start));
    if (text.empty()) return {};
    if (type.basic == nullptr || type.shape != "single")
      refuse(start, "only a single number, bool or string has a value", "remove the value");
    if (!type.basic->accepts(text))
      refuse(start, fmt::format("{} is not a value of {}", text, type.basic->name),
             "correct the value or the type");
    skip_blanks();
    return text;
  }

  std::string identifier(std::string_view what) {
    const std::size_t start = column_;
    std::string name = word();
    if (name.empty() || (name[0] >= '0' && name[0] <= '9'))
      refuse(start, fmt::format("{} is missing", what),
             "write letters, digits and '_', beginning with a letter");
    return name;
  }
  std::string word() {
    const std::size_t start = column_;
    column_ = std::min(line_.find_first_not_of(kNameChars, column_), line_.size());
    return std::string(line_.substr(start, column_ - start));
  }
  // From '#' to the end of the line.
  std::string comment() {
    std::string_view text = line_.substr(column_ + 1);
    column_ = line_.size();
    if (text.starts_with(' ')) text.remove_prefix(1);
    return std::string(text);
  }
  void skip_blanks() { column_ = std::min(line_.find_first_not_of(" \t\r", column_), line_.size()); }
  [[nodiscard]] bool at_end() const { return column_ == line_.size(); }

  [[noreturn]] void refuse(std::size_t column, std::string message, std::string fix) const {
    throw InputError("messages.definition",
                     {file_, static_cast<int>(number_), static_cast<int>(column) + 1, nullptr},
                     std::move(message), std::move(fix));
  }

  DefinitionsReader& all_;
  std::shared_ptr<const std::string> file_;
  Package& package_;
  Interface* interface_ = nullptr;
  std::pair<std::size_t, std::size_t> interface_start_;  // line, column
  std::vector<std::string> comments_;                    // of the next type or declaration
  std::string_view line_;
  std::size_t number_ = 0, column_ = 0;
};

const Package* DefinitionsReader::package(const std::string& name) {
  const auto file = files_.find(name);
  if (file == files_.end()) return nullptr;
  const auto [entry, is_new] = packages_.emplace(name, nullptr);
  if (!is_new) return entry->second;
  Package package;
  package.name = name;
  FileReader(*this, file->second, package).read(contents(file->second));
  return entry->second = &definitions_.packages.emplace_back(std::move(package));
}

}  // namespace

std::string_view part_suffix(std::string_view kind, std::size_t part) {
  constexpr std::string_view kService[] = {"_Request", "_Response"},
                             kAction[] = {"_Goal", "_Result", "_Feedback"};
  if (kind == "msg") return "";
  return kind == "srv" ? kService[part] : kAction[part];
}

Definitions read_definitions(std::span<const std::filesystem::path> files) {
  return DefinitionsReader(files).read();
}

}  // namespace doppel::message_generator
