#pragma once
// What the operating system knows of this process.

#include <filesystem>

namespace doppel::app {

// Milliseconds since this process was started (by the kernel's account, in units of 10 ms, never too few).
double milliseconds_since_process_start();

// The most memory this process has ever held, MB (10^6 bytes).
double peak_rss_mb();

// The folder that holds robots/ and worlds/: DOPPEL_ROOT, else where this program was built from.
std::filesystem::path root_folder();

}  // namespace doppel::app
