#include "doppel/ros/server/asset_reader.h"

#include <fmt/format.h>

#include <optional>
#include <system_error>

#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/thrown.h"

namespace doppel {

AssetReader::~AssetReader() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void AssetReader::fetch(std::string uri, std::function<void(AssetLibrary::Answer)> done) {
  try {
    const std::lock_guard lock(mutex_);
    // run() catches whatever a request throws, so that the thread never ends early.
    if (!thread_.joinable()) thread_ = guarded_thread([this] { run(); }, [](const std::string& /*why*/) {});
    requests_.push_back({std::move(uri), done});
  } catch (const std::system_error& problem) {
    AssetLibrary::Answer answer;
    answer.why = fmt::format("no thread can be started to read files: {}", problem.what());
    done(std::move(answer));
    return;
  }
  wake_.notify_all();
}

void AssetReader::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ending_ || !requests_.empty(); });
    if (ending_) return;
    std::optional<ReadRequest> request = std::move(requests_.front());
    requests_.pop_front();
    lock.unlock();
    AssetLibrary::Answer answer;
    try {
      answer = library_->read(request->uri);
    } catch (...) {
      answer.why = thrown_text();  // out of memory, or an error of the file system
    }
    try {
      request->done(std::move(answer));
    } catch (...) {  // no memory for the result: only this request stays unanswered
    }
    request.reset();  // what it holds may call this object
    lock.lock();
  }
}

}  // namespace doppel
