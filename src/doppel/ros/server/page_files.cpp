#include "doppel/ros/server/detail/page_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <optional>

#include "doppel/base/core/fnv_hash.h"
#include "doppel/base/core/read_file.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{16} << 20;  // of one file
constexpr std::size_t kMaxFiles = 1000;

constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".jpg", "image/jpeg"},
    {".webp", "image/webp"},
    {".woff2", "font/woff2"},
    {".wasm", "application/wasm"},
}};

// Empty: a kind of file that is not served.
std::string_view type_of(const fs::path& file) {
  for (const auto& [extension, type] : kTypes) {
    if (file.extension() == extension) return type;
  }
  return "";
}

std::optional<std::string> bytes_of(const fs::path& file) {
  std::error_code failed;
  if (!fs::is_regular_file(fs::symlink_status(file, failed)) || failed) return std::nullopt;
  FileContent content = read_content(file, kMaxBytes);
  return content.was_read() ? std::optional(std::move(content.bytes)) : std::nullopt;
}

// "main-EPFJUWFJ.css", the build's names of immutable files.
bool has_hash(std::string_view stem) {
  constexpr std::size_t kHash = 8;
  if (stem.size() <= kHash + 1 || stem[stem.size() - kHash - 1] != '-') return false;
  return std::ranges::all_of(stem.substr(stem.size() - kHash),
                             [](unsigned char c) { return std::isupper(c) != 0 || std::isdigit(c) != 0; });
}

std::optional<PageFile> read_page_file(const fs::path& file) {
  const std::string_view type = type_of(file);
  if (type.empty()) return std::nullopt;
  auto bytes = bytes_of(file);
  if (!bytes) return std::nullopt;
  PageFile out;
  out.content_type = type;
  out.tag = content_tag(*bytes);
  out.bytes = std::move(*bytes);
  out.gzip = bytes_of(file.string() + ".gz").value_or("");
  return out;
}

}  // namespace

std::string content_tag(std::string_view bytes) {
  return fmt::format("{:016x}", fnv_hash(bytes));
}

const PageFile* PageFiles::find(std::string_view path) {
  if (files_.empty()) read();
  const auto found = files_.find(path);
  return found == files_.end() ? nullptr : &found->second;
}

void PageFiles::read() {
  if (folder_.empty()) return;
  auto index = read_page_file(folder_ / "index.html");
  if (!index) return;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder_ / "assets", none)) {
    auto file = read_page_file(entry.path());
    if (!file || files_.size() >= kMaxFiles) continue;
    file->immutable = has_hash(entry.path().stem().string());
    files_.emplace("/assets/" + entry.path().filename().string(), std::move(*file));
  }
  files_.emplace("/", std::move(*index));
}

}  // namespace doppel
