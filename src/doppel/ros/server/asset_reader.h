#pragma once
// Reads assets on a separate thread, one after the other, so that no client waits for the disk. The first
// request starts the thread.

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "doppel/export.h"
#include "doppel/ros/server/asset_library.h"

namespace doppel {

class DOPPEL_API AssetReader {
 public:
  explicit AssetReader(std::shared_ptr<AssetLibrary> library) : library_(std::move(library)) {}
  ~AssetReader();  // drops requests that have not begun
  AssetReader(const AssetReader&) = delete;
  AssetReader& operator=(const AssetReader&) = delete;

  [[nodiscard]] bool offers() const { return library_ != nullptr; }
  // `done` is called on the reader's thread.
  void fetch(std::string uri, std::function<void(AssetLibrary::Answer)> done);

 private:
  struct ReadRequest {
    std::string uri;
    std::function<void(AssetLibrary::Answer)> done;
  };
  void run();

  std::shared_ptr<AssetLibrary> library_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<ReadRequest> requests_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace doppel
