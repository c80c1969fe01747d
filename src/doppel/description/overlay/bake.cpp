#include "doppel/description/overlay/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <memory>

#include "doppel/base/core/output_file.h"
#include "doppel/description/overlay/detail/overlay.h"
#include "doppel/description/overlay/detail/source_text.h"
#include "doppel/description/overlay/detail/tree_edits.h"

namespace doppel {
namespace {

using namespace overlay_detail;
namespace fs = std::filesystem;
using Kind = TreeEdit::Kind;

const SourceLocation& place_of(const TreeEdit& edit) {
  if (edit.attribute.empty()) return edit.node->where;
  const XmlAttribute* attribute = edit.node->find(edit.attribute);
  return attribute != nullptr ? attribute->where : edit.node->where;
}

// The effect of an edit on its place, to compare the edits of one place with each other.
std::string effect(const TreeEdit& edit) {
  std::string out = fmt::format("{} {} {}", static_cast<int>(edit.kind), edit.attribute, edit.to);
  if (edit.inserted != nullptr) out += to_xml(*edit.inserted);
  return out;
}

// Counts the attributes and elements of the expansion that come from each place of the sources.
void count_places(const XmlNode& node, std::map<std::string, int>& count) {
  ++count[node.where.place()];
  for (const XmlAttribute& a : node.attributes) {
    if (a.where.place() != node.where.place()) ++count[a.where.place()];
  }
  for (const XmlNode& child : node.children) count_places(child, count);
}

class Baking {
 public:
  Baking(const ExpandedDescription& plain, const ExpandedDescription& corrected)
      : plain_(plain), edits_(tree_edits(plain.root, corrected.root)) {
    count_places(plain.root, count_);
  }

  std::vector<BakedFile> run();

 private:
  SourceText& source(const SourceLocation& where);
  void refuse(const TreeEdit& edit, const char* rule, const std::string& why);
  void apply(const TreeEdit& edit);
  void set_value(const TreeEdit& edit);
  bool set_argument(const TreeEdit& edit);
  void insert(const TreeEdit& edit);
  void write_place(std::vector<const TreeEdit*> there);
  void insert_text(SourceText& text, std::size_t at, const std::string& indent, const XmlNode& node,
                   bool before);
  void append_child(const TreeEdit& edit, SourceText& text, std::size_t at);
  [[nodiscard]] std::string guarded(std::string text) const;
  [[nodiscard]] std::string laid_out(const XmlNode& node, const std::string& indent) const;

