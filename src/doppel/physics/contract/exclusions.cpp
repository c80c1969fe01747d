#include "doppel/physics/contract/exclusions.h"

#include <algorithm>

#include "doppel/robot/collision/link_pairs.h"

namespace doppel {

Exclusions::Exclusions(const WorldSettings& settings, std::span<const ModelInstance> instances)
    : instances_(instances), ground_(settings.ground) {
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const ModelInstance& instance = instances[i];
    groups_.push_back(rigid_groups(*instance.model));
    for (const LinkPair& pair : link_pairs(*instance.model, instance.shapes, instance.self_collision)) {
      const int index = static_cast<int>(i);
      if (!pair.reason.empty()) pairs_[{{index, pair.a}, {index, pair.b}}] = {pair.reason, 0.0, false};
    }
  }
}

void Exclusions::keep(const CompiledWorld& before) {
  const auto renamed = [&](BodyId body) -> std::optional<BodyId> {
    if (body.is_ground()) return body;
    const ModelInstance& old = before.instances()[static_cast<std::size_t>(body.instance)];
    const int now = find_instance(instances_, old.name);
    if (now < 0 || instances_[static_cast<std::size_t>(now)].model != old.model) return std::nullopt;
    return BodyId{now, body.link};
  };
  for (const ExcludedPair& pair : before.excluded_pairs()) {
    if (!pair.at_start) continue;
    const auto a = renamed(pair.a), b = renamed(pair.b);
    if (a && b) pairs_[key_of(*a, *b)] = {pair.reason, pair.depth, true};
  }
}

bool Exclusions::fixed(BodyId body) const {
  if (body.is_ground()) return true;
  return groups_[static_cast<std::size_t>(body.instance)][static_cast<std::size_t>(body.link)] == 0;
}

// The ground counts as one.
bool Exclusions::is_object(BodyId body) const {
  return body.is_ground() || instances_[static_cast<std::size_t>(body.instance)].is_object();
}

bool Exclusions::contains(BodyId a, BodyId b) const {
  return (fixed(a) && fixed(b)) || pairs_.contains(key_of(a, b));
}

bool Exclusions::note(const Contact& contact) {
  const bool one_instance = contact.a.instance == contact.b.instance;
  if (!one_instance && (contact.depth < kOverlap || (is_object(contact.a) && is_object(contact.b))))
    return false;
  const auto [entry, fresh] = pairs_.try_emplace(key_of(contact.a, contact.b));
  if (fresh) entry->second = {one_instance ? "touching at the start" : "inside at the start", 0.0, true};
  if (!one_instance) entry->second.depth = std::max(entry->second.depth, contact.depth);
  return fresh;
}

std::vector<ExcludedPair> Exclusions::list() const {
  std::vector<ExcludedPair> out;
  const auto add = [&](bool one_instance) {
    for (const auto& [pair, entry] : pairs_) {
      if ((pair.first.instance == pair.second.instance) == one_instance)
        out.push_back({pair.first, pair.second, entry.reason, entry.depth, entry.at_start});
    }
  };
  add(true);
  add(false);
  add_fixed(out);
  for (ExcludedPair& pair : out) {
    if (is_object(pair.a) && !is_object(pair.b)) std::swap(pair.a, pair.b);
  }
  return out;
}

// Pairs of links of robots that are fixed to the world with the ground and with other fixed bodies.
void Exclusions::add_fixed(std::vector<ExcludedPair>& out) const {
  std::vector<BodyId> still;
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    for (std::size_t link = 0; link < groups_[i].size(); ++link) {
      if (groups_[i][link] == 0 && !instances_[i].shapes[link].empty())
        still.push_back({static_cast<int>(i), static_cast<int>(link)});
    }
  }
  for (const BodyId body : still) {
    if (instances_[static_cast<std::size_t>(body.instance)].is_object()) continue;
    if (ground_) out.push_back({body, {}, "fixed to the world", 0.0, false});
    for (const BodyId other : still) {
      const bool counted =
          other.instance < body.instance && !instances_[static_cast<std::size_t>(other.instance)].is_object();
      if (other.instance != body.instance && !counted)
        out.push_back({body, other, "both fixed to the world", 0.0, false});
    }
  }
}

}  // namespace doppel
