#pragma once
// A world's place on Earth: WGS 84 coordinates of points near its origin, and the standard atmosphere. Sources:
// NIMA TR8350.2 (WGS 84); B. Bowring, "Transformation from spatial to geographical coordinates", 1976; U.S. Standard
// Atmosphere 1976.

#include <Eigen/Core>

#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API GeographicPoint {
  double latitude = 0, longitude = 0;  // degrees, north and east positive
  double altitude = 0;                 // m above the ellipsoid
};

// The position of a world on Earth, and the magnetic field there.
struct DOPPEL_API EarthFrame {
  bool is_given = false;   // by the world; false: the origin below stands in
  GeographicPoint origin;  // of the world's frame, whose z is up
  double heading = 0;      // rad from east to the world's x, counterclockwise
  Eigen::Vector3d magnetic_field{5.5645e-6, 22.8758e-6, -42.3884e-6};  // T, world axes; SDFormat's default
};

// Earth-centred, earth-fixed coordinates, m.
[[nodiscard]] DOPPEL_API Eigen::Vector3d to_earth_fixed(const GeographicPoint& point);
// Latitude within 1e-9 degrees, altitude within 1e-4 m, from 100 km below the ellipsoid upwards.
[[nodiscard]] DOPPEL_API GeographicPoint from_earth_fixed(const Eigen::Vector3d& p_E);
// Of a point of the world, m.
[[nodiscard]] DOPPEL_API GeographicPoint geographic_point(const EarthFrame& earth,
                                                          const Eigen::Vector3d& p_W);

// Pa at an altitude above the sea, m, below 11 km.
[[nodiscard]] DOPPEL_API double standard_pressure(double altitude);

}  // namespace doppel
