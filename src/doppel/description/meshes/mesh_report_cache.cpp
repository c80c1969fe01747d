// Reports on disk: one small file per mesh, named by a hash of its path, written completely or not at all,
// and used only with the expected version, key and checksum.
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>

#include "doppel/description/meshes/mesh_report.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "doppel mesh report 2\n";
constexpr std::streamoff kMaxFileBytes = 1 << 20;

// FNV-1a, 64 bits.
std::uint64_t hash(std::string_view bytes) {
  std::uint64_t h = 0xcbf29ce484222325ull;
  for (const char c : bytes) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return h;
}

class Writer {
 public:
  template <class Number>
  void number(Number value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void text(std::string_view value) {
    number<std::uint64_t>(value.size());
    bytes_ += value;
  }
  template <class Matrix>
  void matrix(const Matrix& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) number(m.data()[i]);
  }
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  template <class Number>
  Number number() {
    Number value{};
    if (rest_.size() < sizeof value) {
      good_ = false;
      return value;
    }
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_.remove_prefix(sizeof value);
    return value;
  }
  std::string text() {
    const auto size = number<std::uint64_t>();
    if (size > rest_.size()) {
      good_ = false;
      return "";
    }
    std::string out(rest_.substr(0, size));
    rest_.remove_prefix(size);
    return out;
  }
  template <class Matrix>
  void matrix(Matrix& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] = number<typename Matrix::Scalar>();
  }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] bool done() const { return good_ && rest_.empty(); }

 private:
  std::string_view rest_;
  bool good_ = true;
};

// One list of fields for both directions.
template <class Report, class Field, class Matrix>
void visit(Report& r, const Field& field, const Matrix& matrix) {
  for (auto* count : {&r.vertices, &r.triangles, &r.degenerate, &r.open_edges, &r.crossed_edges})
    field(*count);
  for (auto* real : {&r.area, &r.hull_volume, &r.solid.volume, &r.solid.unit.mass}) field(*real);
  for (auto* vector : {&r.lower, &r.upper, &r.solid.unit.com}) matrix(*vector);
  matrix(r.solid.unit.I);
}

fs::path cache_folder() {
  if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder != nullptr && *folder == '/') {
    return fs::path(folder) / "doppel";
  }
  const char* home = std::getenv("HOME");
  return home == nullptr || *home != '/' ? fs::path() : fs::path(home) / ".cache" / "doppel";
}

std::string key_of(const fs::path& file, std::uintmax_t size, fs::file_time_type changed) {
  return fmt::format("{}\n{}\n{}", file.string(), size, changed.time_since_epoch().count());
}

std::optional<MeshReport> read_cache(const fs::path& entry, const std::string& key) {
  std::ifstream in(entry, std::ios::binary | std::ios::ate);
  if (!in) return std::nullopt;
  const auto size = static_cast<std::streamoff>(in.tellg());
  if (size <= 0 || size > kMaxFileBytes) return std::nullopt;
  std::string bytes(static_cast<std::size_t>(size), '\0');
  in.seekg(0);
  in.read(bytes.data(), size);
  return in ? from_bytes(bytes, key) : std::nullopt;
}

void write_cache(const fs::path& entry, const std::string& bytes) {
  static std::atomic<unsigned> counter{0};
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

MeshReport through_cache(const fs::path& file, const std::string& key) {
  const fs::path folder = cache_folder();
  if (folder.empty()) return report_mesh(file);
  const fs::path entry = folder / "meshes" / fmt::format("{:016x}", hash(file.string()));
  if (auto known = read_cache(entry, key)) return std::move(*known);
  MeshReport report = report_mesh(file);
  if (report.problem.empty()) write_cache(entry, to_bytes(report, key));
  return report;
}

}  // namespace

std::string to_bytes(const MeshReport& report, const std::string& key) {
  Writer out;
  out.bytes_ = kMagic;
  out.text(key);
  visit(
      report, [&](const auto& value) { out.number(value); }, [&](const auto& m) { out.matrix(m); });
  out.text(report.remark);
  out.number<std::uint64_t>(report.hull.size());
  for (const Eigen::Vector3f& p : report.hull) out.matrix(p);
  out.number(hash(out.bytes_));
  return std::move(out.bytes_);
}

std::optional<MeshReport> from_bytes(std::string_view bytes, const std::string& key) {
  if (!bytes.starts_with(kMagic) || bytes.size() < kMagic.size() + sizeof(std::uint64_t)) return std::nullopt;
  const std::string_view content = bytes.substr(0, bytes.size() - sizeof(std::uint64_t));
  if (Reader(bytes.substr(content.size())).number<std::uint64_t>() != hash(content)) return std::nullopt;
  Reader in(content.substr(kMagic.size()));
  if (in.text() != key) return std::nullopt;
  MeshReport out;
  visit(
      out, [&](auto& value) { value = in.number<std::decay_t<decltype(value)>>(); },
      [&](auto& m) { in.matrix(m); });
  out.remark = in.text();
  const auto corners = in.number<std::uint64_t>();
  if (!in.good() || corners > kHullVertices) return std::nullopt;
  out.hull.resize(corners);
  for (Eigen::Vector3f& p : out.hull) in.matrix(p);
  return in.done() ? std::optional(std::move(out)) : std::nullopt;
}

const MeshReport& cached_mesh_report(const fs::path& file) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<const MeshReport>> known;
  std::error_code failed;
  const fs::path whole = fs::absolute(file, failed).lexically_normal();
  const std::uintmax_t size = fs::file_size(whole, failed);
  const auto changed = failed ? fs::file_time_type{} : fs::last_write_time(whole, failed);
  const std::string key = key_of(whole, failed ? 0 : size, changed);
  const std::lock_guard lock(mutex);
  std::unique_ptr<const MeshReport>& entry = known[key];
  if (!entry) entry = std::make_unique<MeshReport>(failed ? report_mesh(whole) : through_cache(whole, key));
  return *entry;
}

}  // namespace doppel
