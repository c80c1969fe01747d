#pragma once
// The end of a program where its work throws or its output is lost: one message, and the exit code.

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>

#include "app/print_stderr.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/unavailable_error.h"

namespace doppel::app {

inline constexpr int kBadInput = 2;

inline int exit_code_of(const InputError& error) {
  return dynamic_cast<const UnavailableError*>(&error) != nullptr ? 1 : kBadInput;
}

// Reports that stdout could not be written, for the reason of errno's kind; 0: unknown. Returns the exit
// code.
inline int report_lost_output(int reason) {
  const InputError error("output.unwritable", make_location("stdout"),
                         std::string("cannot write the output") +
                             (reason != 0 ? std::string(": ") + std::strerror(reason) : std::string()),
                         "free disk space, or write elsewhere");
  print_stderr("{}\n", error.what());
  return kBadInput;
}

// The exit code of a program whose output may be buffered still: that of lost output, if it cannot be
// written. A reader that closes early (| head) is not a failure.
inline int with_output_written(int exit_code) {
  const bool failed = std::ferror(stdout) != 0;
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && !failed) return exit_code;
  return !flushed && errno == EPIPE ? exit_code : report_lost_output(errno);
}

// A failure of the operating system that is not caused by a file of the user. Returns the exit code.
inline int report_system_error(const std::system_error& error) {
  const int reason = error.code().value();
  std::error_code none;
  if (std::filesystem::current_path(none).empty()) {
    const InputError gone("cli.working_directory", {},
                          "the working directory does not exist any more, and a relative path starts there",
                          "change to a folder that exists");
    print_stderr("{}\n", gone.what());
    return kBadInput;
  }
  print_stderr("error: {}\n", error.what());
  if (reason == EMFILE || reason == ENFILE) print_stderr("  fix: permit more open files: ulimit -n 1024\n");
  if (reason == EAGAIN) print_stderr("  fix: permit more threads or processes: ulimit -u\n");
  return 1;
}

// The exit code that `work` returns; that of an InputError, kBadInput for lost output, 1 for anything else
// that it throws.
template <class Work>
int with_failures_reported(const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    print_stderr("{}\n", error.what());
    return exit_code_of(error);
  } catch (const std::system_error& error) {
    if (std::ferror(stdout) == 0) return report_system_error(error);
    const int reason = error.code().value();
    std::clearerr(stdout);  // reported here
    return reason == EPIPE ? 0 : report_lost_output(reason);
  } catch (const std::bad_alloc&) {
    print_stderr(
        "error: there is not enough memory\n  fix: free memory, or raise the limit: ulimit -v unlimited\n");
    return 1;
  } catch (const std::exception& error) {
    print_stderr("error: {}\n", error.what());
    return 1;
  }
}

}  // namespace doppel::app
