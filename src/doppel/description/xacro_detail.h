#pragma once
// What the parts of the xacro expander share.

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/expression.h"
#include "doppel/description/package_resolver.h"
#include "doppel/description/xml.h"

namespace doppel::xacro {

// What an expansion may use up before it counts as running away.
struct Budget {
  std::int64_t steps = 20'000'000;  // of the evaluator
  std::int64_t nodes = 400'000;     // of the output, and of copies on the way
  std::int64_t characters = 64'000'000;
  int deepest = 120;  // macro calls and includes within each other
};

struct Macro {
  struct Parameter {
    std::string name;                     // with its stars for a block: "*origin", "**parts"
    bool forwards = false;                // "^": takes the caller's property of that name
    std::optional<std::string> fallback;  // text, evaluated at the call
  };
  std::string name;
  std::vector<Parameter> parameters;
  std::vector<XmlNode> body;
  SourceLocation where;
};

class Interpreter;

// Properties and blocks of the document, a macro call or a namespace; what is not here is looked for in the
// parent.
class Scope : public NameScope {
 public:
  Scope(Interpreter& interpreter, Scope* parent) : interpreter_(interpreter), parent_(parent) {}

  std::optional<Value> find(const std::string& name) override;
  [[nodiscard]] std::vector<std::string> names() const override;
  [[nodiscard]] bool knows(const std::string& name) const;

  void set_text(const std::string& name, const std::string& text,
                const SourceLocation& where);  // evaluated at first use
  void set(const std::string& name, Value value);
  void remove(const std::string& name) { properties_.erase(name); }

  struct Block {
    std::vector<XmlNode> nodes;
    bool evaluated = false;
  };
  void set_block(const std::string& name, Block block) { blocks_[name] = std::move(block); }
  [[nodiscard]] const Block* find_block(const std::string& name) const;

  void add_macro(std::shared_ptr<const Macro> macro) { macros_[macro->name] = std::move(macro); }
  [[nodiscard]] std::shared_ptr<const Macro> find_macro(const std::string& name) const;
  void macro_names(std::vector<std::string>& out) const;
  void add_namespace(const std::string& name, std::shared_ptr<Scope> inner) {
    namespaces_[name] = std::move(inner);
  }

  [[nodiscard]] Scope* parent() const { return parent_; }
  [[nodiscard]] Scope& root() { return parent_ == nullptr ? *this : parent_->root(); }

 private:
  struct Property {
    std::string text;
    Value value;
    bool lazy = false, busy = false;
    SourceLocation where;
  };
  Value as_value();

  Interpreter& interpreter_;
  Scope* parent_;
  std::map<std::string, Property> properties_;
  std::map<std::string, Block> blocks_;
  std::map<std::string, std::shared_ptr<const Macro>> macros_;
  std::map<std::string, std::shared_ptr<Scope>> namespaces_;
};

// Evaluates texts with ${...} and $(...) in them.
class Interpreter {
 public:
  Interpreter(const PackageResolver& resolver, Diagnostics& diagnostics)
      : resolver_(resolver), diagnostics_(diagnostics) {}

  // A text that is one ${...} gives the value itself, everything else a string. Throws InputError at `where`.
  Value text(const std::string& text, Scope& scope, const SourceLocation& where);
  // Whether a condition's text is true.
  bool condition(const std::string& text, Scope& scope, const SourceLocation& where);
  // A file that `where`'s file names.
  [[nodiscard]] std::filesystem::path relative_to(const SourceLocation& where, const std::string& name) const;

  void set_argument(const std::string& name, std::string value) { arguments_[name] = std::move(value); }
  [[nodiscard]] bool has_argument(const std::string& name) const { return arguments_.contains(name); }
  [[nodiscard]] const std::set<std::string>& used_arguments() const { return used_arguments_; }
  [[nodiscard]] std::vector<std::filesystem::path>& files() { return files_; }
  [[nodiscard]] Budget& budget() { return budget_; }

 private:
  Value expression(const std::string& text, Scope& scope, const SourceLocation& where);
  Value substitution(const std::string& text, Scope& scope, const SourceLocation& where);
  Value argument(const std::string& name, const SourceLocation& where);
  std::string package(const std::string& name, const SourceLocation& where) const;
  Value xacro_module(const SourceLocation& where);

  const PackageResolver& resolver_;
  Diagnostics& diagnostics_;
  std::map<std::string, std::string> arguments_;
  std::set<std::string> used_arguments_;
  std::vector<std::filesystem::path> files_;
  Budget budget_;
  int depth_ = 0;
};

// A property's text as Python would read it as a literal: a number, a truth value, a quoted string; else
// itself.
Value literal(const std::string& text);

// A YAML file as values, with !degrees, !radians and the other units of xacro. Throws InputError.
Value load_yaml(const std::filesystem::path& file, const SourceLocation& where);

}  // namespace doppel::xacro
