#pragma once
// An MCAP file that is being written.

#include <cstdint>
#include <memory>
#include <string>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/base/mcap/mcap_writer.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API McapFileSink : public McapSink {
 public:
  // A new file. Throws InputError "output.unwritable" with the system's reason, also if it exists already.
  explicit McapFileSink(const std::string& path);
  ~McapFileSink() override;

  // Throws InputError "output.unwritable", for instance when the disk is full; what was written before stays,
  // nothing of these bytes does, and later calls throw the same.
  void write(McapBytes bytes) override;
  // Until the bytes are on the disk.
  void sync();
  // The same on a thread of its own, so that writing goes on while a slow disk takes what is there. A failure
  // is thrown by the next write().
  void start_sync();

 private:
  struct Background;
  [[noreturn]] void fail(int error) const;

  std::string path_;
  FileDescriptor file_;
  std::uint64_t size_ = 0;
  int failed_ = 0;                          // errno of the first failure
  std::unique_ptr<Background> background_;  // from the first start_sync() on
};

}  // namespace doppel
