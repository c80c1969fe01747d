// Multipliers in the text of a controllers' file, with its comments and order.

#include <fmt/format.h>

#include <cstdlib>
#include <vector>

#include "doppel/lab/base_report/base_report.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out(1);
  for (const char c : text) {
    if (c == '\n') {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  return out;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string out;
  for (std::size_t i = 0; i < lines.size(); ++i) out += (i == 0 ? "" : "\n") + lines[i];
  return out;
}

[[noreturn]] void refuse(const SourceLocation& where, const std::string& name, double value) {
  throw InputError("base.not_editable", where,
                   fmt::format("{} cannot be written here without changing the form of the file", name),
                   fmt::format("write {}: {:.4f} yourself", name, value));
}

// The place of a scalar on its line. Throws InputError: it is not a number in block style.
std::pair<std::size_t, std::size_t> number_at(const std::vector<std::string>& lines,
                                              const SourceLocation& where, const std::string& name,
                                              double value) {
  if (where.line < 1 || static_cast<std::size_t>(where.line) > lines.size()) refuse(where, name, value);
  const std::string& line = lines[static_cast<std::size_t>(where.line) - 1];
  const std::size_t key = line.find_first_not_of(' ');
  const std::size_t begin = static_cast<std::size_t>(where.column) - 1;
  if (key == std::string::npos || begin >= line.size() || line.compare(key, name.size() + 1, name + ":") != 0)
    refuse(where, name, value);
  char* end = nullptr;
  std::strtod(line.c_str() + begin, &end);
  const std::size_t after = static_cast<std::size_t>(end - line.c_str());
  if (after == begin ||
      (after < line.size() && line[after] != ' ' && line[after] != '#' && line[after] != '\r'))
    refuse(where, name, value);
  return {begin, after};
}

void set_number(std::string& text, const std::filesystem::path& file, const std::string& controller,
                const std::string& name, double value) {
  ParameterOverrides of =
      ParameterFile::parse(text, file.string()).overrides_for("/" + controller, controller);
  std::vector<std::string> lines = lines_of(text);
  if (const ParameterOverride* const present = of.find(name)) {
    const auto [begin, end] = number_at(lines, present->source, name, value);
    std::string& line = lines[static_cast<std::size_t>(present->source.line) - 1];
    line.replace(begin, end - begin, fmt::format("{:.4f}", value));
  } else {
    // A new line below that of the track, which every such controller has.
    const ParameterOverride* const track = of.find("wheel_separation");
    if (track == nullptr) {
      throw InputError("base.not_editable", make_location(file.string()),
                       fmt::format("the file has no wheel_separation of {}", controller),
                       fmt::format("write {}: {:.4f} beside it yourself", name, value));
    }
    number_at(lines, track->source, "wheel_separation", value);
    const auto at = lines.begin() + track->source.line;
    const std::string& above = *(at - 1);
    const std::string indent = above.substr(0, above.find_first_not_of(' '));
    lines.insert(at, fmt::format("{}{}: {:.4f}{}", indent, name, value, above.ends_with('\r') ? "\r" : ""));
  }
  text = joined(lines);
}

}  // namespace

std::string with_multipliers(const std::string& text, const std::filesystem::path& file,
                             const std::string& controller, const BaseMultipliers& multipliers) {
  std::string out = text;
  set_number(out, file, controller, "wheel_separation_multiplier", multipliers.separation);
  set_number(out, file, controller, "left_wheel_radius_multiplier", multipliers.left_radius);
  set_number(out, file, controller, "right_wheel_radius_multiplier", multipliers.right_radius);
  return out;
}

}  // namespace doppel
