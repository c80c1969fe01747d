#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/output_file.h"
#include "doppel/base/core/read_file.h"
#include "doppel/description/overlay/detail/overlay.h"

namespace doppel {
namespace {

using namespace overlay_detail;
namespace fs = std::filesystem;

constexpr std::size_t kMaxOverlayBytes = 4 << 20;

// The file's lines, each with its end, and the lines of every operation.
struct FileLines {
  std::vector<std::string> lines;
  struct Range {
    std::size_t begin, end;
  };
  std::vector<Range> operations;
};

std::size_t indentation(const std::string& line) {
  return std::min(line.find_first_not_of(' '), line.size());
}

bool is_blank_or_comment(const std::string& line, std::size_t item_column) {
  const std::size_t begin = line.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return true;
  return line[begin] == '#' && begin <= item_column;  // deeper ones belong to the operation
}

FileLines split(const std::string& text, const Overlay& overlay) {
  FileLines out;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1);
    out.lines.push_back(text.substr(begin, end - begin + 1));
    begin = end + 1;
  }
  if (!out.lines.empty() && !out.lines.back().ends_with('\n')) out.lines.back() += '\n';
  for (std::size_t i = 0; i < overlay.operations.size(); ++i) {
    const auto begin = static_cast<std::size_t>(overlay.operations[i].where.line - 1);
    std::size_t end = i + 1 < overlay.operations.size()
                          ? static_cast<std::size_t>(overlay.operations[i + 1].where.line - 1)
                          : out.lines.size();
    const std::size_t column = begin < out.lines.size() ? indentation(out.lines[begin]) : 0;
    while (end > begin + 1 && is_blank_or_comment(out.lines[end - 1], column)) --end;
    out.operations.push_back({begin, end});
  }
  return out;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& line : lines) out += line;
  return out;
}

// An operation as its own lines, indented as the list is.
std::vector<std::string> lines_of(const Operation& operation, std::size_t indent) {
  std::vector<std::string> out;
  const std::string text = to_yaml(operation);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    out.push_back(std::string(indent, ' ') + text.substr(begin, end - begin + 1));
    begin = end + 1;
  }
  return out;
}

std::size_t list_indent(const FileLines& lines) {
  return lines.operations.empty() ? 0 : indentation(lines.lines[lines.operations.front().begin]);
}

// Replaces the file only with a text that reads back as these operations.
void write_checked(const fs::path& file, const std::string& text, const std::vector<Operation>& meant) {
  Overlay wanted, got;
  wanted.operations = meant;
  bool good = false;
  try {
    good = to_yaml(parse_overlay(text, file.string())) == to_yaml(wanted);
  } catch (const InputError&) {
    good = false;
  }
  if (!good) {
    throw InputError("overlay.layout", make_location(file.string()),
                     "the file is laid out in a way that cannot be edited without rewriting it",
                     "write every operation as a list entry on its own lines, beginning with '- '");
  }
  write_whole(file, text);
}

std::string read_text(const fs::path& file) {
  return read_file(file.string(), kMaxOverlayBytes);
}

bool same_settings(const Operation& a, const Operation& b) {
  Operation x, y;
  x.action = a.action;
  y.action = b.action;
  return to_yaml(x) == to_yaml(y);
}

std::vector<std::string> written_keys(const OperationAction& action) {
  return fact_keys(action, XmlNode{});
}

// A setting of the same values replaces the older one, if no operation between them depends on it.
std::optional<std::size_t> replaced_by(const std::vector<Operation>& operations, const Operation& added) {
  const bool plain_setting =
      std::holds_alternative<SetLimit>(added.action) || std::holds_alternative<SetDynamics>(added.action) ||
      std::holds_alternative<SetServo>(added.action) || std::holds_alternative<SetInertia>(added.action) ||
      std::holds_alternative<ReplaceCollision>(added.action);
  if (!plain_setting) return {};
  for (std::size_t i = operations.size(); i-- > 0;) {
    const OperationAction& old = operations[i].action;
    if (std::holds_alternative<ScaleMasses>(old)) return {};
    if (operation_target(old) != operation_target(added.action)) continue;
    if (old.index() != added.action.index()) continue;
    if (written_keys(old) != written_keys(added.action)) continue;
    return i;
  }
  return {};
}

}  // namespace

fs::path overlay_path(const fs::path& description) {
  fs::path stem = description.filename();
  for (const char* ending : {".xacro", ".urdf"}) {
    if (stem.extension() == ending) stem.replace_extension();
  }
  return description.parent_path() / (stem.string() + ".overlay.yaml");
}

Overlay read_overlay(const fs::path& file) {
  return parse_overlay(read_text(file), file.string());
}

