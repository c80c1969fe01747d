#pragma once
// The walk over the tree: the effect of each element of xacro.

#include <initializer_list>

#include "doppel/description/xacro/detail/xacro.h"
#include "doppel/description/xacro/xacro.h"

namespace doppel::xacro {

// The state of an expansion: the scope of names, the call or include, and the depth.
struct Context {
  Scope* scope = nullptr;
  MacroTable* macros = nullptr;
  const TreeWithin* within = &kTopLevel;
  int depth = 0;
};

// The attributes of an element that is being created. Where none of them needs evaluation they are those of
// the tree that was read, until one is added.
class Attributes {
 public:
  Attributes() = default;
  Attributes(TreeAttribute* first, bool shared) : first_(first), shared_(shared) {}

  [[nodiscard]] TreeAttribute* first() const { return first_; }
  [[nodiscard]] const TreeAttribute* find(std::string_view name) const;
  // Replaces the one of that name.
  void set(const TreeAttribute& made, Arena& arena);

 private:
  TreeAttribute* first_ = nullptr;
  bool shared_ = false;
};

// The children that are being created in one element, and that element's attributes: <xacro:attribute> and
// namespaces of includes are added to them.
struct Output {
  TreeList nodes;
  Attributes* parent = nullptr;
  int id = 0;  // unique
};

class Expander {
 public:
  Expander(const PackageResolver& resolver, Diagnostics& diagnostics)
      : diagnostics_(diagnostics),
        interpreter_(resolver, diagnostics),
        arena_(interpreter_.arena()),
        document_(interpreter_, nullptr, Scope::Kind::document) {}

  XacroResult run(XmlTree source, const std::filesystem::path& file,
                  const std::vector<std::pair<std::string, std::string>>& arguments);

 private:
  using Handler = void (Expander::*)(const TreeNode&, const Context&, Output&);
  struct Command {
    std::string_view name;
    Handler handler;
  };
  static std::span<const Command> commands();

  static TreePlace placed(TreePlace where, const Context& context) {
    if (where.within == nullptr) where.within = context.within;
    return where;
  }
  // For a message.
  static SourceLocation location_of(const TreePlace& where, const Context& context) {
    return locate(placed(where, context));
  }
  void audit_document(const XmlTree& tree, const TreeWithin& within);
  static const TreeAttribute& required(const TreeNode& node, std::string_view name, const Context& context);
  Value value_of(const TreeAttribute& a, const Context& context) {
    if (!a.dollar) return Value(std::string(a.value));
    return interpreter_.text(a.value, *context.scope, placed(a.where, context));
  }
  std::string_view text_of(const TreeAttribute& a, const Context& context) {
    if (!a.dollar) return a.value;
    return interpreter_.string(a.value, *context.scope, placed(a.where, context));
  }
  bool condition_of(const TreeAttribute* a, bool fallback, const Context& context);
  void check_attributes(const TreeNode& node, std::initializer_list<std::string_view> known,
                        const Context& context);
  void count_nodes(std::int64_t nodes, const TreeNode& node, const Context& context);
  Context deeper(const TreeNode& node, const Context& context, std::string_view what,
                 std::string_view name) const;
  TreeNode* copy_of(const TreeNode& in, const Context& context);
  Output make_output(Attributes* parent) { return {{}, parent, ++outputs_}; }

  void children(const TreeNode& parent, const Context& context, Output& out);
  void element_child(const TreeNode& in, std::string_view name, const Context& context, Output& out);
  void element(const TreeNode& in, std::string_view name, const Context& context, Output& out);
  Attributes attributes(const TreeNode& in, const Context& context);
  void text(const TreeNode& in, const Context& context, Output& out, bool& eval_comments);
  void comment(const TreeNode& in, const Context& context, Output& out, bool& eval_comments);

  // ros/xacro drops the comments directly before its own elements; these mark where that ends.
  void drop_comments(const TreeNode& in, Output& out);
  void settle_barrier(const Output& out);
  [[nodiscard]] bool barrier_behind(const Output& out, const TreeNode* node) const;

  void property(const TreeNode& in, const Context& context, Output& out);
  void macro(const TreeNode& in, const Context& context, Output& out);
  void include(const TreeNode& in, const Context& context, Output& out);
  void argument(const TreeNode& in, const Context& context, Output& out);
  void conditional(const TreeNode& in, const Context& context, Output& out);
  void insert(const TreeNode& in, const Context& context, Output& out);
  void dynamic_call(const TreeNode& in, const Context& context, Output& out);
  void dynamic_element(const TreeNode& in, const Context& context, Output& out);
  void added_attribute(const TreeNode& in, const Context& context, Output& out);

  std::string_view property_name(const TreeNode& in, const Context& context);
  Scope* property_scope(const TreeNode& in, std::string_view name, const Context& context);

  // The state of a call while its parameters are bound.
  struct Call {
    const TreeNode& node;
    const Macro& macro;
    const Context& caller;  // the arguments are evaluated in its scope
    Scope& inner;
    bool through_call;        // <xacro:call macro="...">
    std::vector<char> bound;  // for each parameter, whether it has a value
  };
  void call(const TreeNode& in, std::string_view name, bool through_call, const Context& context,
            Output& out);
  static std::shared_ptr<const Macro> resolve_macro(std::string_view name, Context& context);
  void bind_attributes(Call& call);
  void bind_blocks(Call& call);
  void bind_defaults(Call& call);

  std::vector<std::filesystem::path> included_files(std::string_view name, const TreePlace& where,
                                                    bool optional);
  void include_file(const std::filesystem::path& file, const Context& inside, Output& out);
  const TreeNode& document(const std::filesystem::path& file, const Context& inside);
  void lift_namespaces(const TreeAttribute* from, Output& out, const Context& context);

  Diagnostics& diagnostics_;
  Interpreter interpreter_;
  Arena& arena_;
  Scope document_;
  MacroTable macros_;
  XmlContent keep_ = XmlContent::everything;
  std::vector<std::shared_ptr<TreeSource>> sources_;  // they contain the bodies of macros and blocks
  std::map<std::string, const TreeNode*> parsed_;
  std::vector<std::string> declared_;
  int outputs_ = 0;
  struct {
    int output = 0;
    const TreeNode* behind = nullptr;  // null: at the beginning
    bool settled = true;
  } barrier_;
};

}  // namespace doppel::xacro
