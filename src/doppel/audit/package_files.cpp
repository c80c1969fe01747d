#include "doppel/audit/package_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <map>

#include "doppel/core/diagnostic.h"
#include "doppel/core/text.h"
#include "doppel/description/xml.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

SourceLocation place_of(const fs::path& file, const std::string& text, std::size_t at) {
  const std::size_t line_start = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  const std::size_t column = line_start == std::string::npos ? at + 1 : at - line_start;
  return make_location(file.string(), static_cast<int>(line), static_cast<int>(column));
}

std::string without_trailing_slash(std::string path) {
  while (path.size() > 1 && path.ends_with('/')) path.pop_back();
  return path;
}

// '*' and '?' within one folder.
bool matches(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) return name.empty();
  if (pattern.front() == '*') {
    for (std::size_t skip = 0; skip <= name.size(); ++skip) {
      if (matches(pattern.substr(1), name.substr(skip))) return true;
      if (skip < name.size() && name[skip] == '/') return false;
    }
    return false;
  }
  if (name.empty() || (pattern.front() != '?' && pattern.front() != name.front())) return false;
  return matches(pattern.substr(1), name.substr(1));
}

std::string joined(const std::string& folder, const std::string& rest) {
  if (folder == ".") return rest;
  return rest.empty() ? folder : folder + "/" + rest;
}

// -- CMake
struct Command {
  std::string name;
  std::vector<std::string> arguments;
  std::size_t at = 0;
};

std::string without_comments(std::string text) {
  bool quoted = false, comment = false;
  for (char& c : text) {
    if (c == '\n') comment = false;
    if (c == '"' && !comment) quoted = !quoted;
    if (c == '#' && !quoted) comment = true;
    if (comment) c = ' ';
  }
  return text;
}

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> out;
  std::string word;
  bool quoted = false, any = false;
  for (const char c : text + " ") {
    const bool end = !quoted && (std::isspace(static_cast<unsigned char>(c)) != 0 || c == ';');
    if (c == '"') {
      quoted = !quoted;
      any = true;
    } else if (!end) {
      word += c;
    }
    if (end && (any || !word.empty())) {
      out.push_back(std::move(word));
      word.clear();
      any = false;
    }
  }
  return out;
}

std::vector<Command> commands_of(const std::string& text) {
  std::vector<Command> out;
  std::size_t at = 0;
  while (at < text.size()) {
    if (std::isalpha(static_cast<unsigned char>(text[at])) == 0 && text[at] != '_') {
      ++at;
      continue;
    }
    const std::size_t start = at;
    while (at < text.size() && (std::isalnum(static_cast<unsigned char>(text[at])) != 0 || text[at] == '_'))
      ++at;
    const std::string name = lowered(text.substr(start, at - start));
    while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) != 0) ++at;
    if (at >= text.size() || text[at] != '(') continue;
    int depth = 0;
    const std::size_t open = at;
    while (at < text.size()) {
      if (text[at] == '(') ++depth;
      if (text[at] == ')' && --depth == 0) break;
      ++at;
    }
    out.push_back({std::move(name), words(text.substr(open + 1, at - open - 1)), start});
  }
  return out;
}

class CMakeReader {
 public:
  CMakeReader(const fs::path& file, InstallRules& out)
      : file_(file), text_(without_comments(read_text(file))), out_(out) {}

  void read() { run(commands_of(text_)); }

 private:
  using Variables = std::map<std::string, std::string>;

  void run(const std::vector<Command>& commands) {
    for (std::size_t i = 0; i < commands.size(); ++i) {
      const Command& c = commands[i];
      if (c.name == "project" && !c.arguments.empty()) {
        out_.project = c.arguments.front();
        out_.project_source = place_of(file_, text_, c.at);
        variables_["PROJECT_NAME"] = out_.project;
      } else if (c.name == "set" && c.arguments.size() == 2) {
        variables_[c.arguments[0]] = c.arguments[1];
      } else if (c.name == "foreach") {
        i = loop(commands, i);
      } else if (c.name == "install") {
        install(c);
      } else if (c.name == "include" || c.name == "add_subdirectory" || c.name == "function" ||
                 c.name == "macro" || c.name == "ament_auto_package" || c.name == "file") {
        brings_more(c);
      }
    }
  }

  // Commands that may install what is not written here.
  void brings_more(const Command& c) {
    if (c.name == "ament_auto_package") {
      const auto to_share = std::find(c.arguments.begin(), c.arguments.end(), "INSTALL_TO_SHARE");
      if (to_share == c.arguments.end()) return;
      for (auto folder = to_share + 1; folder != c.arguments.end(); ++folder) add(*folder, "", c.at);
    } else if (c.name != "file" || (!c.arguments.empty() && c.arguments[0] == "INSTALL")) {
      if (c.name != "include") out_.understood = false;
    }
  }

