#include "app/verbs/saved_message.h"

#include <cmath>
#include <cstring>

#include "app/verbs/shell.h"
#include "doppel/images/image.h"
#include "doppel/messages/sensor_msgs.h"

namespace doppel::app {
namespace {

namespace saved = sensor_msgs::msg;
constexpr int kJpegQuality = 92;

Bitmap grey_of_depths(const std::vector<float>& depths, int width, int height, std::string& note) {
  float least = HUGE_VALF, most = -HUGE_VALF;
  for (const float depth : depths) {
    if (!std::isfinite(depth)) continue;
    least = std::min(least, depth);
    most = std::max(most, depth);
  }
  note = least <= most
             ? fmt::format("depths from {:.3f} m (light) to {:.3f} m (dark); black: none", least, most)
             : "no depth in the picture";
  Bitmap out{width, height, 1, {}};
  for (const float depth : depths)
    out.pixels.push_back(
        !std::isfinite(depth)
            ? 0
            : static_cast<std::uint8_t>(255 - 215 * (depth - least) / std::max(1e-6F, most - least)));
  return out;
}

Bitmap picture_in(const saved::Image& from, std::string& note) {
  const int width = static_cast<int>(from.width), height = static_cast<int>(from.height);
  const std::size_t pixels = std::size_t{from.width} * from.height;
  const auto bytes = [&](std::size_t each) {
    if (from.data.size() < each * pixels) throw ClientError("the picture has fewer bytes than its size says");
  };
  if (from.encoding == "rgb8" || from.encoding == "bgr8") {
    bytes(3);
    Bitmap out{width, height, 3, from.data};
    out.pixels.resize(3 * pixels);
    if (from.encoding == "bgr8")
      for (std::size_t i = 0; i < pixels; ++i) std::swap(out.pixels[3 * i], out.pixels[3 * i + 2]);
    return out;
  }
  if (from.encoding == "32FC1") {
    bytes(4);
    std::vector<float> depths(pixels);
    std::memcpy(depths.data(), from.data.data(), 4 * pixels);
    return grey_of_depths(depths, width, height, note);
  }
  if (from.encoding == "16UC1" || from.encoding == "mono16") {
    bytes(2);
    std::vector<float> values;
    for (std::size_t i = 0; i < pixels; ++i) {
      std::uint16_t value = 0;
      std::memcpy(&value, &from.data[2 * i], 2);
      values.push_back(value == 0 ? NAN : static_cast<float>(value) * 1e-3F);
    }
    return grey_of_depths(values, width, height, note);
  }
  bytes(1);
  note = from.encoding == "mono8" ? "" : fmt::format("the values of {} as they are", from.encoding);
  Bitmap out{width, height, 1, from.data};
  out.pixels.resize(pixels);
  return out;
}

std::string ply_of(const saved::PointCloud2& cloud) {
  const auto offset_of = [&](const char* name) {
    for (const auto& field : cloud.fields)
      if (field.name == name) return static_cast<int>(field.offset);
    return -1;
  };
  const int x = offset_of("x"), y = offset_of("y"), z = offset_of("z"), rgb = offset_of("rgb");
  if (x < 0 || y < 0 || z < 0) throw ClientError("the point cloud has no fields x, y, z");
  std::string points;
  std::size_t count = 0;
  for (std::size_t at = 0; at + cloud.point_step <= cloud.data.size(); at += cloud.point_step) {
    float p[3];
    const int offsets[] = {x, y, z};
    for (std::size_t i = 0; i < 3; ++i)
      std::memcpy(&p[i], &cloud.data[at + static_cast<std::size_t>(offsets[i])], 4);
    if (!std::isfinite(p[0] + p[1] + p[2])) continue;
    points.append(reinterpret_cast<const char*>(p), sizeof p);
    if (rgb >= 0) {
      const std::uint8_t* c = &cloud.data[at + static_cast<std::size_t>(rgb)];
      for (const int channel : {2, 1, 0}) points += static_cast<char>(c[channel]);
    }
    ++count;
  }
  return fmt::format(
             "ply\nformat binary_little_endian 1.0\ncomment frame {}\nelement vertex {}\nproperty float "
             "x\nproperty float "
             "y\nproperty float z\n{}end_header\n",
             cloud.header.frame_id, count,
             rgb >= 0 ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "") +
         points;
}

std::string csv_of(const saved::LaserScan& scan) {
  std::string out = "angle_rad,range_m,intensity\n";
  for (std::size_t i = 0; i < scan.ranges.size(); ++i)
    out += fmt::format("{:.6f},{},{}\n",
                       static_cast<double>(scan.angle_min) +
                           static_cast<double>(i) * static_cast<double>(scan.angle_increment),
                       scan.ranges[i], i < scan.intensities.size() ? scan.intensities[i] : 0);
  return out;
}

}  // namespace

std::string usual_ending(const std::string& type) {
  if (type == saved::Image::kType || type == saved::CompressedImage::kType) return ".png";
  if (type == saved::PointCloud2::kType) return ".ply";
  if (type == saved::LaserScan::kType) return ".csv";
  return ".yaml";
}

std::string saved_message(const TypeSupport& type, std::span<const std::byte> cdr, const std::string& ending,
                          std::string& note) {
  const bool picture = ending == ".png" || ending == ".jpg" || ending == ".jpeg";
  const auto encoded = [&](const Bitmap& image) {
    if (ending == ".png") return encode_png(image);
    return encode_jpeg(image, kJpegQuality);
  };
  if (picture && type.name == saved::Image::kType)
    return encoded(picture_in(decode<saved::Image>(cdr), note));
  if (picture && type.name == saved::CompressedImage::kType) {
    const auto compressed = decode<saved::CompressedImage>(cdr);
    const std::string bytes(compressed.data.begin(), compressed.data.end());
    return encoded(decode_image(bytes, "the compressed picture"));
  }
  if (ending == ".ply" && type.name == saved::PointCloud2::kType)
    return ply_of(decode<saved::PointCloud2>(cdr));
  if (ending == ".csv" && type.name == saved::LaserScan::kType) return csv_of(decode<saved::LaserScan>(cdr));
  std::string text;
  if (ending == ".yaml" || ending == ".yml") {
    if (const Status status = type.cdr_to_yaml(cdr, text); !status) throw ClientError(status.why());
    return text;
  }
  throw_usage_error(fmt::format("a {} cannot be saved as '{}'", type.name, ending),
                    fmt::format("name a file that ends in {} or .yaml", usual_ending(type.name)));
}

}  // namespace doppel::app
