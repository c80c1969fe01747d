#pragma once
// Shared by the parts of the xacro expander: scopes of properties, tables of macros, and the interpreter of
// texts. Names and texts are views of the files that were read or of the interpreter's arena.

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/base/xml/xml_tree.h"
#include "doppel/description/xacro/detail/expression.h"
#include "doppel/description/xacro/detail/text_table.h"

namespace doppel::xacro {

// The limits of an expansion, which end an infinite one.
struct Budget {
  std::int64_t steps = 2'000'000;        // of the evaluator
  std::int64_t nodes = 300'000;          // of the output, and of copies on the way
  std::int64_t characters = 64'000'000;  // of generated texts; expressions count sixteenfold
  int deepest = 250;                     // macro calls and includes within each other
};

struct Macro {
  struct Parameter {
    std::string_view name;                     // with its stars for a block: "*origin", "**parts"
    bool forwards = false;                     // "^": takes the caller's property of that name
    std::optional<std::string_view> fallback;  // text, evaluated at the call
    [[nodiscard]] bool block() const { return name.starts_with('*'); }
  };
  std::string_view name;
  std::vector<Parameter> parameters;
  const TreeNode* element = nullptr;  // <xacro:macro>; its document outlives the expansion
  TreePlace where;
};

// Throws InputError at `where`.
std::vector<Macro::Parameter> parse_parameters(std::string_view text, const TreePlace& where);

// Macros by name; others are looked up in the parent. An include with a namespace has no parent.
class MacroTable {
 public:
  explicit MacroTable(MacroTable* parent = nullptr) : parent_(parent) {}
  void add(std::shared_ptr<const Macro> macro) {
    const std::string_view name = macro->name;
    macros_.set(name, std::move(macro));
  }
  void add_namespace(std::string_view name, std::shared_ptr<MacroTable> inner) {
    namespaces_.set(name, std::move(inner));
  }
  [[nodiscard]] std::shared_ptr<const Macro> find(std::string_view name) const;
  [[nodiscard]] MacroTable* find_namespace(std::string_view name) const;
  void names(std::vector<std::string>& out) const;

 private:
  MacroTable* parent_;
  TextTable<std::shared_ptr<const Macro>> macros_;
  TextTable<std::shared_ptr<MacroTable>> namespaces_;
};

class Interpreter;

// An element that insert_block inserts: itself, or its content.
struct Block {
  const TreeNode* node = nullptr;
  const TreeWithin* within = nullptr;
};

// Properties and blocks of the document, a macro call or a namespace; others are looked up in the parent.
// Names outlive the expansion.
class Scope : public NameScope {
 public:
  enum class Kind { document, macro, space };
  Scope(Interpreter& interpreter, Scope* parent, Kind kind)
      : interpreter_(interpreter), parent_(parent), kind_(kind) {}

  const Value* find(std::string_view name) override;
  [[nodiscard]] std::vector<std::string> names() const override;
  void retain() override;
  [[nodiscard]] bool retained() const { return retained_; }
  [[nodiscard]] bool knows(std::string_view name) const;

  // Evaluated at first use.
  void set_text(std::string_view name, std::string_view text, const TreePlace& where);
  void set(std::string_view name, Value value);
  // The value of the text as a literal: quotes are removed, and their content stays a text.
  void set_literal(std::string_view name, std::string_view text);
  // In this scope and in all enclosing ones.
  void remove(std::string_view name);

  // `name` with its stars.
  void set_block(std::string_view name, const Block& block) { blocks_.set(name, block); }
  [[nodiscard]] const Block* find_block(std::string_view stars, std::string_view name) const;

  void add_namespace(std::string_view name, std::shared_ptr<Scope> inner);
  [[nodiscard]] Scope* find_namespace(std::string_view name) const;

  [[nodiscard]] Scope* parent() const { return parent_; }
  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] Scope& root() { return parent_ == nullptr ? *this : parent_->root(); }

 private:
  struct Property {
    Value value;
    std::string_view text;
    TreePlace where;
    bool lazy = false, busy = false;
  };
  const Value& resolved(std::string_view name, Property& property);
  void put(std::string_view name, Property property);

  Interpreter& interpreter_;
  Scope* parent_;
  Kind kind_;
  bool retained_ = false;
  TextTable<Property> properties_;
  TextTable<Block> blocks_;
  TextTable<std::shared_ptr<Scope>> namespaces_;
  std::vector<std::shared_ptr<Scope>> old_namespaces_;  // replaced, but values may refer to them
};

// A text in literal parts and parts that are evaluated.
struct TextPart {
  enum class Kind { plain, expression, substitution };
  Kind kind = Kind::plain;
  std::string_view text;
  const Expression* expression = nullptr;  // null: its text contains substitutions, or is not parsed yet
};

// Evaluates texts with ${...} and $(...) in them. The texts outlive the expansion.
class Interpreter {
 public:
  Interpreter(const PackageResolver& resolver, Diagnostics& diagnostics);