fs::path add_to_overlay(const fs::path& description, const std::vector<Operation>& operations) {
  const fs::path file = overlay_path(description);
  std::error_code none;
  const bool exists = fs::exists(file, none);
  std::string text = exists ? read_text(file)
                            : fmt::format(
                                  "# Corrections of {}, applied whenever doppel loads it.\n"
                                  "# 'doppel overlay show' prints their state.\n",
                                  description.filename().string());
  for (const Operation& added : operations) {
    if (added.was.empty()) {
      throw InputError("overlay.no_fingerprint", added.where,
                       fmt::format("'{}' has no fingerprint", describe(added.action)));
    }
    Overlay overlay = parse_overlay(text, file.string());
    if (std::ranges::any_of(overlay.operations, [&](const Operation& old) {
          return same_settings(old, added) && old.was == added.was;
        }))
      continue;
    FileLines lines = split(text, overlay);
    if (const auto old = replaced_by(overlay.operations, added)) {
      Operation merged = added;
      merged.was = overlay.operations[*old].was;  // the values of the CAD, not those of the old setting
      const auto [begin, end] = lines.operations[*old];
      const std::vector<std::string> made = lines_of(merged, list_indent(lines));
      const auto at = lines.lines.erase(lines.lines.begin() + static_cast<std::ptrdiff_t>(begin),
                                        lines.lines.begin() + static_cast<std::ptrdiff_t>(end));
      lines.lines.insert(at, made.begin(), made.end());
      overlay.operations[*old] = merged;
    } else {
      if (!lines.lines.empty() && lines.lines.back() != "\n") lines.lines.emplace_back("\n");
      const std::vector<std::string> made = lines_of(added, list_indent(lines));
      lines.lines.insert(lines.lines.end(), made.begin(), made.end());
      overlay.operations.push_back(added);
    }
    text = joined(lines.lines);
    if (to_yaml(parse_overlay(text, file.string())) != to_yaml(overlay))
      write_checked(file, text, overlay.operations);
  }
  write_whole(file, text);
  return file;
}

void remove_from_overlay(const Overlay& overlay, std::size_t i) {
  FileLines lines = split(read_text(overlay.file), overlay);
  auto [begin, end] = lines.operations.at(i);
  // One of the two blank lines around it is removed as well.
  if (begin > 0 && lines.lines[begin - 1] == "\n" && (end >= lines.lines.size() || lines.lines[end] == "\n"))
    --begin;
  lines.lines.erase(lines.lines.begin() + static_cast<std::ptrdiff_t>(begin),
                    lines.lines.begin() + static_cast<std::ptrdiff_t>(end));
  std::vector<Operation> rest = overlay.operations;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
  write_checked(overlay.file, joined(lines.lines), rest);
}

void stamp_overlay(const Overlay& overlay, std::size_t i, const Operation& stamped) {
  FileLines lines = split(read_text(overlay.file), overlay);
  const auto [begin, end] = lines.operations.at(i);
  const bool only_missing = overlay.operations[i].was.empty() &&
                            target_name(overlay.operations[i].action) == target_name(stamped.action) &&
                            lines.lines[begin].find('{') == std::string::npos;
  const std::vector<std::string> made = lines_of(stamped, list_indent(lines));
  const auto at = lines.lines.begin();
  if (only_missing) {
    lines.lines.insert(at + static_cast<std::ptrdiff_t>(end), made.back());
  } else {
    lines.lines.erase(at + static_cast<std::ptrdiff_t>(begin), at + static_cast<std::ptrdiff_t>(end));
    lines.lines.insert(lines.lines.begin() + static_cast<std::ptrdiff_t>(begin), made.begin(), made.end());
  }
  std::vector<Operation> meant = overlay.operations;
  meant[i] = stamped;
  write_checked(overlay.file, joined(lines.lines), meant);
}

ExpandedDescription expand_corrected(const fs::path& file, const XacroArguments& arguments,
                                     PackageResolver& resolver, Diagnostics& diagnostics) {
  ExpandedDescription expanded = expand_description(file, arguments, resolver, diagnostics);
  apply_overlays(expanded, resolver, diagnostics);
  return expanded;
}

LoadedDescription load_corrected(const fs::path& file, const XacroArguments& arguments,
                                 PackageResolver& resolver, Diagnostics& diagnostics) {
  const ExpandedDescription expanded = expand_corrected(file, arguments, resolver, diagnostics);
  LoadedDescription out;
  out.robot = read_description(expanded, resolver, diagnostics);
  diagnostics.throw_if_errors();
  out.files = expanded.files;
  return out;
}

}  // namespace doppel
