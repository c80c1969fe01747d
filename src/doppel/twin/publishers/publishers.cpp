#include "doppel/twin/publishers/publishers.h"

#include <fmt/format.h>

#include "doppel/twin/loop/twin_core.h"
#include "doppel/twin/publishers/detail/clock_publisher.h"
#include "doppel/twin/publishers/detail/contact_publisher.h"
#include "doppel/twin/publishers/detail/contact_room_monitor.h"
#include "doppel/twin/publishers/detail/keep_out_publisher.h"
#include "doppel/twin/publishers/object_publisher.h"

namespace doppel {

void add_publishers(TwinCore& core) {
  core.add(std::make_unique<ClockPublisher>(core.bus(), core.scene()));
  core.add(std::make_unique<ContactPublisher>(core.bus(), core.scene()));
  core.add(std::make_unique<ObjectPublisher>(core.bus(), core.scene()));
  core.add(std::make_unique<KeepOutPublisher>(core));
  core.add(std::make_unique<ContactRoomMonitor>(core.scene(), core.log()));
}

void ContactRoomMonitor::between_steps(Time now) {
  if (reported_ || scene_.engine().dropped_contacts() == 0) return;
  reported_ = true;
  log_.warning("physics",
               fmt::format("t = {:.3f} s: more shapes touch than the engine has room for; some contacts have "
                           "no effect, and bodies may sink into each other (use fewer or simpler shapes)",
                           to_seconds(now)));
}

}  // namespace doppel
