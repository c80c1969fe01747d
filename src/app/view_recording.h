#pragma once
// doppel view of recordings.

#include <optional>
#include <string>
#include <vector>

#include "app/edge_options.h"

namespace doppel::app {

struct RecordingOptions {
  std::vector<std::string> words;  // one recording, or two
  std::optional<double> time;      // s since the start
  bool opens_browser = true;
  EdgeOptions edges;
};

// Until Ctrl-C. Throws InputError.
int view_recording(const RecordingOptions& options, const RosArguments& ros);

}  // namespace doppel::app
