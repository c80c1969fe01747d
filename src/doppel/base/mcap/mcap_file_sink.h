#pragma once
// An MCAP file that is being written.

#include <cstdint>
#include <string>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/base/mcap/mcap_writer.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API McapFileSink : public McapSink {
 public:
  // A new file. Throws InputError "output.unwritable" with the system's reason, also if it exists already.
  explicit McapFileSink(const std::string& path);

  // Throws InputError "output.unwritable", for instance when the disk is full; what was written before stays,
  // nothing of these bytes does, and later calls throw the same.
  void write(McapBytes bytes) override;
  // Until the bytes are on the disk.
  void sync();

 private:
  [[noreturn]] void fail(int error) const;

  std::string path_;
  FileDescriptor file_;
  std::uint64_t size_ = 0;
  int failed_ = 0;  // errno of the first failure
};

}  // namespace doppel
