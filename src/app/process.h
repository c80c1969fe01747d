#pragma once
// The operating system's data about this process.

#include <atomic>
#include <filesystem>
#include <string>

namespace doppel::app {

// Milliseconds since this process was started (by the kernel's account, in units of 10 ms, never too few).
double milliseconds_since_process_start();

// The peak memory of this process, MB (10^6 bytes).
double peak_rss_mb();

// Opens /dev/null for a missing stdin, stdout or stderr: otherwise the next file or connection would get the
// same descriptor, and be written to.
void fill_standard_files();

// From now on the first SIGINT, SIGTERM or SIGHUP (the terminal is closed) does not end the process; it sets
// the flag that is returned. A second one ends the process at once, with the exit code of a shell: 128 plus
// the signal's number.
const std::atomic<bool>& stop_on_signals();
// Has the effect of the first signal. Any thread.
void request_stop();

// An argument, quoted for a shell where it needs it.
std::string shell_quoted(const std::string& argument);
// The command line that started this process, with the program's name instead of its path.
std::string own_command_line();

}  // namespace doppel::app
