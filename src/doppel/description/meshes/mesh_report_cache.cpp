// Reports in the cache of meshes.
#include <cstring>
#include <map>
#include <memory>
#include <mutex>

#include "doppel/description/meshes/mesh_cache.h"
#include "doppel/description/meshes/mesh_report.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "doppel mesh report 2\n";

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

std::string content_of(const MeshReport& report) {
  Writer out;
  visit(
      report, [&](const auto& value) { out.number(value); }, [&](const auto& m) { out.matrix(m); });
  out.text(report.remark);
  out.number<std::uint64_t>(report.hull.size());
  for (const Eigen::Vector3f& p : report.hull) out.matrix(p);
  return std::move(out.bytes_);
}

std::optional<MeshReport> report_of(std::string_view content) {
  Reader in(content);
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

MeshReport through_cache(const fs::path& file, const std::string& key) {
  if (const auto stored = cached_result(key, kMagic)) {
    if (auto report = report_of(*stored)) return std::move(*report);
  }
  MeshReport report = report_mesh(file);
  if (report.problem.empty()) cache_result(key, kMagic, content_of(report));
  return report;
}

}  // namespace

std::string to_bytes(const MeshReport& report, const std::string& key) {
  return sealed_result(kMagic, key, content_of(report));
}

std::optional<MeshReport> from_bytes(std::string_view bytes, const std::string& key) {
  const auto content = opened_result(bytes, kMagic, key);
  return content ? report_of(*content) : std::nullopt;
}

const MeshReport& cached_mesh_report(const fs::path& file) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<const MeshReport>> known;
  std::error_code failed;
  const fs::path whole = fs::absolute(file, failed).lexically_normal();
  const std::string key = mesh_fingerprint(whole);
  const std::lock_guard lock(mutex);
  std::unique_ptr<const MeshReport>& entry = known[key.empty() ? whole.string() : key];
  if (!entry)
    entry = std::make_unique<MeshReport>(key.empty() ? report_mesh(whole) : through_cache(whole, key));
  return *entry;
}

}  // namespace doppel
