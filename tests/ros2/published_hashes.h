#pragma once
// The distribution of the twin under test, by ROS_DISTRO, and the type hashes of its messages as ROS 2's own
// generator computes them.

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

namespace doppel::ros2_testing {

inline std::string twin_distro() {
  const char* const distro = std::getenv("ROS_DISTRO");
  return distro == nullptr ? "jazzy" : distro;
}

// The hashes by type: "sensor_msgs/msg/JointState". Kilted has the messages of Lyrical.
inline std::map<std::string, std::string> published_hashes() {
  std::map<std::string, std::string> hashes;
  for (const char* const file_distro : {"jazzy", "lyrical"}) {
    if (std::string(file_distro) == "lyrical" && twin_distro() == "jazzy") continue;
    std::ifstream file(std::string(std::getenv("DOPPEL_ROOT")) + "/tests/ros2/" + file_distro +
                       "_type_hashes.txt");
    std::string type, hash;
    for (std::string line; std::getline(file, line);)
      if (std::istringstream words(line); !line.starts_with('#') && words >> type >> hash)
        hashes[type] = hash;
  }
  return hashes;
}

}  // namespace doppel::ros2_testing
