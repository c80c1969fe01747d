#pragma once
// The operating system's data about this process.

#include <atomic>
#include <filesystem>

namespace doppel::app {

// Milliseconds since this process was started (by the kernel's account, in units of 10 ms, never too few).
double milliseconds_since_process_start();

// The peak memory of this process, MB (10^6 bytes).
double peak_rss_mb();

// Opens /dev/null for a missing stdin, stdout or stderr: otherwise the next file or connection would get the
// same descriptor, and be written to.
void fill_standard_files();

// From now on SIGINT, SIGTERM and SIGHUP (the terminal is closed) do not end the process; they set the flag
// that is returned.
const std::atomic<bool>& stop_on_signals();

}  // namespace doppel::app
