#pragma once
// What the parts of the xacro expander share: scopes of properties, tables of macros, and the interpreter of
// texts.

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/expression.h"
#include "doppel/description/package_resolver.h"
#include "doppel/description/xml.h"

namespace doppel::xacro {

// What an expansion may use up before it counts as running away.
struct Budget {
  std::int64_t steps = 2'000'000;  // of the evaluator
  std::int64_t nodes = 300'000;    // of the output, and of copies on the way
  std::int64_t characters = 64'000'000;
  int deepest = 250;  // macro calls and includes within each other
};

struct Macro {
  struct Parameter {
    std::string name;                     // with its stars for a block: "*origin", "**parts"
    bool forwards = false;                // "^": takes the caller's property of that name
    std::optional<std::string> fallback;  // text, evaluated at the call
    [[nodiscard]] bool block() const { return name.starts_with('*'); }
  };
  std::string name;
  std::vector<Parameter> parameters;
  const XmlNode* element = nullptr;  // <xacro:macro>; its document outlives the expansion
  SourceLocation where;
};

// Throws InputError at `where`.
std::vector<Macro::Parameter> parse_parameters(const std::string& text, const SourceLocation& where);

// Macros by name; what is not here is looked for in the parent. An include with a namespace has no parent.
class MacroTable {
 public:
  explicit MacroTable(MacroTable* parent = nullptr) : parent_(parent) {}
  void add(std::shared_ptr<const Macro> macro) { macros_[macro->name] = std::move(macro); }
  void add_namespace(const std::string& name, std::shared_ptr<MacroTable> inner) {
    namespaces_[name] = std::move(inner);
  }
  [[nodiscard]] std::shared_ptr<const Macro> find(const std::string& name) const;
  [[nodiscard]] MacroTable* find_namespace(const std::string& name) const;
  void names(std::vector<std::string>& out) const;

 private:
  MacroTable* parent_;
  std::unordered_map<std::string, std::shared_ptr<const Macro>> macros_;
  std::map<std::string, std::shared_ptr<MacroTable>> namespaces_;
};

class Interpreter;

// An element that insert_block puts in: itself, or what is in it.
struct Block {
  std::shared_ptr<const XmlNode> node;
  std::shared_ptr<const SourceLocation::Within> within;
};

// Properties and blocks of the document, a macro call or a namespace; what is not here is looked for in the
// parent.
class Scope : public NameScope {
 public:
  enum class Kind { document, macro, space };
  Scope(Interpreter& interpreter, Scope* parent, Kind kind)
      : interpreter_(interpreter), parent_(parent), kind_(kind) {}

  const Value* find(const std::string& name) override;
  [[nodiscard]] std::vector<std::string> names() const override;
  void retain() override;
  [[nodiscard]] bool retained() const { return retained_; }
  [[nodiscard]] bool knows(const std::string& name) const;

  // Evaluated at first use.
  void set_text(const std::string& name, const std::string& text, const SourceLocation& where);
  void set(const std::string& name, Value value);
  // Here and in all scopes around.
  void remove(const std::string& name);

  void set_block(const std::string& name, Block block) { blocks_[name] = std::move(block); }
  [[nodiscard]] const Block* find_block(const std::string& name) const;

  void add_namespace(const std::string& name, std::shared_ptr<Scope> inner);
  [[nodiscard]] Scope* find_namespace(const std::string& name) const;

  [[nodiscard]] Scope* parent() const { return parent_; }
  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] Scope& root() { return parent_ == nullptr ? *this : parent_->root(); }

 private:
  struct Property {
    std::string text;
    Value value;
    bool lazy = false, busy = false;
    SourceLocation where;
  };
  const Value& resolved(const std::string& name, Property& property);

  Interpreter& interpreter_;
  Scope* parent_;
  Kind kind_;
  bool retained_ = false;
  std::unordered_map<std::string, Property> properties_;
  std::unordered_map<std::string, Block> blocks_;
  std::map<std::string, std::shared_ptr<Scope>> namespaces_;
  std::vector<std::shared_ptr<Scope>> old_namespaces_;  // replaced, but values may refer to them
};

// A text cut into what stands for itself and what is evaluated.
struct TextPart {
  enum class Kind { plain, expression, substitution };
  Kind kind = Kind::plain;
  std::string text;
  std::shared_ptr<const Expression> expression;  // null: its text holds substitutions, or did not parse yet
};
// Throws InputError at `where`.
std::vector<TextPart> cut_text(const std::string& text, const SourceLocation& where);

