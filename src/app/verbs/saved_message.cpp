#include "app/verbs/saved_message.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>

#include "app/verbs/shell.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel::app {
namespace {

namespace saved = sensor_msgs::msg;
constexpr int kJpegQuality = 92;
constexpr auto kAnotherEnding = "name a file that ends in .yaml";

// -- pictures

// Any program may have sent the picture: its numbers may contradict each other.
void check_size(const saved::Image& from, std::size_t bytes_of_pixel, std::size_t step) {
  const std::size_t row = bytes_of_pixel * from.width;
  if (from.width == 0 || from.height == 0) throw ClientError("the picture has no pixels");
  if (from.width > kMaxImagePixels / from.height)
    throw ClientError(fmt::format("the picture has {} x {} pixels; at most {} in all are saved", from.width,
                                  from.height, kMaxImagePixels));
  if (step < row)
    throw ClientError(fmt::format("the picture's rows have {} bytes; its width is {}", step, row));
  if (from.data.size() < step * (from.height - 1) + row)
    throw ClientError(fmt::format("the picture has {} bytes; by its size it has {}", from.data.size(),
                                  step * (from.height - 1) + row));
}

// The rows without the bytes that pad them.
std::vector<std::uint8_t> rows_of(const saved::Image& from, std::size_t bytes_of_pixel) {
  const std::size_t row = bytes_of_pixel * from.width, step = from.step == 0 ? row : from.step;
  check_size(from, bytes_of_pixel, step);
  std::vector<std::uint8_t> out(row * from.height);
  for (std::size_t y = 0; y < from.height; ++y) std::memcpy(&out[y * row], &from.data[y * step], row);
  return out;
}

template <class Value>
std::vector<float> values_of(const saved::Image& from) {
  const std::vector<std::uint8_t> bytes = rows_of(from, sizeof(Value));
  std::vector<float> out(bytes.size() / sizeof(Value));
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::array<std::uint8_t, sizeof(Value)> one{};
    std::copy_n(&bytes[i * sizeof(Value)], sizeof(Value), one.begin());
    if (from.is_bigendian != 0) std::reverse(one.begin(), one.end());
    out[i] = static_cast<float>(std::bit_cast<Value>(one));
  }
  return out;
}

// From `light` to `dark` in equal steps; what is not finite is black.
Bitmap grey_of(const saved::Image& from, const std::vector<float>& values, float light, float dark) {
  constexpr float kDarkest = 40, kLightest = 255;
  Bitmap out{static_cast<int>(from.width), static_cast<int>(from.height), 1, {}};
  for (const float value : values) {
    const float share = light == dark ? 0 : (value - light) / (dark - light);
    out.pixels.push_back(
        std::isfinite(value) ? static_cast<std::uint8_t>(kLightest + share * (kDarkest - kLightest)) : 0);
  }
  return out;
}

std::optional<std::pair<float, float>> ends_of(const std::vector<float>& values) {
  std::optional<std::pair<float, float>> out;
  for (const float value : values) {
    if (!std::isfinite(value)) continue;
    if (!out) out = {value, value};
    out->first = std::min(out->first, value);
    out->second = std::max(out->second, value);
  }
  return out;
}

Bitmap grey_of_depths(const saved::Image& from, const std::vector<float>& depths, std::string& note) {
  const auto ends = ends_of(depths);
  note = ends ? fmt::format("depths from {:.3f} m (light) to {:.3f} m (dark); black: none", ends->first,
                            ends->second)
              : "no depth in the picture";
  return grey_of(from, depths, ends ? ends->first : 0, ends ? ends->second : 0);
}

Bitmap grey_of_values(const saved::Image& from, std::string& note) {
  std::vector<float> values = values_of<std::uint16_t>(from);
  for (float& value : values)
    if (value == 0) value = NAN;
  const auto ends = ends_of(values);
  note = ends ? fmt::format("values from {} (dark) to {} (light); black: 0", ends->first, ends->second)
              : "all values are 0";
  return grey_of(from, values, ends ? ends->second : 0, ends ? ends->first : 0);
}

Bitmap bytes_of(const saved::Image& from, int channels, bool blue_first) {
  const auto each = static_cast<std::size_t>(channels);
  Bitmap out{static_cast<int>(from.width), static_cast<int>(from.height), channels, rows_of(from, each)};
  if (blue_first)
    for (std::size_t i = 0; i < out.pixels.size(); i += each) std::swap(out.pixels[i], out.pixels[i + 2]);
  return out;
}

Bitmap picture_in(const saved::Image& from, std::string& note) {
  const std::string& encoding = from.encoding;
  if (encoding == "rgb8" || encoding == "bgr8") return bytes_of(from, 3, encoding == "bgr8");
  if (encoding == "rgba8" || encoding == "bgra8") return bytes_of(from, 4, encoding == "bgra8");
  if (encoding == "mono16") return grey_of_values(from, note);
  if (encoding == "32FC1") return grey_of_depths(from, values_of<float>(from), note);
  if (encoding == "16UC1") {
    std::vector<float> depths = values_of<std::uint16_t>(from);  // mm
    for (float& depth : depths) depth = depth == 0 ? NAN : depth * 1e-3F;
    return grey_of_depths(from, depths, note);
  }
  if (encoding != "mono8") {
    if (encoding != "8UC1" && !(encoding.starts_with("bayer_") && encoding.ends_with("8")))
      throw_usage_error(fmt::format("image encoding '{}' cannot be written as PNG or JPEG", encoding),
                        kAnotherEnding);
    note = fmt::format("the values of {} as they are", encoding);
  }
  return bytes_of(from, 1, false);
}

