#pragma once
// A file with faults of emulated devices. It can be edited while they run: their times count from the moment
// at which it was read.
//
//   faults:
//     - {fault: drop, share: 1 %}
//     - {fault: unplug, begin: 2 s, end: 3 s}
//     - {fault: hot, servo: 2, amount: 72}     # degrees Celsius; late: s, slip: rad or "5 deg"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/file_version.h"
#include "doppel/base/core/log.h"
#include "doppel/devices/emulation/emulated_faults.h"
#include "doppel/export.h"

namespace doppel {

// `start` is added to all times. Throws InputError with all errors at their places.
[[nodiscard]] DOPPEL_API std::vector<EmulatedFault> read_fault_file(const std::filesystem::path& file,
                                                                    Time start);

// The same file, again whenever it was saved.
class DOPPEL_API FaultFile {
 public:
  explicit FaultFile(std::filesystem::path file) : file_(std::move(file)) {}

  // nullopt: it is as it was. Throws InputError; the faults stay as they were then.
  std::optional<std::vector<EmulatedFault>> read_if_changed(Time now);

 private:
  std::filesystem::path file_;
  std::optional<FileVersion> read_;  // of the file when it was read last
};

// read_if_changed() of a running emulation, whose file has an error for a while: it is logged.
[[nodiscard]] DOPPEL_API std::optional<std::vector<EmulatedFault>> read_again(FaultFile& file, Time now,
                                                                              const Log& log,
                                                                              const std::string& origin);

}  // namespace doppel
