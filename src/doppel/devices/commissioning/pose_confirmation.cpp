#include "doppel/devices/commissioning/pose_confirmation.h"

#include <fmt/format.h>

#include "doppel/base/core/diagnostic.h"
#include "doppel/devices/commissioning/bus_scan.h"
#include "doppel/devices/drivers/pose_record.h"

namespace doppel {

void check_confirmation(const ServoSetup& setup,
                        const std::vector<std::pair<std::string, double>>& positions) {
  if (setup.protocol != ServoProtocol::servo_line)
    throw InputError("hardware.has_sensors", {},
                     fmt::format("the servos of '{}' report their positions: there is nothing to confirm",
                                 setup.component));
  check_pose(setup, positions);
}

void confirm_pose(ByteLink& link, const ServoSetup& setup,
                  const std::vector<std::pair<std::string, double>>& positions) {
  check_confirmation(setup, positions);
  const std::vector<FoundDevice> found =
      scan_link(link, {.protocols = {ServoProtocol::servo_line}, .rates = {setup.rate}});
  if (found.empty())
    throw InputError("hardware.no_answer", {},
                     fmt::format("no board answers on {} at {} bit/s", link.name(), setup.rate),
                     "doppel hardware scan");
  write_pose_record(pose_record_file(setup.component, setup.port),
                    {.boot = found.front().boot, .positions = positions});
}

}  // namespace doppel
