#include "doppel/ros/messages/distro.h"

#include <atomic>

#include "doppel/ros/messages/codec.h"

namespace doppel {
namespace {

std::atomic<Distro> current_distro{Distro::jazzy};
std::atomic<bool> is_chosen{false};

}  // namespace

std::string title(Distro distro) {
  std::string name(to_string(distro));
  name.front() = static_cast<char>(name.front() - 'a' + 'A');
  return "ROS 2 " + name;
}

Distro ros_distro() {
  return current_distro.load(std::memory_order_relaxed);
}

void set_ros_distro(Distro distro) {
  is_chosen = true;
  current_distro.store(distro, std::memory_order_relaxed);
}

void adopt_ros_distro(Distro distro) {
  if (!is_chosen) set_ros_distro(distro);
}

std::vector<Distro> distros_with(std::string_view type, std::string_view hash) {
  std::vector<Distro> found;
  const TypeSupport* const support = find_type(type);
  for (std::size_t i = 0; support != nullptr && i < kDistros; ++i) {
    if (support->hash(static_cast<Distro>(i)) == hash) found.push_back(static_cast<Distro>(i));
  }
  return found;
}

}  // namespace doppel
