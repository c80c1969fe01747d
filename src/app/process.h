#pragma once
// What the operating system knows of this process.

#include <atomic>
#include <filesystem>

namespace doppel::app {

// Milliseconds since this process was started (by the kernel's account, in units of 10 ms, never too few).
double milliseconds_since_process_start();

// The most memory this process has ever held, MB (10^6 bytes).
double peak_rss_mb();

// What was started without stdin, stdout or stderr gets /dev/null for them: else the next file or connection
// would stand in their place, and be written to.
void fill_standard_files();

// From now on SIGINT and SIGTERM do not end the process; they set the flag that is returned.
const std::atomic<bool>& stop_on_signals();

}  // namespace doppel::app
