#pragma once
// Recordings in the page without a twin: a server with the page and the files of one or two bags. The page
// reads them by HTTP ranges (web/src/bag), so that they may be larger than the memory. The server has no
// topics and is not announced: other shells do not take it for a twin.

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/server/server.h"
#include "doppel/session/live/server_edge.h"

namespace doppel {

// True if it is a recording and not a description: a file that is named or begins as one, a folder with .mcap
// or .db3 files, or its metadata.yaml. Also names of files that do not exist, for the right message.
[[nodiscard]] DOPPEL_API bool is_recording(const std::string& word);

struct ViewedBag {
  std::string name;  // of the file or folder
  bool is_folder = false;
  std::vector<std::string> files;  // all on one time line
  std::vector<std::string> notes;  // about files that were not closed, and whatever else the page will lack
};
// Reads the beginnings and the indices of the files alone. Throws InputError: there is no such file (with the
// nearest name), or it is no MCAP file.
[[nodiscard]] DOPPEL_API ViewedBag open_viewed_bag(const std::string& word);

class DOPPEL_API RecordingView {
 public:
  // `bags`: one, or two that are compared; `time`: s since the start, which the page shows first. Listens
  // when it returns. Throws InputError if no port is available or the page is not built. `log` outlives it.
  RecordingView(const std::vector<ViewedBag>& bags, std::optional<double> time,
                const ServerEdgeOptions& options, const Log& log);

  [[nodiscard]] const std::string& page_url() const { return page_url_; }  // that of the recording
  // Answers requests of clients other than the page, after waiting for one at most so long.
  void serve(std::chrono::milliseconds at_most) {
    bus_.wait(at_most);
    bus_.spin();
  }
  [[nodiscard]] bool has_token() const { return !server_.token().empty(); }

 private:
  Bus bus_;  // without nodes
  Server server_;
  std::string page_url_;
};

}  // namespace doppel
