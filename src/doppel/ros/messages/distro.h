#pragma once
// The distributions of ROS 2 and the one that this process has: its message types on the wire, the defaults
// of its controllers and their manager. Sources: the packages' release tags that tests/ros2/*_type_hashes.txt
// and control/manager/distro_differences.h name.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// In the order of their releases, so that ranges can be compared.
enum class Distro : std::uint8_t { jazzy, kilted, lyrical };

inline constexpr std::array<std::string_view, 3> kDistroNames{"jazzy", "kilted",
                                                              "lyrical"};  // as ROS_DISTRO has them
inline constexpr std::size_t kDistros = kDistroNames.size();
inline constexpr Distro kFirstDistro = Distro::jazzy, kLastDistro = Distro::lyrical;

inline std::vector<std::string> distro_names() {
  return {kDistroNames.begin(), kDistroNames.end()};
}
constexpr std::string_view to_string(Distro distro) {
  return kDistroNames[static_cast<std::size_t>(distro)];
}
// nullopt: there is none of this name here.
constexpr std::optional<Distro> distro_of(std::string_view name) {
  for (std::size_t i = 0; i < kDistros; ++i) {
    if (kDistroNames[i] == name) return static_cast<Distro>(i);
  }
  return std::nullopt;
}
DOPPEL_API std::string title(Distro distro);  // "ROS 2 Jazzy", for sentences

// The distributions from `first` to `last`, both included.
struct DistroRange {
  Distro first = kFirstDistro, last = kLastDistro;
  [[nodiscard]] constexpr bool contains(Distro distro) const { return distro >= first && distro <= last; }
  friend bool operator==(const DistroRange&, const DistroRange&) = default;
};

// Jazzy until it is set. Set before the first message and the first controller are made: messages that exist
// by then have the layout of the former one. Any thread may read it.
DOPPEL_API Distro ros_distro();
DOPPEL_API void set_ros_distro(Distro distro);
// Sets it unless it was set before: the distribution of peers, where the user has not chosen one.
DOPPEL_API void adopt_ros_distro(Distro distro);

// The distributions whose message of this name has this hash; empty: none, or the type is unknown here. A
// type that is equal in all of them gives all.
DOPPEL_API std::vector<Distro> distros_with(std::string_view type, std::string_view hash);

}  // namespace doppel