// Evaluates texts with ${...} and $(...) in them.
class Interpreter {
 public:
  Interpreter(const PackageResolver& resolver, Diagnostics& diagnostics);

  // A text that is one ${...} gives the value itself, everything else a string. Throws InputError at `where`.
  Value text(const std::string& text, Scope& scope, const SourceLocation& where);
  std::string string(const std::string& text, Scope& scope, const SourceLocation& where);
  // Whether a condition's text is true.
  bool condition(const std::string& text, Scope& scope, const SourceLocation& where);

  // The file that is being read: names in it are relative to its folder.
  struct Reading {
    Reading(Interpreter& i, std::filesystem::path file) : interpreter(i) {
      interpreter.reading_.push_back(std::move(file));
    }
    ~Reading() { interpreter.reading_.pop_back(); }
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;
    Interpreter& interpreter;
  };
  [[nodiscard]] std::filesystem::path beside(const std::string& name) const;

  void set_argument(const std::string& name, std::string value) { arguments_[name] = std::move(value); }
  [[nodiscard]] bool has_argument(const std::string& name) const { return arguments_.contains(name); }
  [[nodiscard]] const std::map<std::string, std::string>& arguments() const { return arguments_; }
  [[nodiscard]] const std::set<std::string>& used_arguments() const { return used_arguments_; }
  [[nodiscard]] std::vector<std::filesystem::path>& files() { return files_; }
  void add_file(const std::filesystem::path& file);
  [[nodiscard]] Budget& budget() { return budget_; }
  [[nodiscard]] Diagnostics& diagnostics() { return diagnostics_; }
  [[nodiscard]] const SourceLocation& here() const { return here_ == nullptr ? nowhere_ : *here_; }
  // xacro's own names: xacro, load_yaml, dotify, abs_filename.
  [[nodiscard]] const Value* global(const std::string& name) const;
  void warn_of_global(const std::string& name);
  // Keeps a scope that something still refers to.
  void keep(std::unique_ptr<Scope> scope) { kept_.push_back(std::move(scope)); }

  // An argument's value; throws InputError where there is none.
  Value argument(const std::string& name, const SourceLocation& where);
  std::string package(const std::string& name, const SourceLocation& where) const;
  Value yaml(const std::string& name, const SourceLocation& where);

 private:
  Value evaluated(const Expression& expression, const std::string& text, Scope& scope,
                  const SourceLocation& where);
  Value part(const TextPart& part, Scope& scope, const SourceLocation& where);
  std::string substitution(const std::string& text, const SourceLocation& where);
  std::string command(const std::string& inner, const SourceLocation& where);
  const std::vector<TextPart>& parts(const std::string& text, const SourceLocation& where);
  std::shared_ptr<const Expression> compiled(const std::string& text);

  const PackageResolver& resolver_;
  Diagnostics& diagnostics_;
  std::map<std::string, std::string> arguments_;
  std::set<std::string> used_arguments_, warned_;
  std::vector<std::filesystem::path> files_, reading_;
  std::map<std::string, Value> yaml_files_, globals_;
  std::unordered_map<std::string, std::vector<TextPart>> texts_;
  std::vector<TextPart> uncached_;  // of a text beyond those that are kept
  std::unordered_map<std::string, std::shared_ptr<const Expression>> expressions_;
  std::vector<std::unique_ptr<Scope>> kept_;
  Budget budget_;
  SourceLocation nowhere_;
  const SourceLocation* here_ = nullptr;
};

// xacro.load_yaml, xacro.message and the others.
std::map<std::string, Value> xacro_globals(Interpreter& interpreter);

// $(eval ...): Python with the arguments as names, and with arg(), env(), optenv(), find(), dirname().
std::string eval_substitution(const std::string& text, Interpreter& interpreter, const SourceLocation& where);

// A property's text as Python would read it as a literal: a number, a truth value, a quoted string; else
// itself.
Value literal(const std::string& text);

// Whether a condition's value is true; nothing: it is no truth value.
std::optional<bool> truth_of(const Value& value);

// A YAML file as values, with !degrees, !radians and the other units of xacro, dotted. Throws InputError.
Value load_yaml(const std::filesystem::path& file, const SourceLocation& where);
Value parse_yaml(const std::string& text, const std::filesystem::path& file, const SourceLocation& where);

// A dict with all that is in it, its entries as attributes.
Value dotted(const Value& value);

}  // namespace doppel::xacro
