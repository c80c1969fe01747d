#include "doppel/base/core/names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "doppel/base/core/text.h"

namespace doppel {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      const bool swapped =
          i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

namespace {

// Runs of letters and runs of digits, in lower case: "Left_Arm2" is left, arm, 2.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> out;
  int last = 0;
  for (const char raw : name) {
    const auto c = static_cast<unsigned char>(raw);
    const int kind = std::isdigit(c) != 0 ? 1 : std::isalpha(c) != 0 ? 2 : 0;
    if (kind != 0 && kind != last) out.emplace_back();
    if (kind != 0) out.back() += static_cast<char>(std::tolower(c));
    last = kind;
  }
  return out;
}

bool is_number(const std::string& word) {
  return std::isdigit(static_cast<unsigned char>(word.front())) != 0;
}

bool is_side(const std::string& word) {
  static const std::vector<std::string> sides{"left",  "right", "l",     "r",    "upper",
                                              "lower", "front", "rear",  "back", "fore",
                                              "hind",  "inner", "outer", "top",  "bottom"};
  return std::find(sides.begin(), sides.end(), word) != sides.end();
}

// The same words except for numbers and sides: a sibling, which is rarely a typo of the other name.
bool sibling(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  if (a.size() != b.size() || a == b) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool other_one = (is_number(a[i]) && is_number(b[i])) || (is_side(a[i]) && is_side(b[i]));
    if (a[i] != b[i] && !other_one) return false;
  }
  return true;
}

bool begins_with(std::string_view longer, std::string_view shorter) {
  return longer.size() > shorter.size() && edit_distance(longer.substr(0, shorter.size()), shorter) == 0;
}

// The rank is twice the edit distance; at the same distance, equal words or an extension precede a changed
// letter, and a changed letter precedes a sibling.
struct NameDistance {
  std::size_t distance, rank;
  bool is_sibling;
};

NameDistance nearness(std::string_view name, std::string_view candidate) {
  const std::vector<std::string> written = words_of(name), there = words_of(candidate);
  const bool reordered =
      written.size() > 1 && std::is_permutation(written.begin(), written.end(), there.begin(), there.end());
  if (reordered) return {1, 1, false};
  const std::size_t distance = edit_distance(name, candidate);
  if (begins_with(candidate, name) || begins_with(name, candidate))
    return {distance, 2 * distance - 1, false};
  const bool other_one = sibling(written, there);
  return {distance, 2 * distance + (other_one ? 2 : 0), other_one};
}

}  // namespace

std::optional<std::string> nearest_name(std::string_view name, std::span<const std::string> candidates) {
  const std::size_t furthest = std::max<std::size_t>(1, (name.size() + 2) / 3);
  const std::string* best = nullptr;
  std::size_t best_rank = 0;
  bool by_chance = false;  // several siblings are equally near
  for (const std::string& candidate : candidates) {
    // The distance is not less than the difference of the lengths, and a name from outside may be long.
    if (candidate.size() > name.size() + furthest || name.size() > candidate.size() + furthest) continue;
    const NameDistance near = nearness(name, candidate);
    if (near.distance > furthest || (best != nullptr && near.rank > best_rank)) continue;
    if (best != nullptr && near.rank == best_rank) {
      by_chance = by_chance || (near.is_sibling && candidate != *best);
      continue;
    }
    best = &candidate;
    best_rank = near.rank;
    by_chance = false;
  }
  return best == nullptr || by_chance ? std::nullopt : std::optional(*best);
}

namespace {

// The names that contain this one, as "tool_link_1" contains "tool"; those that begin with it are the first.
std::vector<std::string> names_with(std::string_view part, std::span<const std::string> candidates) {
  constexpr std::size_t kMinLetters = 2;
  std::vector<std::string> out;
  if (part.size() < kMinLetters) return out;
  const std::string lower = lowered(part);
  for (const std::string& candidate : candidates) {
    if (lowered(candidate).find(lower) != std::string::npos) out.push_back(candidate);
  }
  // Clang 14 cannot compile the range that std::ranges::stable_partition returns.
  std::stable_partition(out.begin(), out.end(),
                        [&](const std::string& one) { return begins_with(one, part); });
  return out;
}

std::string some_of(std::span<const std::string> names) {
  constexpr std::size_t kMaxShown = 5;
  const std::size_t shown = names.size() <= kMaxShown ? names.size() : kMaxShown - 1;
  std::string out;
  for (std::size_t i = 0; i < shown; ++i) {
    const bool last = i + 1 == names.size();
    out += fmt::format("{}'{}'", i == 0 ? "" : last ? " or " : ", ", names[i]);
  }
  if (names.size() > shown) out += fmt::format(" or one of {} others", names.size() - shown);
  return out;
}

}  // namespace

std::string did_you_mean(std::string_view name, std::span<const std::string> candidates) {
  constexpr std::size_t kMaxListed = 8;
  if (const auto near = nearest_name(name, candidates)) return fmt::format("; did you mean '{}'?", *near);
  if (candidates.empty()) return "";
  if (candidates.size() <= kMaxListed) return fmt::format("; there are: {}", fmt::join(candidates, ", "));
  const std::vector<std::string> longer = names_with(name, candidates);
  return longer.empty() ? "" : fmt::format("; did you mean {}?", some_of(longer));
}

}  // namespace doppel
