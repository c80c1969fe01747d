#include "doppel/base/math/geodesy.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace doppel {
namespace {

constexpr double kSemiMajorAxis = 6378137.0, kFlattening = 1 / 298.257223563;  // m
constexpr double kSemiMinorAxis = kSemiMajorAxis * (1 - kFlattening);
constexpr double kEccentricity2 = kFlattening * (2 - kFlattening);
constexpr double kDegree = std::numbers::pi / 180;

// Of the standard atmosphere.
constexpr double kGasConstant = 8314.32;  // N m / (kmol K)
constexpr double kMolarMass = 28.9644;    // kg / kmol
constexpr double kStandardGravity = 9.80665;
constexpr double kEarthRadius = 6356766.0;                        // m
constexpr double kSeaLevelPressure = 101325;                      // Pa
constexpr double kSeaLevelTemperature = 288.15, kLapse = 0.0065;  // K, K/m

// Columns: east, north and up at the point, in earth-fixed axes.
Eigen::Matrix3d local_axes(const GeographicPoint& at) {
  const double lat = at.latitude * kDegree, lon = at.longitude * kDegree;
  Eigen::Matrix3d R;
  R.col(0) << -std::sin(lon), std::cos(lon), 0;
  R.col(1) << -std::sin(lat) * std::cos(lon), -std::sin(lat) * std::sin(lon), std::cos(lat);
  R.col(2) << std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat);
  return R;
}

}  // namespace

Eigen::Vector3d to_earth_fixed(const GeographicPoint& point) {
  const double lat = point.latitude * kDegree, lon = point.longitude * kDegree;
  const double n = kSemiMajorAxis / std::sqrt(1 - kEccentricity2 * std::sin(lat) * std::sin(lat));
  return {(n + point.altitude) * std::cos(lat) * std::cos(lon),
          (n + point.altitude) * std::cos(lat) * std::sin(lon),
          (n * (1 - kEccentricity2) + point.altitude) * std::sin(lat)};
}

// Bowring's iteration for the parametric latitude, which converges within three rounds at every altitude.
GeographicPoint from_earth_fixed(const Eigen::Vector3d& p_E) {
  constexpr int kRounds = 4;
  const double from_axis = std::hypot(p_E.x(), p_E.y());
  const double second2 = kEccentricity2 / (1 - kEccentricity2);
  double parametric = std::atan2(p_E.z() * kSemiMajorAxis, from_axis * kSemiMinorAxis), lat = 0;
  for (int i = 0; i < kRounds; ++i) {
    lat = std::atan2(p_E.z() + second2 * kSemiMinorAxis * std::pow(std::sin(parametric), 3),
                     from_axis - kEccentricity2 * kSemiMajorAxis * std::pow(std::cos(parametric), 3));
    parametric = std::atan2((1 - kFlattening) * std::sin(lat), std::cos(lat));
  }
  const double n = kSemiMajorAxis / std::sqrt(1 - kEccentricity2 * std::sin(lat) * std::sin(lat));
  // The component along the local vertical, which is well conditioned at the poles, too.
  const double altitude =
      from_axis * std::cos(lat) + (p_E.z() + kEccentricity2 * n * std::sin(lat)) * std::sin(lat) - n;
  return {lat / kDegree, std::atan2(p_E.y(), p_E.x()) / kDegree, altitude};
}

GeographicPoint geographic_point(const EarthFrame& earth, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d p_local = Eigen::AngleAxisd(earth.heading, Eigen::Vector3d::UnitZ()) * p_W;
  return from_earth_fixed(to_earth_fixed(earth.origin) + local_axes(earth.origin) * p_local);
}

double standard_pressure(double altitude) {
  const double geopotential = kEarthRadius * altitude / (kEarthRadius + altitude);
  const double temperature = kSeaLevelTemperature - kLapse * geopotential;
  const double exponent = kStandardGravity * kMolarMass / (kGasConstant * kLapse);
  return kSeaLevelPressure * std::pow(temperature / kSeaLevelTemperature, exponent);
}

}  // namespace doppel
