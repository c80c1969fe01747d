#include "doppel/description/gazebo/detail/sensor_values.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <sstream>

#include "doppel/base/core/text.h"

namespace doppel {

namespace {

const XmlNode* find_spelled(const XmlNode& element, const std::string& name) {
  for (const char* prefix : {"", "gz_", "ignition_", "gz:", "ignition:"})
    if (const XmlNode* found = element.first(prefix + name)) return found;
  return nullptr;
}

const XmlNode* find_below(const XmlNode* at, const std::string& path) {
  for (std::size_t begin = 0; at != nullptr && begin <= path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    at = find_spelled(*at, path.substr(begin, end - begin));
    begin = end + 1;
  }
  return at;
}

}  // namespace

const XmlNode* SensorValues::find(const std::string& path) const {
  const XmlNode* const own = find_below(&element_, path);
  if (own != nullptr || preset_ == nullptr) return own;
  return find_below(preset_, path.starts_with("lidar") ? "ray" + path.substr(5) : path);
}

void SensorValues::warn(const XmlNode& at, const std::string& what, const std::string& used) const {
  diagnostics_.warning("sensor.value", at.where,
                       fmt::format("<{}>{}</{}> {}; {} is used", at.name, at.content(), at.name, what, used));
}

void SensorValues::refuse(const std::string& path, const std::string& why) const {
  const XmlNode* const at = find(path);
  diagnostics_.warning("sensor.value", (at != nullptr ? *at : element_).where,
                       fmt::format("<{}>: {}", path, why));
}

double SensorValues::number(const std::string& path, double otherwise) const {
  const XmlNode* at = find(path);
  if (at == nullptr) return otherwise;
  const std::optional<double> value = parse_number(at->content());
  if (value) return *value;
  warn(*at, "is not a finite number", fmt::format("{}", otherwise));
  return otherwise;
}

double SensorValues::distance_or_all(const std::string& path, double otherwise) const {
  const XmlNode* at = find(path);
  const std::string text = at == nullptr ? "" : at->content();
  return text == "inf" || text == "+inf" || text == "infinity" ? HUGE_VAL : number(path, otherwise);
}

double SensorValues::within(const std::string& path, double otherwise, double least, double most) const {
  const double value = number(path, otherwise);
  if (value >= least && value <= most) return value;
  if (const XmlNode* at = find(path))
    warn(*at, fmt::format("is not from {} to {}", least, most), fmt::format("{}", otherwise));
  return otherwise;
}

double SensorValues::not_negative(const std::string& path, double otherwise) const {
  const double value = number(path, otherwise);
  if (value >= 0) return value;
  if (const XmlNode* at = find(path)) warn(*at, "is negative", fmt::format("{}", otherwise));
  return otherwise;
}

int SensorValues::count(const std::string& path, int otherwise) const {
  const double value = number(path, otherwise);
  if (value >= 1 && value <= 100'000 && value == std::floor(value)) return static_cast<int>(value);
  if (const XmlNode* at = find(path))
    warn(*at, "is not a count from 1 to 100000", fmt::format("{}", otherwise));
  return otherwise;
}

bool SensorValues::flag(const std::string& path, bool otherwise) const {
  const XmlNode* at = find(path);
  if (at == nullptr) return otherwise;
  const std::string text = at->content();
  if (text == "1" || text == "true" || text == "True") return true;
  if (text == "0" || text == "false" || text == "False") return false;
  warn(*at, "is neither true nor false", otherwise ? "true" : "false");
  return otherwise;
}

std::string SensorValues::text(const std::string& path, const std::string& otherwise) const {
  const XmlNode* at = find(path);
  return at == nullptr ? otherwise : at->content();
}

Eigen::Vector3d SensorValues::vector(const std::string& path) const {
  const XmlNode* at = find(path);
  if (at == nullptr) return Eigen::Vector3d::Zero();
  std::vector<double> n;
  std::istringstream words(at->content());
  for (std::string word; words >> word;) n.push_back(parse_number(word).value_or(NAN));
  if (n.size() != 3 || !std::isfinite(std::accumulate(n.begin(), n.end(), 0.0))) {
    warn(*at, "is not three numbers", "zero");
    return Eigen::Vector3d::Zero();
  }
  return {n[0], n[1], n[2]};
}

Pose SensorValues::pose(const std::string& path) const {
  const XmlNode* at = find(path);
  if (at == nullptr) return Pose::Identity();
  std::vector<double> n;
  std::istringstream words(at->content());
  for (std::string word; words >> word;) n.push_back(parse_number(word).value_or(NAN));
  if (n.size() != 6 || !std::isfinite(std::accumulate(n.begin(), n.end(), 0.0))) {
    warn(*at, "is not six numbers", "the identity");
    return Pose::Identity();
  }
  const XmlAttribute* degrees = at->find("degrees");
  const double unit =
      degrees != nullptr && (degrees->value == "true" || degrees->value == "1") ? M_PI / 180 : 1;
  return make_pose({n[0], n[1], n[2]}, unit * Eigen::Vector3d(n[3], n[4], n[5]));
}

NoiseDescription SensorValues::noise(const std::string& path) const {
  NoiseDescription out;
  const XmlNode* at = find(path);
  if (at == nullptr) return out;
  const SensorValues inner(*at, diagnostics_);
  std::string type = inner.text("type");
  if (const XmlAttribute* attribute = at->find("type")) type = attribute->value;
  if (type == "none") return out;
  out.mean = inner.number("mean", 0);
  out.stddev = inner.not_negative("stddev", 0);
  out.bias_mean = inner.number("bias_mean", 0);
  out.bias_stddev = inner.not_negative("bias_stddev", 0);
  out.walk_stddev = inner.not_negative("dynamic_bias_stddev", 0);
  out.walk_time = inner.not_negative("dynamic_bias_correlation_time", 0);
  if (type == "gaussian_quantized") out.precision = inner.not_negative("precision", 0);
  return out;
}

}  // namespace doppel
