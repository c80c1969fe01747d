#include "doppel/description/meshes/heightmap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/plugin_module.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/text.h"
#include "doppel/base/images/grey_image.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxImageBytes = std::size_t{256} << 20;

GreyImage read_image(const std::string& path) {
  using Read = bool (*)(std::string_view bytes, int most, GreyImage& out, std::string& problem);
  static const auto read =
      reinterpret_cast<Read>(plugin_symbol("doppel_image_codecs", "doppel_read_grey_image"));
  GreyImage out;
  const FileContent content = read_content(path, kMaxImageBytes);
  std::string problem = content.problem;
  if (content.was_read() && read(content.bytes, kMaxHeightmapSide, out, problem)) return out;
  throw InputError(
      "heightmap.unreadable", make_location(path, 0),
      fmt::format("the heightmap cannot be read: {}", problem),
      "heightmaps are PNG or JPEG images in grey; a digital elevation model can be converted: gdal_translate "
      "-of PNG -ot UInt16 -scale IN OUT.png");
}

}  // namespace

double HeightField::height(double x, double y) const {
  const double column = std::clamp((x / size.x() + 0.5) * (columns - 1), 0.0, columns - 1.0);
  const double row = std::clamp((y / size.y() + 0.5) * (rows - 1), 0.0, rows - 1.0);
  const int c = std::min(static_cast<int>(column), columns - 2),
            r = std::min(static_cast<int>(row), rows - 2);
  const double u = column - c, v = row - r;
  const double low = at(c, r), high = at(c + 1, r + 1);
  if (u >= v) return low + u * (at(c + 1, r) - low) + v * (high - at(c + 1, r));
  return low + v * (at(c, r + 1) - low) + u * (high - at(c, r + 1));
}

HeightField load_heightmap(const Heightmap& map) {
  if (!(map.size.head<2>().minCoeff() > 0) || !map.size.allFinite()) {
    throw InputError(
        "heightmap.size", make_location(map.image.path, 0),
        fmt::format("the size of the heightmap '{}' must be positive along x and y", map.image.uri),
        "write <size> in m");
  }
  const GreyImage image = read_image(map.image.path);
  HeightField out;
  out.columns = image.width;
  out.rows = image.height;
  out.size = map.size.head<2>();
  out.heights.reserve(image.values.size());
  // The brightest pixel of the image has the given height, not the brightest value of the format.
  const double scale = image.brightest_of_all > 0 ? std::abs(map.size.z()) / image.brightest_of_all : 0.0;
  for (int row = image.height - 1; row >= 0; --row) {
    for (int column = 0; column < image.width; ++column) {
      const double h =
          scale * image.values[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                               static_cast<std::size_t>(column)];
      out.heights.push_back(static_cast<float>(map.size.z() < 0 ? -map.size.z() - h : h));
    }
  }
  return out;
}

}  // namespace doppel
