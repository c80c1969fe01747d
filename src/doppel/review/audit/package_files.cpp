#include "doppel/review/audit/detail/package_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"
#include "doppel/review/audit/detail/path_text.h"
#include "doppel/scenario/resolve/side_files.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using package_files::joined, package_files::without_trailing_slash;

// '*' and '?' within one folder. Only the last '*' is extended again: the matches of earlier ones are final.
bool matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, star = std::string_view::npos, tried = 0;
  while (n < name.size()) {
    const bool any = p < pattern.size() && pattern[p] == '?' && name[n] != '/';
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      tried = n;
    } else if (any || (p < pattern.size() && pattern[p] == name[n])) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos && name[tried] != '/') {
      p = star + 1;
      n = ++tried;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

// -- setup.py
std::size_t closing(const std::string& text, std::size_t open) {
  const char opens = text[open], closes = opens == '[' ? ']' : ')';
  int depth = 0;
  for (std::size_t at = open; at < text.size(); ++at) {
    if (text[at] == '\'' || text[at] == '"') {
      at = text.find(text[at], at + 1);
      if (at == std::string::npos) break;
      continue;
    }
    if (text[at] == '#') {
      at = text.find('\n', at);
      if (at == std::string::npos) break;
      continue;
    }
    if (text[at] == opens) ++depth;
    if (text[at] == closes && --depth == 0) return at;
  }
  return std::string::npos;
}

// The texts between quotes, with their places.
std::vector<std::pair<std::string, std::size_t>> quoted(const std::string& text, std::size_t from,
                                                        std::size_t to) {
  std::vector<std::pair<std::string, std::size_t>> out;
  for (std::size_t at = from; at < to; ++at) {
    if (text[at] == '#') {
      at = std::min(text.find('\n', at), to);
      continue;
    }
    if (text[at] != '\'' && text[at] != '"') continue;
    const std::size_t end = text.find(text[at], at + 1);
    if (end == std::string::npos || end >= to) break;
    out.emplace_back(text.substr(at + 1, end - at - 1), at);
    at = end;
  }
  return out;
}

// One entry of data_files: (DESTINATION, SOURCES). The destination's texts come before the first comma
// outside brackets, so the entry is cut there.
std::size_t comma_of(const std::string& text, std::size_t open, std::size_t close) {
  int depth = 0;
  for (std::size_t at = open + 1; at < close; ++at) {
    if (text[at] == '\'' || text[at] == '"') {
      at = text.find(text[at], at + 1);
      if (at == std::string::npos) return std::string::npos;
    } else if (text[at] == '(' || text[at] == '[') {
      ++depth;
    } else if (text[at] == ')' || text[at] == ']') {
      --depth;
    } else if (text[at] == ',' && depth == 0) {
      return at;
    }
  }
  return std::string::npos;
}

// A glob's "[abc]" as "?": sufficient to find files that are certainly left out.
std::string without_classes(std::string pattern) {
  for (std::size_t at = pattern.find('['); at != std::string::npos; at = pattern.find('[')) {
    const std::size_t end = pattern.find(']', at);
    if (end == std::string::npos) break;
    pattern.replace(at, end - at + 1, "?");
  }
  return pattern;
}

void read_entry(const SideFile& file, std::size_t open, std::size_t close, InstallRules& out) {
  const std::string& text = file.text;
  const std::size_t comma = comma_of(text, open, close);
  if (comma == std::string::npos) {
    out.understood = false;
    return;
  }
  std::string to;
  for (const auto& [word, at] : quoted(text, open, comma)) {
    std::string part = word;
    if (part == "share" || part == "share/" || part == out.project) continue;
    if (part.starts_with("share/ament_index")) return;
    for (const std::string& prefix : {std::string("share/") + out.project, std::string("share/")}) {
      if (part.starts_with(prefix)) part.erase(0, prefix.size());
    }
    while (part.starts_with('/')) part.erase(0, 1);
    if (!part.empty())
      to = to.empty() ? without_trailing_slash(part) : to + "/" + without_trailing_slash(part);
  }
  const auto sources = quoted(text, comma, close);
  if (sources.empty()) {
    out.understood = false;
    return;
  }
  const auto add = [&](const std::string& written, std::size_t at) {
    const std::string source = without_classes(written);
    const bool pattern = source.find_first_of("*?") != std::string::npos;
    const std::string folder = to.empty() ? "." : to;
    out.paths.push_back({source, pattern,
                         pattern ? folder : joined(folder, fs::path(source).filename().string()),
                         file.place(at)});
  };
  // os.path.join('meshes', '*.stl') is one source in several texts.
  std::string from;
  const bool join = text.find("join", comma) < close;
  if (join) {
    for (const auto& [word, at] : sources)
      from = from.empty() ? without_trailing_slash(word) : from + "/" + word;
    add(from, open);
    return;
  }
  for (const auto& [word, at] : sources) add(word, at);
}

void read_data_files(const SideFile& file, InstallRules& out) {
  const std::string& text = file.text;
  const std::size_t key = text.find("data_files");
  if (key == std::string::npos) return;
  const std::size_t after = text.find_first_not_of(" \t\n", text.find_first_of("=", key) + 1);
  const std::size_t open = after != std::string::npos && text[after] == '[' ? after : std::string::npos;
  const std::size_t close = open == std::string::npos ? open : closing(text, open);
  if (close == std::string::npos || text.find("for ", open) < close ||
      text.find("os.walk") != std::string::npos || text.find("data_files", key + 1) != std::string::npos) {
    out.understood = false;
    return;
  }
  for (std::size_t at = open + 1; at < close; ++at) {
    if (text[at] == '#') {
      at = std::min(text.find('\n', at), close);
      continue;
    }
    if (text[at] == '*') out.understood = false;  // *generated(...)
    if (text[at] != '(') continue;
    const std::size_t end = closing(text, at);
    if (end == std::string::npos) {
      out.understood = false;
      return;
    }
    read_entry(file, at, end, out);
    at = end;
  }
  // [...] + more
  const std::size_t next = text.find_first_not_of(" \t\n", close + 1);
  if (next != std::string::npos && text[next] == '+') out.understood = false;
}

}  // namespace

