// The files that a CMakeLists.txt installs, as far as it can be read without running CMake.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <span>

#include "doppel/base/core/text.h"
#include "doppel/review/audit/detail/package_files.h"
#include "doppel/review/audit/detail/path_text.h"
#include "doppel/scenario/resolve/side_files.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using package_files::joined, package_files::without_trailing_slash;

constexpr std::size_t kMaxCommands = 20'000;  // executed; nested loops multiply
constexpr int kMaxLoopDepth = 16;
constexpr int kMaxReplacements = 64;           // in one text
constexpr std::size_t kMaxValueLength = 4096;  // of a variable, which may double at every set()

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
  CMakeReader(const SideFile& file, InstallRules& out) : file_(file), out_(out) {}

  void read() { run(commands_of(without_comments(file_.text)), 0); }

 private:
  using Variables = std::map<std::string, std::string>;

  void run(std::span<const Command> commands, int depth) {
    for (std::size_t i = 0; i < commands.size() && !given_up_; ++i) {
      const Command& c = commands[i];
      if (++steps_ > kMaxCommands) return give_up(c, "its loops run more commands than the audit evaluates");
      if (c.name == "project" && !c.arguments.empty()) {
        out_.project = c.arguments.front();
        out_.project_source = file_.place(c.at);
        variables_["PROJECT_NAME"] = out_.project;
      } else if (c.name == "set" && c.arguments.size() == 2) {
        set(c.arguments[0], expand(c.arguments[1]));
      } else if (c.name == "foreach") {
        i = loop(commands, i, depth);
      } else if (c.name == "install") {
        install(c);
      } else if (c.name == "include" || c.name == "add_subdirectory" || c.name == "function" ||
                 c.name == "macro" || c.name == "ament_auto_package" || c.name == "file") {
        may_install_more(c);
      }
    }
  }

  // Commands that may install files that are not named here.
  void may_install_more(const Command& c) {
    if (c.name == "ament_auto_package") {
      const auto to_share = std::find(c.arguments.begin(), c.arguments.end(), "INSTALL_TO_SHARE");
      if (to_share == c.arguments.end()) return;
      for (auto folder = to_share + 1; folder != c.arguments.end(); ++folder) add(*folder, "", c.at);
    } else if (c.name != "file" || (!c.arguments.empty() && c.arguments[0] == "INSTALL")) {
      if (c.name != "include") out_.understood = false;
    }
  }

  void give_up(const Command& c, std::string why) {
    given_up_ = true;
    out_.understood = false;
    out_.given_up = std::move(why);
    out_.given_up_source = file_.place(c.at);
  }

  // An unknown value is not stored, so that everything that uses it is unknown as well.
  void set(const std::string& variable, std::optional<std::string> value) {
    if (value)
      variables_[variable] = std::move(*value);
    else
      variables_.erase(variable);
  }

  // foreach(dir config launch) ... endforeach(): its body once for each.
  std::size_t loop(std::span<const Command> commands, std::size_t start, int depth) {
    std::size_t end = start + 1;
    for (int open = 1; end < commands.size(); ++end) {
      if (commands[end].name == "foreach") ++open;
      if (commands[end].name == "endforeach" && --open == 0) break;
    }
    const auto body = commands.subspan(start + 1, std::min(end, commands.size()) - start - 1);
    auto list = commands[start].arguments;
    if (list.empty()) return end;
    if (depth == kMaxLoopDepth) {
      give_up(commands[start], "its loops are nested deeper than the audit evaluates");
      return end;
    }
    const std::string variable = list.front();
    list.erase(list.begin());
    if (list.size() > 1 && list[0] == "IN") list.erase(list.begin(), list.begin() + 2);
    for (const std::string& value : list) {
      if (given_up_) break;
      set(variable, expand(value));
      run(body, depth + 1);
    }
    return end;
  }

  // Nothing where a variable is unknown, or the text exceeds its limits.
  [[nodiscard]] std::optional<std::string> expand(std::string text) const {
    int replaced = 0;
    for (std::size_t at = text.find("${"); at != std::string::npos; at = text.find("${")) {
      const std::size_t end = text.find('}', at);
      if (end == std::string::npos || ++replaced > kMaxReplacements) return std::nullopt;
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
      if (text.size() > kMaxValueLength) return std::nullopt;
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
    out_.paths.push_back({path, false, to, file_.place(at)});
  }

  const SideFile& file_;
  InstallRules& out_;
  Variables variables_;
  std::size_t steps_ = 0;
  bool given_up_ = false;
};

}  // namespace

InstallRules read_cmake(const fs::path& file) {
  const SideFile text = read_side_file(file);
  InstallRules out;
  out.source = make_location(file.string(), 1, 1);
  CMakeReader(text, out).read();
  return out;
}

}  // namespace doppel
