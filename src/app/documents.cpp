#include "app/documents.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "doppel/base/core/installation.h"
#include "doppel/base/core/read_file.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;
using Pages = std::map<std::string, fs::path>;  // by name

Pages find_pages() {
  Pages out;
  std::error_code none;
  const fs::path root = data_folder() / "docs";
  for (fs::recursive_directory_iterator it(root, none), end; !none && it != end; it.increment(none)) {
    if (it->path().extension() == ".md")
      out.emplace(it->path().lexically_relative(root).string(), it->path());
  }
  return out;
}

std::string read_page(const fs::path& page) {
  constexpr std::size_t kMaxPageBytes = 4 << 20;
  return read_file(page.string(), kMaxPageBytes);
}

fs::path find_page(const Pages& pages, std::string name) {
  if (name.starts_with("docs/")) name.erase(0, 5);
  for (const std::string& candidate :
       {name, name + ".md", "tutorials/" + name, "tutorials/" + name + ".md"}) {
    if (const auto page = pages.find(candidate); page != pages.end()) return page->second;
  }
  return {};
}

// The section of troubleshooting.md whose heading names the rule in code. Empty: there is none.
std::string help_on_rule(const Pages& pages, const std::string& rule) {
  const auto page = pages.find("troubleshooting.md");
  if (page == pages.end() || rule.find('.') == std::string::npos) return "";
  const std::string text = read_page(page->second);
  const std::size_t name = text.find("`" + rule + "`");
  if (name == std::string::npos) return "";
  const std::size_t begin = text.rfind('\n', name) + 1;
  if (!text.substr(begin, name - begin).starts_with("### ")) return "";
  std::string section = text.substr(begin + 4);  // without "### "
  section.resize(std::min({section.find("\n## "), section.find("\n### "), section.size()}));
  return section.substr(0, section.find_last_not_of('\n') + 1) + "\n";
}

}  // namespace

std::vector<std::string> document_names() {
  std::vector<std::string> names;
  for (const auto& [name, file] : find_pages()) names.push_back(name);
  return names;
}

std::string document_text(const std::string& name) {
  const Pages pages = find_pages();
  const fs::path page = find_page(pages, name);
  return page.empty() ? help_on_rule(pages, name) : read_page(page);
}

std::string help_line(const InputError& error) {
  try {
    const Pages pages = find_pages();
    for (const Diagnostic& one : error.diagnostics()) {
      if (!help_on_rule(pages, one.rule).empty()) return fmt::format("  help: doppel man {}\n", one.rule);
    }
  } catch (const InputError&) {
    return "";  // the page is unreadable: the error itself is printed without it
  }
  return "";
}

}  // namespace doppel::app