  // foreach(dir config launch) ... endforeach(): its body once for each.
  std::size_t loop(const std::vector<Command>& commands, std::size_t start) {
    std::size_t end = start + 1;
    for (int depth = 1; end < commands.size(); ++end) {
      if (commands[end].name == "foreach") ++depth;
      if (commands[end].name == "endforeach" && --depth == 0) break;
    }
    const std::vector<Command> body(
        commands.begin() + static_cast<std::ptrdiff_t>(start) + 1,
        commands.begin() + static_cast<std::ptrdiff_t>(std::min(end, commands.size())));
    auto list = commands[start].arguments;
    if (list.empty()) return end;
    const std::string variable = list.front();
    list.erase(list.begin());
    if (list.size() > 1 && list[0] == "IN") list.erase(list.begin(), list.begin() + 2);
    for (const std::string& value : list) {
      variables_[variable] = value;
      run(body);
    }
    return end;
  }

  // Nothing where a variable is not known.
  std::optional<std::string> expand(std::string text) const {
    for (std::size_t at = text.find("${"); at != std::string::npos; at = text.find("${")) {
      const std::size_t end = text.find('}', at);
      if (end == std::string::npos) return std::nullopt;
      const std::string name = text.substr(at + 2, end - at - 2);
      std::string value;
      if (name == "CATKIN_PACKAGE_SHARE_DESTINATION") {
        value = "share/" + out_.project;
      } else if (name == "CMAKE_CURRENT_SOURCE_DIR" || name == "PROJECT_SOURCE_DIR" ||
                 name == "CMAKE_SOURCE_DIR") {
        value = ".";
      } else if (const auto known = variables_.find(name); known != variables_.end()) {
        value = known->second;
      } else {
        return std::nullopt;
      }
      text.replace(at, end - at + 1, value);
    }
    if (text.starts_with("./")) text.erase(0, 2);
    return text;
  }

  void install(const Command& c) {
    if (c.arguments.empty()) return;
    const std::string& kind = c.arguments.front();
    if (kind == "CODE" || kind == "SCRIPT") out_.understood = false;
    if (kind != "DIRECTORY" && kind != "FILES" && kind != "PROGRAMS") return;
    const auto keyword = std::find(c.arguments.begin(), c.arguments.end(), "DESTINATION");
    if (keyword == c.arguments.end() || keyword + 1 == c.arguments.end()) return;
    const auto destination = expand(*(keyword + 1));
    if (!destination) {
      out_.understood = false;
      return;
    }
    const std::string share = "share/" + out_.project;
    const std::string to = without_trailing_slash(*destination);
    if (to != share && !to.starts_with(share + "/")) return;
    const bool filtered = std::any_of(keyword, c.arguments.end(), [](const std::string& word) {
      return word == "PATTERN" || word == "REGEX" || word == "FILES_MATCHING";
    });
    if (filtered && std::find(keyword, c.arguments.end(), "FILES_MATCHING") != c.arguments.end()) {
      out_.understood = false;
    }
    for (auto from = c.arguments.begin() + 1; from != keyword; ++from) {
      add(*from, to == share ? "" : to.substr(share.size() + 1), c.at);
    }
  }

  void add(const std::string& written, const std::string& below, std::size_t at) {
    const auto from = expand(written);
    if (!from) {
      out_.understood = false;
      return;
    }
    const bool contents = from->ends_with('/') || *from == ".";
    const std::string path = without_trailing_slash(*from);
    std::string to = below.empty() ? "." : below;
    if (!contents) to = joined(to, fs::path(path).filename().string());
    out_.paths.push_back({path, false, to, place_of(file_, text_, at)});
  }

  fs::path file_;
  std::string text_;
  InstallRules& out_;
  Variables variables_;
};

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

// A glob's "[abc]" as "?": near enough to say what is certainly left out.
std::string without_classes(std::string pattern) {
  for (std::size_t at = pattern.find('['); at != std::string::npos; at = pattern.find('[')) {
    const std::size_t end = pattern.find(']', at);
    if (end == std::string::npos) break;
    pattern.replace(at, end - at + 1, "?");
  }
  return pattern;
}

void read_entry(const fs::path& file, const std::string& text, std::size_t open, std::size_t close,
                InstallRules& out) {
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
                         place_of(file, text, at)});
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

void read_data_files(const fs::path& file, const std::string& text, InstallRules& out) {
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
      at = text.find('\n', at);
      continue;
    }
    if (text[at] == '*') out.understood = false;  // *generated(...)
    if (text[at] != '(') continue;
    const std::size_t end = closing(text, at);
    if (end == std::string::npos) {
      out.understood = false;
      return;
    }
    read_entry(file, text, at, end, out);
    at = end;
  }
  // [...] + more
  const std::size_t next = text.find_first_not_of(" \t\n", close + 1);
  if (next != std::string::npos && text[next] == '+') out.understood = false;
}

}  // namespace

PackageManifest read_manifest(const fs::path& file) {
  const XmlNode root = load_xml(file.string());
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

InstallRules read_cmake(const fs::path& file) {
  InstallRules out;
  out.source = make_location(file.string(), 1, 1);
  CMakeReader(file, out).read();
  return out;
}

InstallRules read_setup_py(const fs::path& file) {
  InstallRules out;
  out.source = make_location(file.string(), 1, 1);
  const std::string text = read_text(file);
  const std::size_t name = text.find("package_name");
  if (name != std::string::npos) {
    const auto texts = quoted(text, name, std::min(text.size(), text.find('\n', name)));
    if (!texts.empty()) {
      out.project = texts.front().first;
      out.project_source = place_of(file, text, name);
    }
  }
  read_data_files(file, text, out);
  return out;
}

}  // namespace doppel
