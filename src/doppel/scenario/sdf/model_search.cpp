#include "doppel/scenario/sdf/detail/model_search.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/text.h"
#include "doppel/base/xml/xml.h"

namespace doppel {

namespace fs = std::filesystem;

namespace {

constexpr std::array kSearchVariables{"GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH",
                                      "GAZEBO_MODEL_PATH", "GAZEBO_RESOURCE_PATH"};
constexpr int kMaxParents = 8;

bool present(const fs::path& path) {
  std::error_code none;
  return fs::exists(path, none);
}

bool is_folder(const fs::path& path) {
  std::error_code none;
  return fs::is_directory(path, none);
}

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code none;
  for (fs::directory_iterator it(folder, none), end; !none && it != end; it.increment(none))
    out.push_back(it->path());
  std::sort(out.begin(), out.end());
  return out;
}

void add_root(std::vector<fs::path>& roots, const fs::path& folder) {
  const fs::path plain = folder.lexically_normal();
  if (is_folder(plain) && std::find(roots.begin(), roots.end(), plain) == roots.end()) roots.push_back(plain);
}

// "%20" as a space.
std::string decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = 0;
    const char* const hex = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() && std::from_chars(hex, hex + 2, value, 16).ptr == hex + 2) {
      out += static_cast<char>(value);
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

// {"1", "9"} of "1.9"; compared as numbers.
std::pair<int, int> version_of(std::string_view text) {
  std::pair<int, int> out{0, 0};
  const auto [dot, first] = std::from_chars(text.data(), text.data() + text.size(), out.first);
  if (first == std::errc{} && dot != text.data() + text.size() && *dot == '.')
    std::from_chars(dot + 1, text.data() + text.size(), out.second);
  return out;
}

// The folder of the highest version below a model of the cache, or the folder itself.
fs::path newest_version(const fs::path& folder) {
  fs::path best;
  int newest = -1;
  for (const fs::path& entry : entries_of(folder)) {
    int version = 0;
    const std::string name = entry.filename().string();
    const auto [end, failed] = std::from_chars(name.data(), name.data() + name.size(), version);
    if (failed != std::errc{} || end != name.data() + name.size() || version <= newest) continue;
    newest = version;
    best = entry;
  }
  return best.empty() ? folder : best;
}

// The entry of a folder with this name, in any case: the cache has names in lower case.
fs::path entry_named(const fs::path& folder, const std::string& name) {
  if (present(folder / name)) return folder / name;
  const std::string low = lowered(name);
  for (const fs::path& entry : entries_of(folder)) {
    if (lowered(entry.filename().string()) == low) return entry;
  }
  return {};
}

std::vector<std::string> split(std::string_view text, char at) {
  std::vector<std::string> out;
  while (true) {
    const std::size_t end = text.find(at);
    if (const auto part = text.substr(0, end); !part.empty()) out.emplace_back(part);
    if (end == std::string_view::npos) return out;
    text.remove_prefix(end + 1);
  }
}

// A name that leads out of the folder that it is searched in is not a model's.
bool leaves(const std::string& name) {
  const fs::path plain = fs::path(name).lexically_normal();
  return plain.is_absolute() || (!plain.empty() && *plain.begin() == "..");
}

std::string after_scheme(const std::string& uri) {
  const std::size_t scheme = uri.find("://");
  return scheme == std::string::npos ? uri : uri.substr(scheme + 3);
}

}  // namespace

ModelSearch::ModelSearch(const fs::path& world, PackageResolver& resolver) : resolver_(resolver) {
  if (!world.empty()) {
    fs::path folder = fs::absolute(world).lexically_normal();
    if (!is_folder(folder)) folder = folder.parent_path();
    add_root(roots_, folder);
    for (int i = 0; i < kMaxParents && folder.has_relative_path(); ++i) {
      add_root(roots_, folder / "models");
      const bool top = present(folder / ".git"), package = present(folder / "package.xml");
      folder = folder.parent_path();
      if (i == 0 || package || top) add_root(roots_, folder);
      if (top || package) {
        add_root(roots_, folder / "models");
        break;
      }
    }
  }
  for (const char* variable : kSearchVariables) {
    const char* const value = std::getenv(variable);
    for (const std::string& folder : split(value == nullptr ? "" : value, ':')) add_root(roots_, folder);
  }
  const char* const home = std::getenv("HOME");
  if (home == nullptr) return;
  add_root(roots_, fs::path(home) / ".gazebo" / "models");
  for (const char* cache : {".gz", ".ignition"}) {
    for (const fs::path& server : entries_of(fs::path(home) / cache / "fuel")) add_root(fuel_, server);
  }
}

const FoundFile& ModelSearch::find(const std::string& uri, const fs::path& folder) {
  std::string key = uri + '\n' + folder.string();
  const auto known = known_.find(key);
  if (known != known_.end()) return known->second;
  return known_.emplace(std::move(key), search(uri, folder)).first->second;
}

