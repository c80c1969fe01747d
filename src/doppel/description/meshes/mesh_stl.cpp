// STL, binary and ASCII. Source: 3D Systems, StereoLithography Interface Specification, 1989.
#include <fmt/format.h>

#include <cstring>

#include "doppel/description/meshes/detail/mesh.h"
#include "doppel/description/meshes/detail/text_scanner.h"

namespace doppel::mesh {
namespace {

constexpr std::size_t kHeader = 84, kRecord = 50;

std::uint32_t little_endian(const char* p) {
  std::array<unsigned char, 4> b{};
  std::memcpy(b.data(), p, b.size());
  return b[0] | b[1] << 8 | b[2] << 16 | static_cast<std::uint32_t>(b[3]) << 24;
}

void add_corner(TriangleSoup& soup, const Eigen::Vector3f& p, const std::string& name, int line) {
  if (!p.allFinite()) {
    refuse(name, line,
           fmt::format("a vertex of triangle {} is not a finite number", soup.points.size() / 3 + 1));
  }
  soup.points.push_back(p);
  if (soup.points.size() % 3 == 0) {
    const auto n = static_cast<std::uint32_t>(soup.points.size());
    soup.triangles.push_back({n - 3, n - 2, n - 1});
  }
}

TriangleSoup read_binary(std::string_view bytes, const std::string& name, std::size_t count) {
  TriangleSoup soup;
  soup.points.reserve(3 * count);
  soup.triangles.reserve(count);
  for (std::size_t t = 0; t < count; ++t) {
    const char* corner = bytes.data() + kHeader + t * kRecord + 12;  // after the normal, which corners imply
    for (int i = 0; i < 3; ++i, corner += 12) {
      std::array<float, 3> p{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t bits = little_endian(corner + 4 * k);
        std::memcpy(&p[k], &bits, sizeof bits);
      }
      add_corner(soup, {p[0], p[1], p[2]}, name, 0);
    }
  }
  return soup;
}

TriangleSoup read_ascii(std::string_view bytes, const std::string& name) {
  TriangleSoup soup;
  TextScanner text(bytes);
  std::size_t corners_of_loop = 0;
  for (std::string_view word = text.word(); !word.empty(); word = text.word()) {
    if (word == "vertex") {
      Eigen::Vector3f p;
      for (int k = 0; k < 3; ++k) {
        const auto value = text.number();
        if (!value) refuse(name, text.line(), "'vertex' must be followed by three numbers");
        p[k] = static_cast<float>(*value);
      }
      ++corners_of_loop;
      add_corner(soup, p, name, text.line());
    } else if (word == "endloop") {
      if (corners_of_loop != 3) {
        refuse(name, text.line(),
               fmt::format("a facet has {} vertices; STL supports triangles only", corners_of_loop));
      }
      corners_of_loop = 0;
    } else if (word == "solid" || word == "endsolid") {
      text.skip_line();  // a name, which may contain any words
    }
  }
  if (corners_of_loop != 0) refuse(name, text.line(), "the file ends in the middle of a facet");
  return soup;
}

// An ASCII file has its first facet near its beginning; a binary header that begins with "solid" does not.
bool is_ascii(std::string_view bytes) {
  const std::string_view start = bytes.substr(0, 1024);
  return start.starts_with("solid") &&
         (start.find("facet") != std::string_view::npos || start.find("endsolid") != std::string_view::npos);
}

}  // namespace

TriangleSoup read_stl(std::string_view bytes, const std::string& name) {
  const std::size_t declared = bytes.size() >= kHeader ? little_endian(bytes.data() + 80) : 0;
  const bool fits = bytes.size() >= kHeader && declared <= (bytes.size() - kHeader) / kRecord;
  const bool exact = fits && bytes.size() == kHeader + declared * kRecord;
  // Many binary files begin with "solid", too; they are recognised by their size.
  if (!exact && (is_ascii(bytes) || (!fits && bytes.starts_with("solid")))) return read_ascii(bytes, name);
  if (fits) return read_binary(bytes, name, declared);
  if (bytes.size() < kHeader)
    refuse(name, 0, fmt::format("{} bytes are too short for an STL file", bytes.size()));
  refuse(name, 0,
         fmt::format("the header declares {} triangles, which need {} bytes, but the file has {}", declared,
                     kHeader + declared * kRecord, bytes.size()));
}

}  // namespace doppel::mesh
