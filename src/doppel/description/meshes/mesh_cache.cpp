#include "doppel/description/meshes/mesh_cache.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "doppel/base/core/read_file.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

// FNV-1a, 64 bits.
std::uint64_t hash(std::string_view bytes) {
  std::uint64_t h = 0xcbf29ce484222325ull;
  for (const char c : bytes) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return h;
}

std::string bytes_of(std::uint64_t number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

fs::path cache_folder() {
  if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder != nullptr && *folder == '/') {
    return fs::path(folder) / "doppel";
  }
  const char* home = std::getenv("HOME");
  return home == nullptr || *home != '/' ? fs::path() : fs::path(home) / ".cache" / "doppel";
}

// Empty: there is no folder. A mesh that changes replaces its entry, whose name follows from its path alone.
fs::path entry_of(const std::string& fingerprint, std::string_view kind) {
  const fs::path folder = cache_folder();
  if (folder.empty() || fingerprint.empty()) return {};
  const std::string path = fingerprint.substr(0, fingerprint.find('\n'));
  return folder / "meshes" / fmt::format("{:016x}", hash(std::string(kind) + path));
}

}  // namespace

std::string mesh_fingerprint(const fs::path& path) {
  std::error_code failed;
  const fs::path whole = fs::absolute(path, failed).lexically_normal();
  const std::uintmax_t size = fs::file_size(whole, failed);
  if (failed) return "";
  const auto changed = fs::last_write_time(whole, failed);
  if (failed) return "";
  return fmt::format("{}\n{}\n{}", whole.string(), size, changed.time_since_epoch().count());
}

std::string sealed_result(std::string_view kind, std::string_view key, std::string_view content) {
  std::string out(kind);
  out += bytes_of(key.size());
  out += key;
  out += content;
  out += bytes_of(hash(out));
  return out;
}

std::optional<std::string> opened_result(std::string_view bytes, std::string_view kind,
                                         std::string_view key) {
  const std::string head = std::string(kind) + bytes_of(key.size()) + std::string(key);
  constexpr std::size_t kTail = sizeof(std::uint64_t);
  if (!bytes.starts_with(head) || bytes.size() < head.size() + kTail) return std::nullopt;
  const std::string_view checked = bytes.substr(0, bytes.size() - kTail);
  if (bytes.substr(checked.size()) != bytes_of(hash(checked))) return std::nullopt;
  return std::string(checked.substr(head.size()));
}

std::optional<std::string> cached_result(const std::string& fingerprint, std::string_view kind) {
  const fs::path entry = entry_of(fingerprint, kind);
  if (entry.empty()) return std::nullopt;
  return opened_result(read_content(entry, kMaxCachedBytes).bytes, kind, fingerprint);
}

void cache_result(const std::string& fingerprint, std::string_view kind, std::string_view content) {
  static std::atomic<unsigned> counter{0};
  const fs::path entry = entry_of(fingerprint, kind);
  const std::string bytes = sealed_result(kind, fingerprint, content);
  if (entry.empty() || bytes.size() > kMaxCachedBytes) return;
  std::error_code failed;
  fs::create_directories(entry.parent_path(), failed);
  if (failed) return;
  const fs::path fresh = fmt::format("{}.{}.{}", entry.string(), ::getpid(), counter++);
  {
    std::ofstream out(fresh, std::ios::binary | std::ios::trunc);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (out) fs::rename(fresh, entry, failed);
    if (out && !failed) return;
  }
  fs::remove(fresh, failed);
}

}  // namespace doppel
