#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "doppel/description/overlay/detail/overlay.h"

namespace doppel::overlay_detail {
namespace {

struct Tolerance {
  double relative, absolute;
};

// Exporters round rotations and lengths to about six digits, so a corrected CAD model matches a computed
// result only to that accuracy; a limit is compared exactly, because the last digits may be the correction.
Tolerance tolerance_of(std::string_view key) {
  if (key == "lower" || key == "upper" || key == "effort" || key == "velocity") return {1e-9, 1e-12};
  if (key == "axis" || key == "xyz" || key == "com") return {0, 1e-6};
  return {1e-6, 1e-15};
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t begin = text.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(kBlanks, end);
  }
  return words;
}

bool same_word(std::string_view a, std::string_view b, const Tolerance& tolerance) {
  if (a == b) return true;
  const auto x = number_of(a), y = number_of(b);
  if (!x || !y) return false;
  const double slack = tolerance.absolute + tolerance.relative * std::max(std::abs(*x), std::abs(*y));
  return std::abs(*x - *y) <= slack;
}

}  // namespace

std::string number_text(double value) {
  return fmt::format("{}", value == 0 ? 0.0 : value);
}

std::string vector_text(const Eigen::Vector3d& v) {
  return fmt::format("{} {} {}", number_text(v.x()), number_text(v.y()), number_text(v.z()));
}

std::optional<double> number_of(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

std::optional<Eigen::Vector3d> vector_of(std::string_view text) {
  const auto words = words_of(text);
  if (words.size() != 3) return {};
  Eigen::Vector3d out;
  for (int i = 0; i < 3; ++i) {
    const auto value = number_of(words[static_cast<std::size_t>(i)]);
    if (!value) return {};
    out[i] = *value;
  }
  return out;
}

const std::string* find_fact(const Facts& facts, std::string_view key) {
  for (const auto& [name, value] : facts) {
    if (name == key) return &value;
  }
  return nullptr;
}

void set_fact(Facts& facts, const std::string& key, std::string value) {
  for (auto& [name, old] : facts) {
    if (name != key) continue;
    old = std::move(value);
    return;
  }
  facts.emplace_back(key, std::move(value));
}

bool same_fact(std::string_view key, const std::string& a, const std::string& b) {
  if (key == "rpy" || key == "inertial_rpy") {
    const auto x = vector_of(a), y = vector_of(b);
    if (x && y) return (rotation_from_rpy(*x) - rotation_from_rpy(*y)).norm() < 2e-6;
  }
  const auto x = words_of(a), y = words_of(b);
  if (x.size() != y.size()) return false;
  const Tolerance tolerance = tolerance_of(key);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!same_word(x[i], y[i], tolerance)) return false;
  }
  return true;
}

}  // namespace doppel::overlay_detail
