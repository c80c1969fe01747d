#pragma once
// The walk over the tree: what each element of xacro does.

#include <deque>

#include "doppel/description/xacro.h"
#include "doppel/description/xacro_detail.h"

namespace doppel::xacro {

// Where an expansion stands: what names mean here, within which call or include, and how deep.
struct Context {
  Scope* scope = nullptr;
  MacroTable* macros = nullptr;
  std::shared_ptr<const SourceLocation::Within> within;
  int depth = 0;
};

// The children that are being made of one element, and that element's attributes: <xacro:attribute> and
// namespaces of includes go there.
struct Output {
  std::vector<XmlNode> nodes;
  std::vector<XmlAttribute>* parent = nullptr;
  int id = 0;  // tells it from every other one
};

class Expander {
 public:
  Expander(const PackageResolver& resolver, Diagnostics& diagnostics, XmlKeep keep)
      : diagnostics_(diagnostics),
        interpreter_(resolver, diagnostics),
        document_(interpreter_, nullptr, Scope::Kind::document),
        keep_(keep) {}

  XacroResult run(XmlNode root, const std::filesystem::path& file,
                  const std::vector<std::pair<std::string, std::string>>& arguments);

 private:
  // Which child of which element, for what depends on what follows.
  struct Child {
    const XmlNode& node;
    bool last;
  };
  using Handler = void (Expander::*)(const Child&, const Context&, Output&);
  static const std::unordered_map<std::string, Handler>& handlers();

  static SourceLocation placed(SourceLocation where, const Context& context) {
    if (context.within && !where.within) where.within = context.within;
    return where;
  }
  const XmlAttribute& required(const XmlNode& node, const char* name, const Context& context) const;
  Value value_of(const XmlAttribute& a, const Context& context) {
    return interpreter_.text(a.value, *context.scope, placed(a.where, context));
  }
  bool condition_of(const XmlAttribute* a, bool fallback, const Context& context);
  void check_attributes(const XmlNode& node, std::initializer_list<std::string_view> known,
                        const Context& context);
  void count_node(const XmlNode& node, const Context& context);
  Context deeper(const XmlNode& node, const Context& context, std::string what) const;
  Output make_output(std::vector<XmlAttribute>* parent) { return {{}, parent, ++outputs_}; }

  void children(const XmlNode& parent, const Context& context, Output& out);
  void element_child(const Child& child, const std::string& name, const Context& context, Output& out);
  void element(const XmlNode& in, const std::string& name, const Context& context, Output& out);
  void attributes(const XmlNode& in, const Context& context, std::vector<XmlAttribute>& out);
  void text(const XmlNode& in, const Context& context, Output& out, bool& eval_comments);
  void comment(const XmlNode& in, const Context& context, Output& out, bool& eval_comments);

  // ros/xacro drops the comments directly before its own elements; these two tell where that ends.
  void drop_comments(const Child& child, Output& out);
  void settle_barrier(const Output& out);
  [[nodiscard]] bool barrier_at(const Output& out, std::size_t position) const;

  void property(const Child& child, const Context& context, Output& out);
  void macro(const Child& child, const Context& context, Output& out);
  void include(const Child& child, const Context& context, Output& out);
  void argument(const Child& child, const Context& context, Output& out);
  void conditional(const Child& child, const Context& context, Output& out);
  void insert(const Child& child, const Context& context, Output& out);
  void dynamic_call(const Child& child, const Context& context, Output& out);
  void dynamic_element(const Child& child, const Context& context, Output& out);
  void added_attribute(const Child& child, const Context& context, Output& out);

  std::string property_name(const XmlNode& in, const Context& context);
  Scope* property_scope(const XmlNode& in, const std::string& name, const Context& context);

  // What a call needs while its parameters are bound.
  struct Call {
    const XmlNode& node;
    const Macro& macro;
    const Context& caller;  // whose names the arguments use
    Scope& inner;
    bool through_call;              // <xacro:call macro="...">
    std::vector<std::string> open;  // parameters without a value yet
  };
  void call(const Child& child, const std::string& name, bool through_call, const Context& context,
            Output& out);
  std::shared_ptr<const Macro> resolve_macro(const std::string& name, Context& context) const;
  void bind_attributes(Call& call);
  void bind_blocks(Call& call);
  void bind_defaults(Call& call);

  std::vector<std::filesystem::path> included_files(const std::string& name, const SourceLocation& where,
                                                    bool optional);
  void include_file(const std::filesystem::path& file, const Context& inside, Output& out);
  const XmlNode& document(const std::filesystem::path& file, const Context& inside);
  void lift_namespaces(const std::vector<XmlAttribute>& from, Output& out, const Context& context);

  Diagnostics& diagnostics_;
  Interpreter interpreter_;
  Scope document_;
  MacroTable macros_;
  XmlKeep keep_;
  std::deque<XmlDocument> documents_;  // bodies of macros and blocks point into them
  std::map<std::string, const XmlNode*> parsed_;
  std::vector<std::string> declared_;
  int outputs_ = 0;
  struct {
    int output = 0;
    std::size_t position = 0;
    bool settled = true;
  } barrier_;
};

}  // namespace doppel::xacro