FoundFile ModelSearch::search(const std::string& uri, const fs::path& folder) const {
  FoundFile out;
  const std::string rest = after_scheme(uri);
  if (uri.starts_with("http://") || uri.starts_with("https://") || uri.starts_with("fuel://"))
    return search_fuel(uri);
  const bool is_file = uri.starts_with("file://");
  if (is_file && rest.starts_with("media/")) return search_name(rest);
  if (uri.find("://") == std::string::npos || is_file) {
    const fs::path path = fs::path(rest).is_absolute() ? fs::path(rest) : folder / rest;
    out.tried.push_back(path.lexically_normal().string());
    if (present(path)) {
      out.path = path.lexically_normal();
      return out;
    }
    if (fs::path(rest).is_absolute()) return out;
  }
  FoundFile named = search_name(rest);
  named.tried.insert(named.tried.begin(), out.tried.begin(), out.tried.end());
  if (!named.path.empty()) return named;
  const std::string as_package = "package://" + rest;
  const PackageResolver::Resolved package = resolver_.resolve(as_package, folder);
  named.path = package.path;
  return named;
}

FoundFile ModelSearch::search_name(const std::string& name) const {
  FoundFile out;
  if (name.empty() || leaves(name)) return out;
  for (const fs::path& root : roots_) {
    out.tried.push_back((root / name).string());
    if (!present(root / name)) continue;
    out.path = (root / name).lexically_normal();
    return out;
  }
  const std::vector<std::string> parts = split(name, '/');
  for (const fs::path& server : fuel_) {
    for (const fs::path& owner : entries_of(server)) {
      const fs::path model = entry_named(owner / "models", parts.front());
      if (model.empty()) continue;
      fs::path found = newest_version(model);
      for (std::size_t i = 1; i < parts.size(); ++i) found /= parts[i];
      out.tried.push_back(found.string());
      if (!present(found)) continue;
      out.path = found;
      return out;
    }
    if (out.path.empty()) out.tried.push_back(server.string());
  }
  return out;
}

// https://SERVER/1.0/OWNER/models/NAME[/VERSION[/files/PATH]], in the cache SERVER/OWNER/models/NAME/VERSION/PATH.
FoundFile ModelSearch::search_fuel(const std::string& url) const {
  FoundFile out;
  std::vector<std::string> parts = split(after_scheme(url), '/');
  for (std::string& part : parts) part = decoded(part);
  if (parts.size() > 1 && parts[1].find('.') != std::string::npos) parts.erase(parts.begin() + 1);
  if (parts.size() < 4 || std::find(parts.begin(), parts.end(), "..") != parts.end()) return out;
  for (const fs::path& server : fuel_) {
    fs::path at = server.parent_path();
    for (std::size_t i = 0; i < 4 && !at.empty(); ++i) at = entry_named(at, parts[i]);
    // The cache of the one server's name is that of the other's.
    if (at.empty()) {
      at = server;
      for (std::size_t i = 1; i < 4 && !at.empty(); ++i) at = entry_named(at, parts[i]);
    }
    out.tried.push_back((server / parts[1] / parts[2] / parts[3]).string());
    if (at.empty()) continue;
    std::size_t next = 4;
    if (next < parts.size() && present(at / parts[next])) {
      at /= parts[next++];
    } else {
      if (next < parts.size() && parts[next] != "files")
        ++next;  // a version that is not in the cache, or "tip"
      at = newest_version(at);
    }
    if (next < parts.size() && parts[next] == "files") ++next;
    for (; next < parts.size(); ++next) at /= parts[next];
    if (!present(at)) continue;
    out.path = at;
    return out;
  }
  if (out.tried.empty()) {
    for (const char* cache : {"~/.gz/fuel", "~/.ignition/fuel"}) out.tried.emplace_back(cache);
  }
  return out;
}

fs::path model_file(const fs::path& folder) {
  for (const char* manifest : {"model.config", "manifest.xml"}) {
    if (!present(folder / manifest)) continue;
    try {
      const XmlNode root = load_xml((folder / manifest).string());
      fs::path best;
      std::pair<int, int> newest{-1, 0};
      for (const XmlNode& child : root.children) {
        if (!child.is("sdf")) continue;
        const XmlAttribute* const written = child.find("version");
        const std::pair<int, int> version = written == nullptr ? std::pair(0, 0) : version_of(written->value);
        const fs::path file = folder / child.content();
        if (version <= newest || !present(file)) continue;
        newest = version;
        best = file;
      }
      if (!best.empty()) return best;
    } catch (const InputError&) {
      break;  // without it, the file is found by its name
    }
  }
  if (present(folder / "model.sdf")) return folder / "model.sdf";
  std::vector<fs::path> candidates;
  for (const fs::path& entry : entries_of(folder)) {
    const std::string extension = lowered(entry.extension().string());
    if (extension == ".sdf" || extension == ".model") candidates.push_back(entry);
  }
  return candidates.size() == 1 ? candidates.front() : fs::path();
}

}  // namespace doppel
