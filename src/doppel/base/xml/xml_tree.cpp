#include "doppel/base/xml/xml_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <unordered_map>

namespace doppel {

const TreeWithin kTopLevel;

namespace {

std::string within_text(const TreeWithin& within) {
  return within.name.empty() ? std::string(within.what) : fmt::format("{} '{}'", within.what, within.name);
}

SourceLocation counted(const TreePlace& place) {
  if (!place.known()) return {};
  const std::string_view before = std::string_view(place.source->text).substr(0, place.offset);
  const auto lines = static_cast<int>(std::count(before.begin(), before.end(), '\n'));
  const std::size_t start = before.rfind('\n') + 1;  // npos + 1 is 0
  return {place.source->file, lines + 1, static_cast<int>(before.size() - start) + 1, nullptr};
}

// Copies a tree; finds lines by tables, and creates each step of an expansion once.
class Copier {
 public:
  void copy(const TreeNode& in, const TreeWithin* within, XmlNode& out) {
    out.kind = in.kind;
    out.cdata = in.cdata;
    out.name = in.name;
    out.text = in.text;
    if (in.where.within != nullptr) within = in.where.within;
    out.where = place(in.where, within);
    std::size_t attributes = 0, children = 0;
    for (const TreeAttribute* a = in.attributes; a != nullptr; a = a->next) ++attributes;
    for (const TreeNode* child = in.first; child != nullptr; child = child->next) ++children;
    out.attributes.reserve(attributes);
    for (const TreeAttribute* a = in.attributes; a != nullptr; a = a->next)
      out.attributes.push_back({std::string(a->name), std::string(a->value),
                                place(a->where, a->where.within != nullptr ? a->where.within : within)});
    out.children.resize(children);
    auto made = out.children.begin();
    for (const TreeNode* child = in.first; child != nullptr; child = child->next)
      copy(*child, within, *made++);
  }

 private:
  SourceLocation place(const TreePlace& where, const TreeWithin* within) {
    if (!where.known()) return {};
    const std::vector<std::uint32_t>& lines = lines_of(*where.source);
    const auto next = std::upper_bound(lines.begin(), lines.end(), where.offset);
    return {where.source->file, static_cast<int>(next - lines.begin()),
            static_cast<int>(where.offset - *(next - 1)) + 1, step(within)};
  }

  // The offset at which each line begins.
  const std::vector<std::uint32_t>& lines_of(const TreeSource& source) {
    if (&source == last_) return *last_lines_;
    const auto [at, anew] = lines_.try_emplace(&source);
    if (anew) {
      at->second.push_back(0);
      const char *const begin = source.text.data(), *const end = begin + source.text.size();
      for (const char* from = begin; from < end;) {
        const void* found = std::memchr(from, '\n', static_cast<std::size_t>(end - from));
        if (found == nullptr) break;
        from = static_cast<const char*>(found) + 1;
        at->second.push_back(static_cast<std::uint32_t>(from - begin));
      }
    }
    last_ = &source;
    last_lines_ = &at->second;
    return at->second;
  }

  std::shared_ptr<const SourceLocation::Within> step(const TreeWithin* within) {
    if (within == nullptr || within == &kTopLevel) return nullptr;
    if (within == last_within_) return last_step_;
    auto& made = steps_[within];
    if (!made) {
      auto step = std::make_shared<SourceLocation::Within>(
          SourceLocation::Within{place(within->call, within->call.within), within_text(*within)});
      steps_[within] = step;  // the map may have grown meanwhile
      last_within_ = within;
      return last_step_ = std::move(step);
    }
    last_within_ = within;
    return last_step_ = made;
  }

  std::unordered_map<const TreeSource*, std::vector<std::uint32_t>> lines_;
  std::unordered_map<const TreeWithin*, std::shared_ptr<const SourceLocation::Within>> steps_;
  const TreeSource* last_ = nullptr;
  const std::vector<std::uint32_t>* last_lines_ = nullptr;
  const TreeWithin* last_within_ = nullptr;
  std::shared_ptr<const SourceLocation::Within> last_step_;
};

}  // namespace

std::shared_ptr<const SourceLocation::Within> steps_of(const TreeWithin* within) {
  std::shared_ptr<const SourceLocation::Within> out;
  std::shared_ptr<const SourceLocation::Within>* end = &out;
  for (const TreeWithin* w = within; w != nullptr && w != &kTopLevel; w = w->call.within) {
    auto made =
        std::make_shared<SourceLocation::Within>(SourceLocation::Within{counted(w->call), within_text(*w)});
    std::shared_ptr<const SourceLocation::Within>* const next = &made->call.within;
    *end = std::move(made);
    end = next;
  }
  return out;
}

SourceLocation locate(const TreePlace& place) {
  SourceLocation out = counted(place);
  out.within = steps_of(place.within);
  return out;
}

XmlNode XmlTree::node() const {
  XmlNode out;
  if (root != nullptr) Copier().copy(*root, nullptr, out);
  return out;
}

}  // namespace doppel
