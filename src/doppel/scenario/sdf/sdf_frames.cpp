// Pose frame semantics: every frame's pose in its scope, and the link that it is attached to.
#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/scenario/sdf/detail/sdf_scope.h"

namespace doppel::sdf {
namespace {

constexpr int kMaxAttached = 200;
constexpr std::size_t kMaxChain = 1000;  // of relative poses, for the stack's sake

// "inner" and "frame" of "inner::frame".
std::pair<std::string, std::string> head_and_tail(const std::string& name) {
  const std::size_t at = name.find("::");
  if (at == std::string::npos) return {name, ""};
  return {name.substr(0, at), name.substr(at + 2)};
}

const char* name_of(Item::Kind kind) {
  switch (kind) {
    case Item::Kind::link:
      return "link";
    case Item::Kind::joint:
      return "joint";
    case Item::Kind::frame:
      return "frame";
    case Item::Kind::model:
      return "model";
  }
  return "";
}

}  // namespace

Item* Scope::find(std::string_view item) {
  const auto found = by_name_.find(std::string(item));
  return found == by_name_.end() ? nullptr : &items[found->second];
}

void Scope::add(Item item) {
  const auto [at, fresh] = by_name_.emplace(item.name, items.size());
  if (!fresh && item.kind == Item::Kind::link) at->second = items.size();
  items.push_back(std::move(item));
}

void Frames::unknown(const Scope& scope, const std::string& name, const SourceLocation& where) {
  if (!reported_.insert(where.place() + name).second) return;
  std::vector<std::string> known;
  for (const Item& item : scope.items) known.push_back(item.name);
  elements_.error("sdf.unknown_frame", where,
                  fmt::format("the {} '{}' has no frame '{}'{}", scope.is_world ? "world" : "model",
                              scope.name, name.substr(0, 80), did_you_mean(name.substr(0, 80), known)),
                  "name a link, joint, frame or model in it, or leave the attribute out");
}

Pose Frames::pose(Scope& scope, const std::string& name, const std::string& base,
                  const SourceLocation& where) {
  if (name.empty() || name == kModelFrame) {
    if (base.empty() || base == kModelFrame) return Pose::Identity();
    return pose(scope, base, "", where);
  }
  if (name == kWorldFrame && scope.is_world) return Pose::Identity();
  if (Item* const item = scope.find(name)) return pose(scope, *item);
  const auto [head, tail] = head_and_tail(name);
  Item* const item = tail.empty() ? nullptr : scope.find(head);
  if (item != nullptr && item->scope != nullptr) {
    const Pose X = pose(scope, *item);
    return X * pose(*item->scope, tail, "", where);
  }
  if (!tail.empty() && head == scope.name) return pose(scope, tail, base, where);  // its own name in front
  if (scope.is_stand_in) return Pose::Identity();
  if (name == scope.name) {
    elements_.diagnostics.note(
        "sdf.own_frame", where,
        fmt::format("'{}' is the model itself, which has no frame of that name; its own frame "
                    "'{}' is taken",
                    name, kModelFrame));
    return pose(scope, kModelFrame, base, where);
  }
  if (Item* const missing = missing_part(scope, name, where)) return pose(scope, *missing);
  unknown(scope, name, where);
  return Pose::Identity();
}

// The stand-in that a name "model::part" may mean: the name of a model that is not found is in its file.
Item* Frames::missing_part(Scope& scope, const std::string& name, const SourceLocation& where) {
  if (name.find("::") == std::string::npos) return nullptr;
  for (Item& item : scope.items) {
    if (item.scope == nullptr || !item.scope->is_stand_in) continue;
    if (reported_.insert(where.place() + name).second) {
      elements_.diagnostics.note(
          "sdf.missing_part", where,
          fmt::format("'{}' is taken for a part of '{}', which is not found", name, item.name));
    }
    return &item;
  }
  return nullptr;
}

Pose Frames::pose(Scope& scope, Item& item) {
  if (item.state == Item::State::done) return item.X;
  if (item.state == Item::State::busy) {
    std::string circle;
    const auto begin = std::find(path_.begin(), path_.end(), &item);
    for (auto at = begin; at != path_.end(); ++at) circle += fmt::format("'{}' -> ", (*at)->name);
    const SourceLocation& where = item.pose.where.known() ? item.pose.where : item.node->where;
    elements_.error(
        "sdf.frame_cycle", where,
        fmt::format("the poses are relative to each other in a circle: {}'{}'", circle, item.name),
        "give one of them a pose relative to the model");
    for (auto at = begin; at != path_.end(); ++at) const_cast<Item*>(*at)->state = Item::State::done;
    return Pose::Identity();
  }
  if (path_.size() >= kMaxChain) {
    const SourceLocation& where = item.pose.where.known() ? item.pose.where : item.node->where;
    throw InputError("sdf.too_deep", where,
                     fmt::format("more than {} poses are relative to each other in a chain", kMaxChain));
  }
  item.state = Item::State::busy;
  path_.push_back(&item);
  item.X = in(scope, item);
  path_.pop_back();
  item.state = Item::State::done;
  return item.X;
}

Pose Frames::in(Scope& scope, Item& item) {
  const SourceLocation& where = item.pose.relative_to.empty() ? item.node->where : item.pose.where;
  std::string relative = item.pose.relative_to;
  if (relative.empty() && item.kind == Item::Kind::joint)
    relative = item.child == kWorldFrame ? "" : item.child;
  if (relative.empty() && item.kind == Item::Kind::frame) relative = item.attached_to;
  if (relative == item.name && item.pose.relative_to.empty()) relative.clear();
  const Pose X = pose(scope, relative, item.base, where) * item.pose.X;
  return X * item.X_M_placement.inverse();
}

LinkRef Frames::canonical(Scope& scope) {
  if (!scope.canonical_link.empty()) {
    Scope* at = &scope;
    auto [head, tail] = head_and_tail(scope.canonical_link);
    while (!tail.empty()) {
      Item* const inner = at->find(head);
      if (inner == nullptr || inner->scope == nullptr) break;
      at = inner->scope.get();
      std::tie(head, tail) = head_and_tail(tail);
    }
    Item* const item = tail.empty() ? at->find(head) : nullptr;
    if (item != nullptr && item->kind == Item::Kind::link) return {at, item, true};
    if (item != nullptr && item->kind == Item::Kind::model && item->scope) return canonical(*item->scope);
    unknown(scope, scope.canonical_link, scope.node->where);
  }
  for (Item& item : scope.items) {
    if (item.kind == Item::Kind::link) return {&scope, &item, true};
  }
  for (Item& item : scope.items) {
    if (item.scope == nullptr) continue;
    if (const LinkRef inner = canonical(*item.scope); inner.found) return inner;
  }
  return {};
}

LinkRef Frames::link(Scope& scope, const std::string& name, const std::string& base,
                     const SourceLocation& where) {
  return link(scope, name, base, where, 0);
}

LinkRef Frames::link(Scope& scope, const std::string& name, const std::string& base,
                     const SourceLocation& where, int depth) {
  if (depth > kMaxAttached) {
    if (reported_.insert(where.place() + name).second)
      elements_.error("sdf.frame_cycle", where, fmt::format("the frame '{}' is attached to itself", name),
                      "attach one of the frames to a link");
    return {};
  }
  if (name == kWorldFrame) return {&scope, nullptr, true};
  if (name.empty() || name == kModelFrame) {
    if (!base.empty() && base != kModelFrame) return link(scope, base, "", where, depth + 1);
    return scope.is_world ? LinkRef{&scope, nullptr, true} : canonical(scope);
  }
  if (Item* const item = scope.find(name)) {
    switch (item->kind) {
      case Item::Kind::link:
        return {&scope, item, true};
      case Item::Kind::joint:
        return link(scope, item->child, item->base, where, depth + 1);
      case Item::Kind::frame:
        if (item->attached_to.empty() && scope.is_world && item->base.empty()) return {&scope, nullptr, true};
        return link(scope, item->attached_to, item->base, where, depth + 1);
      case Item::Kind::model:
        return item->scope ? canonical(*item->scope) : LinkRef{};
    }
  }
  const auto [head, tail] = head_and_tail(name);
  if (!tail.empty()) {
    Item* const item = scope.find(head);
    if (item != nullptr && item->scope != nullptr) return link(*item->scope, tail, "", where, depth + 1);
    if (head == scope.name) return link(scope, tail, base, where, depth + 1);
  }
  if (scope.is_stand_in) return canonical(scope);
  if (Item* const missing = missing_part(scope, name, where)) return canonical(*missing->scope);
  unknown(scope, name, where);
  return {};
}

void Frames::resolve_all(Scope& scope) {
  std::map<std::string, const Item*> seen;
  for (Item& item : scope.items) {
    const auto [before, fresh] = seen.emplace(fmt::format("{} {}", name_of(item.kind), item.name), &item);
    if (!fresh) {
      elements_.error("sdf.duplicate_name", item.node->where,
                      fmt::format("two {}s in '{}' are named '{}'; the first is at {}", name_of(item.kind),
                                  scope.name, item.name, before->second->node->where.place()),
                      "give each its own name");
    }
    pose(scope, item);
    if (item.kind == Item::Kind::frame && !item.attached_to.empty())
      link(scope, item.attached_to, item.base, item.node->where);
    if (item.scope != nullptr) resolve_all(*item.scope);
  }
}

}  // namespace doppel::sdf
