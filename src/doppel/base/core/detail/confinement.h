#pragma once
// A filter of system calls for a child that reads and computes only: it cannot change a file, start a
// process, reach the network or another process, or read another one's environment or memory. Its pipes are
// its only effects. The paths of files are not visible to a filter, so that devices can be opened to read
// them.

#include <linux/filter.h>

#include <vector>

namespace doppel {

// The program is started by this descriptor, above those that the child can make later. (The filter stays
// with whatever runs in the process.)
inline constexpr int kProgramDescriptor = 200;
inline constexpr unsigned kMaxConfinedDescriptors = 128;

// Empty: there is none for this processor.
std::vector<sock_filter> confining_filter();

// In the child, after fork(): limits its resources and installs the filter. 0, or the number of the error.
int confine(const std::vector<sock_filter>& filter);

}  // namespace doppel