  const ExpandedDescription& plain_;
  std::vector<TreeEdit> edits_;
  std::map<std::string, int> count_;
  std::map<std::string, std::unique_ptr<SourceText>> sources_;
  std::map<std::string, std::string> arguments_;  // place of a macro's argument -> its new value
  std::vector<Diagnostic> problems_;
};

SourceText& Baking::source(const SourceLocation& where) {
  auto& text = sources_[*where.file];
  if (text == nullptr) text = std::make_unique<SourceText>(*where.file);
  return *text;
}

std::string subject(const TreeEdit& edit) {
  if (edit.kind == Kind::insert) return fmt::format("a <{}> in <{}>", edit.inserted->name, edit.node->name);
  if (edit.attribute.empty()) return fmt::format("<{}>", edit.node->name);
  return fmt::format("{} of <{}>", edit.attribute, edit.node->name);
}

void Baking::refuse(const TreeEdit& edit, const char* rule, const std::string& why) {
  Diagnostic problem;
  problem.rule = rule;
  problem.where = place_of(edit);
  problem.message = fmt::format("{} cannot be written here: {}", subject(edit), why);
  problem.fix = "give this element its own value, or bake to a URDF file (-o FILE)";
  problems_.push_back(std::move(problem));
}

// A text that xacro does not change.
std::string Baking::guarded(std::string text) const {
  if (!plain_.was_xacro) return text;
  for (std::size_t at = text.find('$'); at != std::string::npos; at = text.find('$', at + 2)) {
    if (at + 1 < text.size() && (text[at + 1] == '{' || text[at + 1] == '(')) text.insert(at, "$");
  }
  return text;
}

std::string Baking::laid_out(const XmlNode& node, const std::string& indent) const {
  const std::string xml = guarded(to_xml(node));
  std::string out;
  std::size_t begin = xml.find('\n') + 1;  // without <?xml ?>
  while (begin < xml.size()) {
    const std::size_t end = std::min(xml.find('\n', begin), xml.size());
    out += (out.empty() ? "" : "\n" + indent) + xml.substr(begin, end - begin);
    begin = end + 1;
  }
  return out;
}

// The name that "${upper}" refers to; empty for everything that is more than a name.
std::string argument_name(std::string_view raw) {
  if (!raw.starts_with("${") || !raw.ends_with('}')) return "";
  const std::string_view name = raw.substr(2, raw.size() - 3);
  const bool plain = std::ranges::all_of(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; });
  return plain ? std::string(name) : "";
}

// "${upper}" in a macro that was called with upper="3.14": the call is the place, through any number of
// macros that pass it on.
bool Baking::set_argument(const TreeEdit& edit) {
  SourceLocation where = place_of(edit);
  SourceText* text = &source(where);
  auto at = text->offset(where.line, where.column);
  auto value = at ? text->value(*at, edit.attribute) : std::nullopt;
  std::string name = value ? argument_name(text->text(*value)) : "";
  while (!name.empty()) {
    if (where.within == nullptr || !where.within->what.starts_with("in macro")) return false;
    where = SourceLocation(where.within->call);
    text = &source(where);
    at = text->offset(where.line, where.column);
    if (!at || text->text().compare(*at, 1, "<") != 0) return false;
    const std::size_t end = text->text().find_first_of(" \t\r\n/>", *at);
    const auto call = text->tag(*at, text->text().substr(*at + 1, end - *at - 1));
    const auto attribute = call ? text->attribute(*call, name) : std::nullopt;
    value = attribute ? text->value(*attribute, name) : std::nullopt;
    if (!value) return false;
    name = argument_name(text->text(*value));
  }
  if (!value || where.within == place_of(edit).within) return false;  // no call was gone up to
  if (text->text(*value).find('$') != std::string_view::npos) return false;
  const auto [known, fresh] = arguments_.emplace(fmt::format("{}:{}", *where.file, value->begin), edit.to);
  if (known->second != edit.to) {
    refuse(edit, "bake.shared",
           fmt::format("an argument of the call at {} would need both values {} and {}", where.place(),
                       known->second, edit.to));
  } else if (fresh) {
    text->replace(*value, escape_xml(guarded(edit.to), true));
  }
  return true;
}

void Baking::set_value(const TreeEdit& edit) {
  const SourceLocation& where = place_of(edit);
  SourceText& text = source(where);
  const auto at = text.offset(where.line, where.column);
  const auto value = at ? text.value(*at, edit.attribute) : std::nullopt;
  if (!value) return refuse(edit, "bake.place", "the source does not contain it there");
  text.replace(*value, escape_xml(guarded(edit.to), true));
}

void Baking::insert_text(SourceText& text, std::size_t at, const std::string& indent, const XmlNode& node,
                         bool before) {
  const std::string made = laid_out(node, indent);
  text.replace({at, at}, before ? made + "\n" + indent : "\n" + indent + made);
}

// Before the end tag of the parent; a self-closing parent is expanded.
void Baking::append_child(const TreeEdit& edit, SourceText& text, std::size_t at) {
  const auto tag = text.tag(at, edit.node->name);
  const auto whole = text.element(at, edit.node->name);
  if (!tag || !whole) return refuse(edit, "bake.place", "the source does not contain that element there");
  const std::string indent = text.indentation(at), deeper = indent + "  ";
  const std::string made = laid_out(*edit.inserted, deeper);
  if (tag->closed) {
    text.replace({tag->attributes_end, tag->range.end},
                 fmt::format(">\n{}{}\n{}</{}>", deeper, made, indent, edit.node->name));
    return;
  }
  const std::size_t end = text.text().rfind('<', whole->end - 1);
  const std::size_t last = text.text().find_last_not_of(" \t\r\n", end - 1) + 1;
  const bool own_line = text.text().find('\n', last) < end;
  text.replace({last, last}, fmt::format("\n{}{}{}", deeper, made, own_line ? "" : "\n" + indent));
}

void Baking::insert(const TreeEdit& edit) {
  // Behind its preceding sibling, if that is on lines of its own in the same file as the parent.
  const bool at_root = edit.node == &plain_.root;
  const XmlNode* after = edit.after;
  if (after != nullptr && (after->where.file == nullptr || *after->where.file != *edit.node->where.file ||
                           count_[after->where.place()] != 1 || (at_root && after->where.within != nullptr)))
    after = nullptr;
  SourceText& text = source(edit.node->where);
  if (after != nullptr && after->kind == XmlNode::Kind::element) {
    const auto at = text.offset(after->where.line, after->where.column);
    const auto whole = at ? text.element(*at, after->name) : std::nullopt;
    if (whole) return insert_text(text, whole->end, text.indentation(*at), *edit.inserted, false);
  }
  const auto at = text.offset(edit.node->where.line, edit.node->where.column);
  if (!at) return refuse(edit, "bake.place", "the source does not contain that element there");
  append_child(edit, text, *at);
}

void Baking::apply(const TreeEdit& edit) {
  const SourceLocation& where = place_of(edit);
  SourceText& text = source(where);
  const auto at = text.offset(where.line, where.column);
  switch (edit.kind) {
    case Kind::set_value:
      return set_value(edit);
    case Kind::insert:
      return insert(edit);
    case Kind::add_attribute: {
      const auto tag = at ? text.tag(*at, edit.node->name) : std::nullopt;
      if (!tag) return refuse(edit, "bake.place", "the source does not contain that element there");
      const std::size_t end = tag->attributes_end;
      return text.replace({end, end},
                          fmt::format(" {}=\"{}\"", edit.attribute, escape_xml(guarded(edit.to), true)));
    }
    case Kind::remove_attribute: {
      const auto value = at ? text.value(*at, edit.attribute) : std::nullopt;
      if (!value) return refuse(edit, "bake.place", "the source does not contain it there");
      return text.replace({*at, value->end + 1}, "");
    }
    case Kind::remove: {
      const auto whole = at ? text.element(*at, edit.node->name) : std::nullopt;
      if (!whole) return refuse(edit, "bake.place", "the source does not contain that element there");
      return text.replace(text.whole_lines(*whole), "");
    }
    case Kind::set_text: {
      if (!at || text.text().compare(*at, edit.from.size(), edit.from) != 0)
        return refuse(edit, "bake.expression", "the text there is computed, or written with references");
      return text.replace({*at, *at + edit.from.size()}, escape_xml(guarded(edit.to), false));
    }
  }
}

// All edits of one place: by the arguments of the calls they come from, or once for all.
void Baking::write_place(std::vector<const TreeEdit*> there) {
  std::erase_if(there,
                [&](const TreeEdit* edit) { return edit->kind == Kind::set_value && set_argument(*edit); });
  if (there.empty()) return;
  const TreeEdit& first = *there.front();
  const bool alike = std::ranges::all_of(there, [&](const auto* e) { return effect(*e) == effect(first); });
  const int shared = count_[place_of(first).place()];
  if (alike && static_cast<int>(there.size()) >= shared) return apply(first);
  for (const TreeEdit* edit : there) {
    refuse(*edit, "bake.shared",
           fmt::format("{} elements come from this place, and {} of them {} to change{}", shared,
                       there.size(), there.size() == 1 ? "is" : "are", alike ? "" : ", not all alike"));
  }
}

std::vector<BakedFile> Baking::run() {
  std::map<std::string, std::vector<const TreeEdit*>> places;
  std::vector<std::string> order;
  for (const TreeEdit& edit : edits_) {
    const SourceLocation& where = place_of(edit);
    if (!where.known()) {
      refuse(edit, "bake.place", "its source location is unknown");
      continue;
    }
    // Several attributes may be added to one tag, several children to one parent: each is a change
    // of its own.
    const bool own = edit.kind == Kind::set_value || edit.kind == Kind::set_text;
    const std::string key = own ? where.place() : where.place() + '\n' + effect(edit);
    auto& there = places[key];
    if (there.empty()) order.push_back(key);
    there.push_back(&edit);
  }
  for (const std::string& key : order) write_place(places[key]);
  if (!problems_.empty()) throw InputError(std::move(problems_));
  std::vector<BakedFile> out;
  for (const auto& [file, text] : sources_) {
    std::string after = text->edited();
    if (after != text->text()) out.push_back({file, text->text(), std::move(after)});
  }
  return out;
}

std::string sorted_text(const XmlNode& root) {
  std::vector<std::string> parts;
  for (const XmlNode& child : root.children) {
    if (child.kind == XmlNode::Kind::element) parts.push_back(to_xml(child));
  }
  std::ranges::sort(parts);
  XmlNode alone = root;
  alone.children.clear();
  std::string out = to_xml(alone);
  for (const std::string& part : parts) out += part;
  return out;
}

void restore(const std::vector<BakedFile>& files, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) write_whole(files[i].file, files[i].before);
}