PackageManifest read_manifest(const fs::path& file) {
  const XmlNode root = parse_xml(read_side_file(file).text, file.string());
  if (!root.is("package")) {
    throw InputError("package.invalid", root.where,
                     fmt::format("the root element is <{}>, not <package>", root.name));
  }
  PackageManifest out;
  out.source = out.name_source = root.where;
  if (const XmlNode* name = root.first("name")) {
    out.name = name->content();
    out.name_source = name->where;
  }
  for (const char* required : {"name", "version", "description", "maintainer", "license"}) {
    const XmlNode* element = root.first(required);
    if (element == nullptr || (std::string_view(required) == "name" && element->content().empty())) {
      out.missing.emplace_back(required);
    }
  }
  for (const XmlNode& child : root.children) {
    if (child.is("version")) out.version = child.content();
    if (child.is("license")) out.licenses.push_back({child.content(), child.where});
    if (child.is("buildtool_depend") && child.content() == "catkin") out.catkin = true;
    for (const char* kind : {"depend", "exec_depend", "run_depend", "test_depend"}) {
      if (child.is(kind)) out.dependencies.push_back(child.content());
    }
  }
  const XmlNode* exports = root.first("export");
  const XmlNode* build_type = exports == nullptr ? nullptr : exports->first("build_type");
  if (build_type != nullptr) out.build_type = build_type->content();
  return out;
}

std::optional<std::string> InstallRules::installed(const std::string& file) const {
  for (const InstalledPath& path : paths) {
    if (path.pattern) {
      if (matches(path.from, file)) return joined(path.to, fs::path(file).filename().string());
    } else if (path.from == ".") {
      return joined(path.to, file);
    } else if (file == path.from) {
      return path.to;
    } else if (file.starts_with(path.from + "/")) {
      return joined(path.to, file.substr(path.from.size() + 1));
    }
  }
  return std::nullopt;
}

InstallRules read_setup_py(const fs::path& file) {
  InstallRules out;
  out.source = make_location(file.string(), 1, 1);
  const SideFile setup = read_side_file(file);
  const std::string& text = setup.text;
  const std::size_t name = text.find("package_name");
  if (name != std::string::npos) {
    const auto texts = quoted(text, name, std::min(text.size(), text.find('\n', name)));
    if (!texts.empty()) {
      out.project = texts.front().first;
      out.project_source = setup.place(name);
    }
  }
  read_data_files(setup, out);
  return out;
}

}  // namespace doppel