Bitmap without_opacity(const Bitmap& from) {
  if (from.channels % 2 == 1) return from;
  const auto each = static_cast<std::size_t>(from.channels);
  Bitmap out{from.width, from.height, from.channels - 1, {}};
  for (std::size_t i = 0; i < from.pixels.size(); ++i)
    if (i % each != each - 1) out.pixels.push_back(from.pixels[i]);
  return out;
}

// -- point clouds

// The offset of a field in a point; it has 4 bytes within the point.
std::optional<std::size_t> offset_of(const saved::PointCloud2& cloud, const std::string& name) {
  for (const auto& field : cloud.fields) {
    if (field.name != name) continue;
    const bool is_word = field.datatype == saved::PointField::FLOAT32 ||
                         (name == "rgb" && field.datatype == saved::PointField::UINT32);
    if (is_word && std::size_t{field.offset} + 4 <= cloud.point_step) return field.offset;
  }
  return std::nullopt;
}

// The bytes from one row to the next, checked as those of pictures are.
std::size_t checked_row_step(const saved::PointCloud2& cloud) {
  const std::size_t row = std::size_t{cloud.width} * cloud.point_step,
                    step = cloud.row_step == 0 ? row : cloud.row_step;
  if (cloud.is_bigendian)
    throw_usage_error("point clouds of big-endian numbers are not saved as .ply", kAnotherEnding);
  const std::size_t before_last = cloud.height == 0 ? 0 : cloud.height - 1;
  if (step < row || cloud.data.size() < row ||
      (before_last > 0 && (cloud.data.size() - row) / before_last < step))
    throw ClientError(
        fmt::format("the point cloud has {} bytes; by its size it has {} x {} points of {} bytes",
                    cloud.data.size(), cloud.width, cloud.height, cloud.point_step));
  return step;
}

std::string ply_of(const saved::PointCloud2& cloud) {
  const auto x = offset_of(cloud, "x"), y = offset_of(cloud, "y"), z = offset_of(cloud, "z"),
             rgb = offset_of(cloud, "rgb");
  if (!x || !y || !z)
    throw_usage_error("the point cloud has no fields x, y, z of the type FLOAT32 within its points",
                      kAnotherEnding);
  const std::size_t step = checked_row_step(cloud);
  std::string points;
  std::size_t count = 0;
  for (std::size_t row = 0; row < cloud.height; ++row)
    for (std::size_t column = 0; column < cloud.width; ++column) {
      const std::uint8_t* const point = &cloud.data[row * step + column * cloud.point_step];
      std::array<float, 3> p{};
      const std::array offsets{*x, *y, *z};
      for (std::size_t i = 0; i < 3; ++i) std::memcpy(&p[i], point + offsets[i], 4);
      if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
      points.append(reinterpret_cast<const char*>(p.data()), sizeof p);
      if (rgb)
        for (const std::size_t channel : {2U, 1U, 0U}) points += static_cast<char>(point[*rgb + channel]);
      ++count;
    }
  std::string frame = cloud.header.frame_id;
  std::replace_if(
      frame.begin(), frame.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, '_');
  return fmt::format(
             "ply\nformat binary_little_endian 1.0\ncomment frame {}\nelement vertex {}\nproperty float "
             "x\nproperty float "
             "y\nproperty float z\n{}end_header\n",
             frame, count, rgb ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "") +
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

std::string ending_of(const std::string& file) {
  std::string ending = std::filesystem::path(file).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

bool is_picture(const std::string& ending) {
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

std::string encoded_picture(const Bitmap& picture, const std::string& ending) {
  return ending == ".png" ? encode_png(picture) : encode_jpeg(without_opacity(picture), kJpegQuality);
}

std::string usual_ending(const std::string& type) {
  if (type == saved::Image::kType || type == saved::CompressedImage::kType) return ".png";
  if (type == saved::PointCloud2::kType) return ".ply";
  if (type == saved::LaserScan::kType) return ".csv";
  return ".yaml";
}

void check_ending(const std::string& type, const std::string& ending) {
  const std::string usual = usual_ending(type);
  if (ending == usual || ending == ".yaml" || ending == ".yml") return;
  if (is_picture(usual) && is_picture(ending)) return;
  const std::string endings = is_picture(usual)  ? ".png, .jpg or .yaml"
                              : usual == ".yaml" ? ".yaml"
                                                 : usual + " or .yaml";
  throw_usage_error(fmt::format("a {} cannot be saved as '{}'", type, ending),
                    fmt::format("name a file that ends in {}", endings));
}

std::string saved_message(const TypeSupport& type, std::span<const std::byte> cdr, const std::string& ending,
                          std::string& note) {
  check_ending(type.name, ending);
  if (ending == ".ply") return ply_of(decode<saved::PointCloud2>(cdr));
  if (ending == ".csv") return csv_of(decode<saved::LaserScan>(cdr));
  if (is_picture(ending)) {
    if (type.name == saved::Image::kType)
      return encoded_picture(picture_in(decode<saved::Image>(cdr), note), ending);
    const auto compressed = decode<saved::CompressedImage>(cdr);
    const std::string bytes(compressed.data.begin(), compressed.data.end());
    return encoded_picture(decode_image(bytes, "the compressed picture"), ending);
  }
  std::string text;
  if (const Status status = type.cdr_to_yaml(cdr, text); !status) throw ClientError(status.why());
  return text;
}

}  // namespace doppel::app