fs::path backup_of(const fs::path& file) {
  return file.parent_path() / fmt::format(".{}.before-bake", file.filename().string());
}

}  // namespace

std::vector<BakedFile> bake_in_place(const ExpandedDescription& plain, const ExpandedDescription& corrected) {
  return Baking(plain, corrected).run();
}

bool same_expansion(const XmlNode& a, const XmlNode& b) {
  return sorted_text(a) == sorted_text(b);
}

void write_baked(const std::vector<BakedFile>& files, const std::function<bool()>& holds) {
  std::error_code none;
  for (const BakedFile& file : files) write_whole(backup_of(file.file), file.before);
  std::size_t written = 0;
  const auto forget = [&] {
    for (const BakedFile& file : files) fs::remove(backup_of(file.file), none);
  };
  try {
    for (const BakedFile& file : files) {
      write_whole(file.file, file.after);
      ++written;
    }
    if (!holds()) {
      throw InputError("bake.differs", make_location(files.front().file.string()),
                       "the patched sources would not expand to the corrected description",
                       "bake to a URDF file (-o FILE); nothing was changed");
    }
  } catch (...) {
    restore(files, written);
    forget();
    throw;
  }
  forget();
}

std::vector<std::pair<fs::path, fs::path>> settle_meshes(XmlNode& root, const fs::path& folder,
                                                         const std::string& prefix) {
  std::vector<std::pair<fs::path, fs::path>> copies;
  for (XmlNode& link : root.children) {
    if (!link.is("link")) continue;
    for (XmlNode& collision : link.children) {
      XmlNode* geometry = collision.is("collision") ? child_of(collision, "geometry") : nullptr;
      XmlNode* mesh = geometry != nullptr ? child_of(*geometry, "mesh") : nullptr;
      if (mesh == nullptr) continue;
      const std::string uri = attribute_of(*mesh, "filename");
      const fs::path from = uri.starts_with("file://") ? fs::path(uri.substr(7)) : fs::path();
      if (!from.parent_path().filename().string().starts_with("hull_")) continue;
      copies.emplace_back(from, folder / "meshes" / from.filename());
      set_attribute(*mesh, "filename", prefix + "meshes/" + from.filename().string(), mesh->where);
    }
  }
  return copies;
}

}  // namespace doppel
