#pragma once
// Writes a message again, checked, at the end of a CDR form that has begun.

#include <span>

#include "doppel/ros/messages/detail/cdr.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel {

Status append_cdr(const TypeDescription& type, std::span<const std::byte> cdr, CdrAppender& out);

}  // namespace doppel
