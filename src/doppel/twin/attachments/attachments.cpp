#include "doppel/twin/attachments/attachments.h"

#include "doppel/twin/attachments/detail/attachment_services.h"
#include "doppel/twin/attachments/detail/grasp_monitor.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {

void add_attachments(TwinCore& core) {
  core.add(std::make_unique<AttachmentServices>(core.bus(), core.scene(), core.log()));
  core.add(std::make_unique<GraspMonitor>(core.bus(), core.scene(), core.log()));
}

}  // namespace doppel