  // A text that is one ${...} gives the value itself, everything else a string. Throws InputError at `where`.
  Value text(std::string_view text, Scope& scope, const TreePlace& where);
  // The same as a text, in the arena.
  std::string_view string(std::string_view text, Scope& scope, const TreePlace& where);
  // True if a condition's text is true.
  bool condition(std::string_view text, Scope& scope, const TreePlace& where);

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
  [[nodiscard]] std::filesystem::path beside(std::string_view name) const;

  void set_argument(std::string_view name, std::string_view value) { arguments_[std::string(name)] = value; }
  [[nodiscard]] bool has_argument(std::string_view name) const { return arguments_.contains(name); }
  [[nodiscard]] const std::map<std::string, std::string, std::less<>>& arguments() const {
    return arguments_;
  }
  [[nodiscard]] const std::set<std::string, std::less<>>& used_arguments() const { return used_arguments_; }
  [[nodiscard]] std::vector<std::filesystem::path>& files() { return files_; }
  void add_file(const std::filesystem::path& file);
  // The documents that were read so far, for messages.
  void add_document(const TreeNode& root) { documents_.push_back(&root); }
  // "a.xacro -> b.xacro -> a.xacro" where the file that is being read includes itself; else "".
  [[nodiscard]] std::string include_loop() const;
  [[nodiscard]] Budget& budget() { return budget_; }
  [[nodiscard]] Diagnostics& diagnostics() { return diagnostics_; }
  [[nodiscard]] const TreePlace& here() const { return here_ == nullptr ? nowhere_ : *here_; }
  [[nodiscard]] Arena& arena() { return source_->arena; }
  // Keeps the arena's texts alive.
  [[nodiscard]] std::shared_ptr<TreeSource> source() const { return source_; }
  // xacro's own names: xacro, load_yaml, dotify, abs_filename.
  [[nodiscard]] const Value* global(std::string_view name) const { return globals_.find(name); }
  [[nodiscard]] const Value* global(std::string_view name, std::uint32_t hash) const {
    return globals_.find(name, hash);
  }
  void warn_of_global(std::string_view name);
  // Keeps a scope that is still referenced.
  void keep(std::unique_ptr<Scope> scope) { kept_.push_back(std::move(scope)); }

  // An argument's value; throws InputError where there is none.
  const std::string& argument(std::string_view name, const TreePlace& where);
  std::string_view package(std::string_view name, const TreePlace& where);
  Value yaml(const std::string& name, const TreePlace& where);
  // Throws ExpressionError.
  const Expression& compiled(std::string_view text);

 private:
  Value evaluated(const Expression& expression, std::string_view text, Scope& scope, const TreePlace& where);
  Value part(const TextPart& part, Scope& scope, const TreePlace& where);
  std::string_view substitution(std::string_view text, const TreePlace& where);
  std::string_view command(std::string_view inner, const TreePlace& where);
  std::span<const TextPart> parts(std::string_view text, const TreePlace& where);
  void charge(std::size_t characters, const TreePlace& where);

  const PackageResolver& resolver_;
  Diagnostics& diagnostics_;
  std::shared_ptr<TreeSource> source_ = std::make_shared<TreeSource>();
  std::map<std::string, std::string, std::less<>> arguments_;
  std::set<std::string, std::less<>> used_arguments_, warned_;
  std::vector<std::filesystem::path> files_, reading_;
  std::vector<const TreeNode*> documents_;
  std::set<std::string> known_files_;
  std::map<std::string, Value> yaml_files_;
  TextTable<Value> globals_;
  TextTable<std::string_view> packages_;
  TextTable<std::span<const TextPart>> texts_;
  TextTable<const Expression*> expressions_;
  ExpressionStore store_;
  std::vector<TextPart> cutting_;
  std::vector<std::unique_ptr<Scope>> kept_;
  Budget budget_;
  TreePlace nowhere_;
  const TreePlace* here_ = nullptr;
};

// xacro.load_yaml, xacro.message and the others.
TextTable<Value> xacro_globals(Interpreter& interpreter);

// $(eval ...): Python with the arguments as names, and with arg(), env(), optenv(), find(), dirname().
std::string eval_substitution(std::string_view text, Interpreter& interpreter, const TreePlace& where);

// A property's text as Python would read it as a literal: a number, a truth value, a quoted
// string; else itself.
Value literal(std::string_view text);
// A text as a literal; any other value unchanged.
Value interpreted(Value value);

// True if a condition's value is true; nothing: it is not a truth value.
std::optional<bool> truth_of(const Value& value);

// A YAML file as values, with !degrees, !radians and the other units of xacro, dotted. Throws InputError.
Value load_yaml(const std::filesystem::path& file, const TreePlace& where);
Value parse_yaml(const std::string& text, const std::filesystem::path& file, const TreePlace& where);

// A dict, and recursively its content, with its entries as attributes.
Value dotted(const Value& value);

}  // namespace doppel::xacro
